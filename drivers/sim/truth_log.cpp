#include "drivers/sim/truth_log.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

namespace kphi::sim {
namespace {

using nlohmann::ordered_json;

void add(std::string& lines, const ordered_json& line) { lines += line.dump() + "\n"; }

struct Total {
  const char* name;
  std::uint64_t WireTruth::*member;
};

using T = WireTruth;
constexpr Total kTotals[] = {
    {"sent", &T::sent},
    {"records_sent", &T::records_sent},
    {"arrived", &T::arrived},
    {"records_arrived", &T::records_arrived},
    {"dropped", &T::dropped},
    {"records_dropped", &T::records_dropped},
    {"duplicated", &T::duplicated},
    {"records_duplicated", &T::records_duplicated},
    {"overtaken", &T::overtaken},
    {"delayed", &T::delayed},
    {"malformed", &T::malformed},
    {"foreign", &T::foreign},
    {"records_left_out", &T::records_left_out},
    {"to_others", &T::to_others},
    {"records_to_others", &T::records_to_others},
    {"starts", &T::starts},
    {"starts_lost", &T::starts_lost},
    {"starts_doubled", &T::starts_doubled},
    {"starts_delayed", &T::starts_delayed},
    {"unheard", &T::unheard},
    {"takeovers", &T::takeovers},
    {"restarts", &T::restarts},
    {"reboots", &T::reboots},
    {"stalls", &T::stalls},
    {"jumps", &T::jumps},
    {"overruns", &T::overruns},
    {"rate_changes", &T::rate_changes},
    {"moves", &T::moves},
    {"http_spoilt", &T::http_spoilt},
    {"tcp_spoilt", &T::tcp_spoilt},
};

std::string_view name_of(PowerStage::Mode mode) noexcept {
  constexpr std::array<std::string_view, 3> kNames{"coast", "brake", "drive"};
  return kNames[static_cast<std::size_t>(mode)];
}

}  // namespace

std::string json_lines(const WireTruth& truth) {
  std::string lines;
  for (const FaultEvent& event : truth.events) add(lines, {{"at_ns", event.at.count()}, {"event", event.what}});
  for (const SentDatagram& d : truth.log) {
    ordered_json line{{"sent_ns", d.sent.count()}, {"boot", d.boot},         {"stream", d.stream},
                      {"first_rdt", d.first_rdt},  {"first_ft", d.first_ft}, {"last_ft", d.last_ft},
                      {"records", d.records},      {"samples", d.samples},   {"arrivals", d.arrivals}};
    if (d.arrivals > 0) line["first_arrival_ns"] = d.first_arrival.count();
    if (d.first_sample < truth.sampled.size()) line["first_sampled_ns"] = truth.sampled[d.first_sample].count();
    add(lines, line);
  }
  ordered_json totals;
  for (const Total& total : kTotals) totals[total.name] = truth.*total.member;
  add(lines, {{"totals", totals}});
  return lines;
}

std::string summary(const WireTruth& truth) {
  std::string out;
  for (const Total& total : kTotals) {
    if (truth.*total.member > 0)
      out += fmt::format("{}{} {}", out.empty() ? "" : ", ", total.name, truth.*total.member);
  }
  return out.empty() ? "nothing was sent" : out;
}

std::string json_lines(const IqTruth& truth) {
  std::string lines;
  for (const FaultEvent& event : truth.events) add(lines, {{"at_ns", event.at.count()}, {"motor_event", event.what}});
  for (const SentIqReply& r : truth.log) {
    std::string data;
    for (const std::uint8_t byte : r.data()) data += fmt::format("{:02x}", byte);
    ordered_json line{{"asked_ns", r.asked.count()},
                      {"begun_ns", r.begun.count()},
                      {"type", r.type},
                      {"sub", r.sub},
                      {"id", r.id},
                      {"data", data},
                      {"arrivals", r.arrivals}};
    if (r.arrivals > 0) line["arrived_ns"] = r.arrived.count();
    if (std::isfinite(r.truth)) line["truth"] = r.truth;
    for (int kind = 0; kind < kMotorFaultKinds; ++kind) {
      if ((r.done >> kind & 1u) != 0) line["faults"].push_back(name_of(static_cast<MotorFaultKind>(kind)));
    }
    add(lines, line);
  }
  ordered_json totals{{"bytes_from_host", truth.bytes_from_host},
                      {"bytes_to_module", truth.bytes_to_module},
                      {"bytes_from_module", truth.bytes_from_module},
                      {"bytes_to_host", truth.bytes_to_host},
                      {"replies", truth.replies},
                      {"frames_arrived", truth.frames_arrived},
                      {"spoilt", truth.spoilt}};
  for (int kind = 0; kind < kMotorFaultKinds; ++kind) {
    const auto count = truth.done[static_cast<std::size_t>(kind)];
    if (count > 0) totals[std::string(name_of(static_cast<MotorFaultKind>(kind)))] = count;
  }
  add(lines, {{"motor_totals", totals}});
  return lines;
}

std::string_view name_of(MotorDrive::Mode mode) noexcept {
  constexpr std::array<std::string_view, 5> kNames{"brake", "coast", "volts", "pwm", "velocity"};
  return kNames[static_cast<std::size_t>(mode)];
}

void MotionLog::look(const IqDevice& motor, double speed, Instant now) {
  const IqMotion& motion = motor.last_motion();
  const bool commanded =
      motion.at >= Instant{0} && (commands_.empty() || commands_.back().at != motion.at ||
                                  commands_.back().mode != motion.mode || commands_.back().target != motion.target);
  if (commanded) commands_.push_back(motion);
  const PowerStage::Mode mode = motor.stage().mode;
  if (stages_.empty() || stages_.back().mode != mode) stages_.push_back({now, mode, speed});
}

void MotionLog::look(const SupplyCircuit& supply, Instant now) {
  if (outputs_.empty() || outputs_.back().second != supply.output()) outputs_.emplace_back(now, supply.output());
}

std::string MotionLog::json_lines() const {
  std::string lines;
  for (const IqMotion& command : commands_) {
    const char* target = command.mode == MotorDrive::Mode::velocity ? "target_rad_s" : "target";
    add(lines, {{"at_ns", command.at.count()}, {"motion_command", name_of(command.mode)}, {target, command.target}});
  }
  for (const Stage& stage : stages_)
    add(lines, {{"at_ns", stage.at.count()}, {"stage", name_of(stage.mode)}, {"speed_rad_s", stage.speed}});
  for (const auto& [at, on] : outputs_) add(lines, {{"at_ns", at.count()}, {"supply_output", on}});
  return lines;
}

}  // namespace kphi::sim
