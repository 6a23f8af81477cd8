#include "drivers/sim/iq/faults.hpp"

#include <fmt/format.h>

#include <cctype>
#include <cmath>

namespace kphi::sim {
namespace {

constexpr Duration kOvertaken = std::chrono::milliseconds(10);

using Parameter = FaultParameter<MotorFault>;

void as_value(MotorFault& fault, const Parameter&, const std::string& text) {
  if (text == "nan" || text == ".nan") {
    fault.value = std::numeric_limits<double>::quiet_NaN();
  } else if (text == "inf" || text == "-inf") {
    fault.value = std::copysign(std::numeric_limits<double>::infinity(), text == "inf" ? 1.0 : -1.0);
  } else if (text == "denormal") {
    fault.value = std::numeric_limits<float>::denorm_min();
  } else {
    fault.value = fault_number("value", text);
  }
}

void as_bytes(MotorFault& fault, const Parameter&, const std::string& text) {
  std::string digits;
  for (const char c : text) {
    if (c == ' ') continue;
    if (std::isxdigit(static_cast<unsigned char>(c)) == 0)
      throw FaultEntryError("bytes", fmt::format("\"{}\" is not bytes like 55 3B", text));
    digits += c;
  }
  if (digits.empty() || digits.size() % 2 != 0 || digits.size() > 256)
    throw FaultEntryError("bytes", "give 1 to 128 bytes of two hexadecimal digits each");
  for (std::size_t i = 0; i < digits.size(); i += 2)
    fault.bytes.push_back(static_cast<std::uint8_t>(std::stoi(digits.substr(i, 2), nullptr, 16)));
}

using F = MotorFault;
constexpr Parameter kAnyDelay = required<&F::delay>("delay_s");
constexpr Parameter kVolts = required<&F::volts>("volts", 0, 100);

/// A fault of replies may be of one entry's, or of some of them.
std::vector<Parameter> of_replies(std::vector<Parameter> parameters = {}) {
  parameters.insert(parameters.end(), {key<&F::p>("p"), key<&F::type>("type", 0, 255), key<&F::sub>("sub", 0, 255)});
  return parameters;
}

MotorFault with(Duration delay, std::uint64_t size) {
  MotorFault fault;
  fault.delay = delay;
  fault.size = size;
  return fault;
}

}  // namespace

const FaultTable<MotorFault>& motor_faults() {
  using K = MotorFaultKind;
  using E = FaultExtent;
  static const FaultTable<MotorFault> all(
      "the motor",
      {
          {K::flip, "motor_flip", E::window_or_count, of_replies({key<&F::bits>("bits", 1, 64)})},
          {K::bad_crc, "motor_bad_crc", E::window_or_count, of_replies()},
          {K::drop, "motor_drop", E::window_or_count, of_replies()},
          {K::duplicate, "motor_duplicate", E::window_or_count, of_replies()},
          {K::reorder, "motor_reorder", E::window_or_count, of_replies({key<&F::delay>("delay_s")}),
           with(kOvertaken, 0)},
          {K::truncate, "motor_truncate", E::window_or_count, of_replies({required<&F::size>("size", 0, 22)})},
          {K::garbage, "motor_garbage", E::window_or_count,
           of_replies({{"bytes", as_bytes}, key<&F::size>("size", 1, 200)}), with(Duration{0}, 8)},
          {K::merge, "motor_merge", E::window_or_count, of_replies({kAnyDelay})},
          {K::split, "motor_split", E::window_or_count, of_replies({kAnyDelay})},
          {K::stall, "motor_stall", E::window_or_count, of_replies({required<&F::size>("size", 1, 22), kAnyDelay})},
          {K::delay, "motor_delay", E::window_or_count, of_replies({kAnyDelay, key<&F::jitter>("jitter_s")})},
          {K::value, "motor_value", E::window_or_count, of_replies({{"value", as_value, 0, 0, true}})},
          {K::wrong_length, "motor_wrong_length", E::window_or_count, of_replies({required<&F::size>("size", 0, 16)})},
          {K::wrong_id, "motor_wrong_id", E::window_or_count, of_replies({required<&F::id>("id", 0, 63)})},
          {K::stuck, "motor_stuck", E::window_or_count, of_replies()},
          {K::mute, "motor_mute", E::window, {}},
          {K::deaf, "motor_deaf", E::window, {}},
          {K::command_flip, "motor_command_flip", E::window_or_count, {key<&F::p>("p")}},
          {K::unplug, "motor_unplug", E::window, {key<&F::other>("other", 0, 1)}},
          {K::brown_out, "motor_brown_out", E::instant, {key<&F::down>("down_s")}},
          {K::ignore_sets, "motor_ignore_sets", E::window, {}},
          {K::baud, "motor_baud", E::instant, {key<&F::baud>("baud", 300, 2e6)}},
          {K::redline, "motor_redline", E::window, {required<&F::speed>("speed_rad_s", 1, 4200)}},
          {K::hot,
           "motor_hot",
           E::window,
           {key<&F::coil>("coil_celsius", -300, 300), key<&F::controller>("controller_celsius", -300, 300)}},
          {K::over_voltage, "motor_over_voltage", E::window, {kVolts}},
          {K::sag, "motor_sag", E::window, {kVolts}},
          {K::locked, "motor_locked", E::window, {}},
      });
  return all;
}

}  // namespace kphi::sim
