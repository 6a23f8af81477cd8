#include "daq/live/feed.hpp"

#include <fmt/format.h>

namespace kphi::daq::live {

void History::keep(const Message& message) {
  if (message.kind == Message::Kind::limits) {
    limits_ = {message.text};
    return;
  }
  const bool is_step = message.kind == Message::Kind::step;
  auto& kept = is_step ? steps_ : others_;
  kept.push_back(message.text);
  if (kept.size() > (is_step ? kMostSteps : kMostLines)) kept.pop_front();
}

void History::keep(const Tick& tick) {
  if (!trace_.empty() && trace_.back().time_s == tick.time_s) return;
  trace_.push_back({tick.time_s, tick.thrust_n(), to_rpm(tick.position.commanded), tick.speed_rpm()});
  if (trace_.size() > kTraceLength) trace_.pop_front();
}

std::string History::message() const {
  std::string points, messages;
  const auto number = [](double value) { return value == value ? fmt::format("{:.7g}", value) : "null"; };
  for (const Point& point : trace_)
    points += fmt::format("{}[{:.3f},{},{},{}]", points.empty() ? "" : ",", point.time_s, number(point.thrust_n),
                          number(point.commanded_rpm), number(point.speed_rpm));
  for (const auto* kept : {&limits_, &steps_, &others_})
    for (const std::string& message : *kept) messages += (messages.empty() ? "" : ",") + message;
  return R"({"type":"history","trace":[)" + points + R"(],"messages":[)" + messages + "]}";
}

}  // namespace kphi::daq::live
