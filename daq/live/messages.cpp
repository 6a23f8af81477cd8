#include "daq/live/messages.hpp"

#include <cmath>
#include <iterator>

#include "base/json.hpp"

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
  const Observation& seen = tick.seen;
  const bool has_supply = seen.supply.time_ns != 0;
  const auto add = [&](const char* key, double value, bool known = true) {
    to[key] = known ? rounded(value) : kUnknown;
  };
  add("commanded_rpm", to_rpm(tick.position.commanded));
  add("speed_rpm", tick.speed_rpm());
  add("speed_age_s", to_seconds(seen.motor_age));
  add("thrust_n", tick.thrust_n());
  add("thrust_age_s", to_seconds(seen.load_cell_age));
  add("torque_nm", seen.torque_nm, seen.load_cell_is_fresh());
  add("module_v", seen.judged[Watched::supply_voltage_low]);
  add("module_a", seen.judged[Watched::supply_current]);
  add("supply_v", seen.supply.voltage_v, has_supply);
  add("supply_a", seen.supply.current_a, has_supply);
  add("coil_degc", seen.judged[Watched::coil_temperature]);
  add("derate", seen.derate, seen.motor_is_fresh());
  to["fault_bits"] = seen.motor_is_fresh() ? seen.fault_bits : 0;
  KPHI_JSON_MEMBERS(to, seen.account, received, lost_network, lost_host);
}

ordered_json bars_of(const std::vector<GuardLimit>& limits) {
  ordered_json bars = limits;
  for (std::size_t i = 0; i < limits.size(); ++i)
    bars[i].update({{"name", row_of(limits[i].watched).label}, {"limit", rounded(limits[i].value)}});
  return bars;
}

}  // namespace

std::string hello_message(const Subject& subject) {
  ordered_json hello{{"type", "hello"}, {"format", "kphi-live/2"}, {"limits", bars_of(subject.limits)}};
  KPHI_JSON_MEMBERS(hello, subject, replay, by_hand, weighs, simulated, name, propeller, speed_max_rpm);
  return text_of(hello);
}

Message limits_message(const std::vector<GuardLimit>& limits) {
  return {Message::Kind::limits, text_of({{"type", "limits"}, {"limits", bars_of(limits)}})};
}

std::string tick_message(const Tick& tick, double silent_s, std::uint64_t dropped) {
  const Position& at = tick.position;
  ordered_json message{{"type", "tick"},
                       {"time_s", tick.time_s},
                       {"progress", rounded(at.done)},
                       {"remaining_s", rounded(at.remaining_s)},
                       {"propeller", at.propeller.data()},
                       {"phase", at.step < 0 ? at.phase : std::string_view()}};
  KPHI_JSON_MEMBERS(message, at, step, steps, occlusion_deg, repetition, repetitions, run, runs);
  message["samples"] = at.samples_before + tick.seen.account.received;
  add_readings(message, tick);
  for (const double rms : tick.seen.vibration.rms) message["vibration"].push_back(rounded(rms, 4));
  message["blade_pass_hz"] = rounded(tick.seen.vibration.blade_pass_hz, 6);
  message["blade_pass_n"] = rounded(tick.seen.vibration.blade_pass_n, 4);
  for (const GuardedQuantity& row : kQuantities)
    message["watched"][row.key] = rounded(tick.seen.judged[row.watched], 4);
  message["silent_s"] = rounded(silent_s);
  message["dropped"] = dropped;
  return text_of(message);
}

Message step_message(const Position& at, const StepFigures& seen) {
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

Message reached_message(const std::string& text) {
  return {Message::Kind::other, text_of({{"type", "reached"}, {"text", text}})};
}

Message ask_message(const StandQuestion& question) {
  ordered_json message{{"type", "ask"}};
  KPHI_JSON_MEMBERS(message, question, text, occlusion_deg, repetition, run, has_power, drawing);
  return {Message::Kind::other, text_of(message)};
}

Message stop_message(double time_s) { return {Message::Kind::other, text_of({{"type", "stop"}, {"time_s", time_s}})}; }

Message end_message(double time_s, bool well, bool at_rest, const std::string& text) {
  return {Message::Kind::other,
          text_of({{"type", "end"}, {"time_s", time_s}, {"well", well}, {"at_rest", at_rest}, {"text", text}})};
}

std::string plot_message(const Tick& tick, const std::vector<GuardLimit>& limits) {
  ordered_json message{{"timestamp", tick.timestamp_s}, {"time_s", tick.time_s}};
  KPHI_JSON_MEMBERS(message, tick.position, occlusion_deg, repetition, step);
  add_readings(message, tick);
  for (const GuardLimit& limit : limits)
    message["limit_share"][row_of(limit.watched).key] = rounded(share_of(limit, tick.seen.judged[limit.watched]), 4);
  const auto drop_unknown = [](ordered_json& object) {
    for (auto item = object.begin(); item != object.end();) {
      const bool unknown = item->is_number_float() && !std::isfinite(item->get<double>());
      item = unknown ? object.erase(item) : std::next(item);
    }
  };
  drop_unknown(message);
  if (message.contains("limit_share")) drop_unknown(message["limit_share"]);
  return text_of(message);
}

}  // namespace kphi::daq::live
