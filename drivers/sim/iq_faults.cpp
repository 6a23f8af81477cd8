#include "drivers/sim/iq_faults.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace kphi::sim {
namespace {

constexpr double kHour = 3600, kMany = 1e9;
constexpr Duration kOvertaken = std::chrono::milliseconds(10);
constexpr std::string_view kPrefix = "motor_";

/// A key of a kind: how its text becomes a member.
struct Parameter {
  std::string_view name;
  void (*set)(MotorFault& fault, const Parameter& parameter, const std::string& text);
  double low = 0, high = 0;
  bool required = false;
  bool whole = false;

  [[nodiscard]] double within(const std::string& text) const { return fault_number(name, text, {low, high, whole}); }
};

template <auto Member>
void as_number(MotorFault& fault, const Parameter& parameter, const std::string& text) {
  using T = std::remove_reference_t<decltype(fault.*Member)>;
  const double value = parameter.within(text);
  if constexpr (std::is_same_v<T, Duration>) {
    fault.*Member = from_seconds(value);
  } else {
    fault.*Member = static_cast<T>(value);
  }
}

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
constexpr Parameter kP{"p", as_number<&F::p>, 0, 1};
constexpr Parameter kType{"type", as_number<&F::type>, 0, 255, false, true};
constexpr Parameter kSub{"sub", as_number<&F::sub>, 0, 255, false, true};
constexpr Parameter kDelay{"delay_s", as_number<&F::delay>, 0, kHour};
constexpr Parameter kAnyDelay{"delay_s", as_number<&F::delay>, 0, kHour, true};

/// How long a fault of this kind goes on, and whether it may be of one entry only.
enum class Extent : std::uint8_t { instant, window, replies, bytes };

struct Kind {
  MotorFaultKind kind;
  std::string_view name;
  Extent extent;
  std::vector<Parameter> parameters;
};

const std::vector<Kind>& kinds() {
  using K = MotorFaultKind;
  using E = Extent;
  static const std::vector<Kind> table{
      {K::flip, "motor_flip", E::replies, {{"bits", as_number<&F::bits>, 1, 64, false, true}}},
      {K::bad_crc, "motor_bad_crc", E::replies, {}},
      {K::drop, "motor_drop", E::replies, {}},
      {K::duplicate, "motor_duplicate", E::replies, {}},
      {K::reorder, "motor_reorder", E::replies, {kDelay}},
      {K::truncate, "motor_truncate", E::replies, {{"size", as_number<&F::size>, 0, 22, true, true}}},
      {K::garbage,
       "motor_garbage",
       E::replies,
       {{"bytes", as_bytes}, {"size", as_number<&F::size>, 1, 200, false, true}}},
      {K::merge, "motor_merge", E::replies, {kAnyDelay}},
      {K::split, "motor_split", E::replies, {kAnyDelay}},
      {K::stall, "motor_stall", E::replies, {{"size", as_number<&F::size>, 1, 22, true, true}, kAnyDelay}},
      {K::delay, "motor_delay", E::replies, {kAnyDelay, {"jitter_s", as_number<&F::jitter>, 0, kHour}}},
      {K::value, "motor_value", E::replies, {{"value", as_value, 0, 0, true}}},
      {K::wrong_length, "motor_wrong_length", E::replies, {{"size", as_number<&F::size>, 0, 16, true, true}}},
      {K::wrong_id, "motor_wrong_id", E::replies, {{"id", as_number<&F::id>, 0, 63, true, true}}},
      {K::stuck, "motor_stuck", E::replies, {}},
      {K::mute, "motor_mute", E::window, {}},
      {K::deaf, "motor_deaf", E::window, {}},
      {K::command_flip, "motor_command_flip", E::bytes, {kP}},
      {K::unplug, "motor_unplug", E::window, {{"other", as_number<&F::other>, 0, 1, false, true}}},
      {K::brown_out, "motor_brown_out", E::instant, {{"down_s", as_number<&F::down>, 0, kHour}}},
      {K::ignore_sets, "motor_ignore_sets", E::window, {}},
      {K::baud, "motor_baud", E::instant, {{"baud", as_number<&F::baud>, 300, 2e6, false, true}}},
      {K::redline, "motor_redline", E::window, {{"speed_rad_s", as_number<&F::speed>, 1, 4200, true}}},
      {K::hot,
       "motor_hot",
       E::window,
       {{"coil_celsius", as_number<&F::coil>, -300, 300},
        {"controller_celsius", as_number<&F::controller>, -300, 300}}},
      {K::over_voltage, "motor_over_voltage", E::window, {{"volts", as_number<&F::volts>, 0, 100, true}}},
      {K::sag, "motor_sag", E::window, {{"volts", as_number<&F::volts>, 0, 100, true}}},
      {K::locked, "motor_locked", E::window, {}},
  };
  return table;
}

const Kind& kind_named(const std::string& name) {
  std::string known;
  for (const Kind& kind : kinds()) {
    if (kind.name == name) return kind;
    known += fmt::format("{}{}", known.empty() ? "" : ", ", kind.name);
  }
  throw FaultEntryError("kind", fmt::format("no fault is called '{}'; there are {}", name, known));
}

std::vector<Parameter> parameters_of(const Kind& kind) {
  std::vector<Parameter> all = kind.parameters;
  all.push_back({"at_s", as_number<&F::at>, 0, 1e6, true});
  if (kind.extent != Extent::instant)
    all.push_back({"for_s", as_number<&F::lasts>, 1e-6, 1e6, kind.extent == Extent::window});
  if (kind.extent == Extent::replies || kind.extent == Extent::bytes)
    all.push_back({"count", as_number<&F::count>, 1, kMany, false, true});
  if (kind.extent == Extent::replies) all.insert(all.end(), {kP, kType, kSub});
  return all;
}

}  // namespace

std::string_view name_of(MotorFaultKind kind) noexcept {
  const auto& table = kinds();
  const auto found = std::find_if(table.begin(), table.end(), [&](const Kind& k) { return k.kind == kind; });
  return found == table.end() ? "?" : found->name;
}

bool is_motor_fault(const FaultEntry& entry) noexcept {
  const auto kind = entry.find("kind");
  return kind != entry.end() && kind->second.rfind(kPrefix, 0) == 0;
}

MotorFault motor_fault_of(const FaultEntry& entry) {
  const Kind& kind = kind_named(kind_of(entry));
  const auto parameters = parameters_of(kind);
  for (const auto& [key, value] : entry) {
    const bool known = key == "kind" || std::any_of(parameters.begin(), parameters.end(),
                                                    [&name = key](const Parameter& p) { return p.name == name; });
    if (!known) throw FaultEntryError(key, fmt::format("{} has no '{}'", kind.name, key));
  }
  const bool endless = !entry.contains("for_s") && !entry.contains("count");
  if (endless && (kind.extent == Extent::replies || kind.extent == Extent::bytes))
    throw FaultEntryError("", fmt::format("{} needs for_s or count", kind.name));
  MotorFault fault;
  fault.kind = kind.kind;
  if (fault.kind == MotorFaultKind::reorder) fault.delay = kOvertaken;
  if (fault.kind == MotorFaultKind::garbage) fault.size = 8;
  for (const Parameter& parameter : parameters) {
    const auto found = entry.find(std::string(parameter.name));
    if (found != entry.end()) {
      parameter.set(fault, parameter, found->second);
    } else if (parameter.required) {
      throw FaultEntryError("", fmt::format("{} needs {}", kind.name, parameter.name));
    }
  }
  return fault;
}

}  // namespace kphi::sim
