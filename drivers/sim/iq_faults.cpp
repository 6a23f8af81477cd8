#include "drivers/sim/iq_faults.hpp"

#include <fmt/format.h>

#include <cctype>
#include <cmath>

#include "drivers/sim/fault_table.hpp"

namespace kphi::sim {
namespace {

constexpr double kHour = 3600;
constexpr Duration kOvertaken = std::chrono::milliseconds(10);
constexpr std::string_view kPrefix = "motor_";

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
      throw FaultEntryError("bytes", fmt::format("'{}' is no row of bytes like 55 3B", text));
    digits += c;
  }
  if (digits.empty() || digits.size() % 2 != 0 || digits.size() > 256)
    throw FaultEntryError("bytes", "1 to 128 bytes of two digits each are a row of bytes");
  for (std::size_t i = 0; i < digits.size(); i += 2)
    fault.bytes.push_back(static_cast<std::uint8_t>(std::stoi(digits.substr(i, 2), nullptr, 16)));
}

using F = MotorFault;
constexpr Parameter kP{"p", Parameter::into<&F::p>, 0, 1};
constexpr Parameter kType{"type", Parameter::into<&F::type>, 0, 255, true};
constexpr Parameter kSub{"sub", Parameter::into<&F::sub>, 0, 255, true};
constexpr Parameter kDelay{"delay_s", Parameter::into<&F::delay>, 0, kHour};
constexpr Parameter kAnyDelay{"delay_s", Parameter::into<&F::delay>, 0, kHour, false, true};
constexpr Parameter kShort{"size", Parameter::into<&F::size>, 0, 22, true, true};
constexpr Parameter kVolts{"volts", Parameter::into<&F::volts>, 0, 100, false, true};

/// A fault of replies may be of one entry's, or of some of them.
std::vector<Parameter> of_replies(std::vector<Parameter> parameters = {}) {
  parameters.insert(parameters.end(), {kP, kType, kSub});
  return parameters;
}

MotorFault with(Duration delay, std::uint64_t size) {
  MotorFault fault;
  fault.delay = delay;
  fault.size = size;
  return fault;
}

const FaultTable<MotorFault>& table() {
  using K = MotorFaultKind;
  using E = FaultExtent;
  static const FaultTable<MotorFault> all(
      "the motor",
      {
          {K::flip, "motor_flip", E::window_or_count, of_replies({{"bits", Parameter::into<&F::bits>, 1, 64, true}})},
          {K::bad_crc, "motor_bad_crc", E::window_or_count, of_replies()},
          {K::drop, "motor_drop", E::window_or_count, of_replies()},
          {K::duplicate, "motor_duplicate", E::window_or_count, of_replies()},
          {K::reorder, "motor_reorder", E::window_or_count, of_replies({kDelay}), with(kOvertaken, 0)},
          {K::truncate, "motor_truncate", E::window_or_count, of_replies({kShort})},
          {K::garbage, "motor_garbage", E::window_or_count,
           of_replies({{"bytes", as_bytes}, {"size", Parameter::into<&F::size>, 1, 200, true}}), with(Duration{0}, 8)},
          {K::merge, "motor_merge", E::window_or_count, of_replies({kAnyDelay})},
          {K::split, "motor_split", E::window_or_count, of_replies({kAnyDelay})},
          {K::stall, "motor_stall", E::window_or_count,
           of_replies({{"size", Parameter::into<&F::size>, 1, 22, true, true}, kAnyDelay})},
          {K::delay, "motor_delay", E::window_or_count,
           of_replies({kAnyDelay, {"jitter_s", Parameter::into<&F::jitter>, 0, kHour}})},
          {K::value, "motor_value", E::window_or_count, of_replies({{"value", as_value, 0, 0, false, true}})},
          {K::wrong_length, "motor_wrong_length", E::window_or_count,
           of_replies({{"size", Parameter::into<&F::size>, 0, 16, true, true}})},
          {K::wrong_id, "motor_wrong_id", E::window_or_count,
           of_replies({{"id", Parameter::into<&F::id>, 0, 63, true, true}})},
          {K::stuck, "motor_stuck", E::window_or_count, of_replies()},
          {K::mute, "motor_mute", E::window, {}},
          {K::deaf, "motor_deaf", E::window, {}},
          {K::command_flip, "motor_command_flip", E::window_or_count, {kP}},
          {K::unplug, "motor_unplug", E::window, {{"other", Parameter::into<&F::other>, 0, 1, true}}},
          {K::brown_out, "motor_brown_out", E::instant, {{"down_s", Parameter::into<&F::down>, 0, kHour}}},
          {K::ignore_sets, "motor_ignore_sets", E::window, {}},
          {K::baud, "motor_baud", E::instant, {{"baud", Parameter::into<&F::baud>, 300, 2e6, true}}},
          {K::redline, "motor_redline", E::window, {{"speed_rad_s", Parameter::into<&F::speed>, 1, 4200, false, true}}},
          {K::hot,
           "motor_hot",
           E::window,
           {{"coil_celsius", Parameter::into<&F::coil>, -300, 300},
            {"controller_celsius", Parameter::into<&F::controller>, -300, 300}}},
          {K::over_voltage, "motor_over_voltage", E::window, {kVolts}},
          {K::sag, "motor_sag", E::window, {kVolts}},
          {K::locked, "motor_locked", E::window, {}},
      });
  return all;
}

}  // namespace

std::string_view name_of(MotorFaultKind kind) noexcept { return table().name_of(kind); }

bool is_motor_fault(const FaultEntry& entry) noexcept {
  const auto kind = entry.find("kind");
  return kind != entry.end() && kind->second.rfind(kPrefix, 0) == 0;
}

MotorFault motor_fault_of(const FaultEntry& entry) { return table().read(entry); }

}  // namespace kphi::sim
