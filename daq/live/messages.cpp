#include "daq/live/messages.hpp"

#include <cmath>
#include <nlohmann/json.hpp>

namespace kphi::daq::live {
namespace {

using nlohmann::ordered_json;

/// NaN becomes null; bytes that are not UTF-8 become U+FFFD.
std::string text_of(const ordered_json& message) {
  return message.dump(-1, ' ', false, ordered_json::error_handler_t::replace);
}

/// Nine digits are more than any of the devices has.
double rounded(double value, int digits = 9) {
  if (value == 0 || !std::isfinite(value)) return value;
  const double scale = std::pow(10.0, digits - 1 - std::floor(std::log10(std::abs(value))));
  return std::isfinite(scale) ? std::round(value * scale) / scale : value;
}

void add_readings(ordered_json& to, const Tick& tick) {
  const auto add = [&](const char* key, double value) { to[key] = rounded(value); };
  add("commanded_rpm", tick.commanded_rpm);
  add("speed_rpm", tick.speed_rpm);
  add("speed_age_s", tick.speed_age_s);
  add("thrust_n", tick.thrust_n);
  add("thrust_age_s", tick.thrust_age_s);
  add("torque_nm", tick.torque_nm);
  add("module_v", tick.module_v);
  add("module_a", tick.module_a);
  add("supply_v", tick.supply_v);
  add("supply_a", tick.supply_a);
  add("coil_degc", tick.coil_degc);
  add("derate", tick.derate);
  to["fault_bits"] = tick.fault_bits;
  to["received"] = tick.received;
  to["lost_network"] = tick.lost_network;
  to["lost_host"] = tick.lost_host;
}

ordered_json to_json(const std::vector<GuardLimit>& limits) {
  ordered_json bars = ordered_json::array();
  for (const GuardLimit& limit : limits)
    bars.push_back({{"key", row_of(limit.watched).key},
                    {"name", row_of(limit.watched).label},
                    {"unit", limit.unit},
                    {"limit", rounded(limit.value)},
                    {"lower", limit.lower},
                    {"source", limit.source}});
  return bars;
}

}  // namespace

std::string hello_message(const Subject& subject) {
  return text_of({{"type", "hello"},
                  {"format", "kphi-live/2"},
                  {"replay", subject.replay},
                  {"name", subject.name},
                  {"propeller", subject.propeller},
                  {"speed_max_rpm", subject.speed_max_rpm},
                  {"limits", to_json(subject.limits)}});
}

Message limits_message(const std::vector<GuardLimit>& limits) {
  return {Message::Kind::limits, text_of({{"type", "limits"}, {"limits", to_json(limits)}})};
}

std::string tick_message(const Tick& tick, double silent_s, std::uint64_t dropped) {
  ordered_json message{{"type", "tick"},
                       {"time_s", tick.time_s},
                       {"progress", rounded(tick.progress)},
                       {"remaining_s", rounded(tick.remaining_s)},
                       {"propeller", tick.propeller.data()},
                       {"phase", tick.phase.data()},
                       {"step", tick.step},
                       {"steps", tick.steps},
                       {"occlusion_deg", tick.occlusion_deg},
                       {"repetition", tick.repetition},
                       {"repetitions", tick.repetitions}};
  add_readings(message, tick);
  for (const GuardedQuantity& row : kQuantities) message["watched"][row.key] = rounded(tick.watched[row.watched], 4);
  message["silent_s"] = rounded(silent_s);
  message["dropped"] = dropped;
  return text_of(message);
}

Message step_message(const Tick& at, const QuickLook::Result& seen) {
  return {Message::Kind::step, text_of({{"type", "step"},
                                        {"occlusion_deg", at.occlusion_deg},
                                        {"repetition", at.repetition},
                                        {"step", at.step},
                                        {"speed_rpm", rounded(to_rpm(RadPerSec(seen.speed_rad_s)))},
                                        {"speed2_rad2_s2", rounded(seen.speed_rad_s * seen.speed_rad_s)},
                                        {"thrust_n", rounded(seen.thrust_n)},
                                        {"k_n_s2", rounded(seen.k)},
                                        {"u_k_n_s2", rounded(seen.u_k)},
                                        {"n", seen.n}})};
}

Message line_message(double time_s, const std::string& text) {
  return {Message::Kind::other, text_of({{"type", "line"}, {"time_s", time_s}, {"text", text}})};
}

Message stop_message(double time_s) { return {Message::Kind::other, text_of({{"type", "stop"}, {"time_s", time_s}})}; }

Message end_message(double time_s, bool well, const std::string& text) {
  return {Message::Kind::other, text_of({{"type", "end"}, {"time_s", time_s}, {"well", well}, {"text", text}})};
}

std::string plot_message(const Tick& tick, const std::vector<GuardLimit>& limits) {
  ordered_json message{{"timestamp", tick.timestamp_s},
                       {"time_s", tick.time_s},
                       {"occlusion_deg", tick.occlusion_deg},
                       {"repetition", tick.repetition},
                       {"step", tick.step}};
  add_readings(message, tick);
  for (const GuardLimit& limit : limits)
    message["limit_share"][row_of(limit.watched).key] = rounded(share_of(limit, tick.watched[limit.watched]), 4);
  const auto drop_unknown = [](ordered_json& object) {
    for (auto item = object.begin(); item != object.end();) {
      const bool unknown = item->is_number_float() && !std::isfinite(item->get<double>());
      if (unknown)
        item = object.erase(item);
      else
        ++item;
    }
  };
  drop_unknown(message);
  if (message.contains("limit_share")) drop_unknown(message["limit_share"]);
  return text_of(message);
}

}  // namespace kphi::daq::live
