#include "drivers/sim/supply_faults.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

namespace kphi::sim {
namespace {

constexpr double kLatest = 1e6, kHour = 3600;

struct Parameter {
  std::string_view name;
  void (*set)(SupplyFault& fault, double value);
  double low, high;
  bool whole = false, required = false;
};

template <auto Member>
void as_number(SupplyFault& fault, double value) {
  using T = std::remove_reference_t<decltype(fault.*Member)>;
  if constexpr (std::is_same_v<T, Duration>) {
    fault.*Member = from_seconds(value);
  } else {
    fault.*Member = static_cast<T>(value);
  }
}

using F = SupplyFault;
constexpr Parameter kP{"p", as_number<&F::p>, 0, 1};
constexpr Parameter kSize{"size", as_number<&F::size>, 0, 260, true};
constexpr Parameter kDelay{"delay_s", as_number<&F::delay>, 0, kHour, false, true};
constexpr Parameter kGap{"gap_s", as_number<&F::delay>, 0, 10, false, true};
constexpr Parameter kSlave{"slave", as_number<&F::slave>, 0, 255, true};
constexpr Parameter kException{"code", as_number<&F::code>, 1, 11, true};
constexpr Parameter kTrip{"code", as_number<&F::code>, 1, 5, true, true};
constexpr Parameter kRegister{"register", as_number<&F::address>, 0, 65535, true, true};
constexpr Parameter kValue{"value", as_number<&F::value>, 0, 65535, true, true};

/// How long a fault of this kind goes on.
enum class Extent : std::uint8_t { instant, window, window_or_count };

struct Kind {
  SupplyFaultKind kind;
  std::string_view name;
  Extent extent;
  std::vector<Parameter> parameters;
};

const std::vector<Kind>& kinds() {
  using K = SupplyFaultKind;
  using E = Extent;
  static const std::vector<Kind> table{
      {K::bad_crc, "bad_crc", E::window_or_count, {kP}},
      {K::no_reply, "no_reply", E::window_or_count, {kP}},
      {K::deaf, "deaf", E::window_or_count, {kP}},
      {K::truncated, "truncated", E::window_or_count, {kP, kSize}},
      {K::dribble, "dribble", E::window_or_count, {kP, kGap}},
      {K::garbage, "garbage", E::window_or_count, {kP, kSize}},
      {K::wrong_slave, "wrong_slave", E::window_or_count, {kP, kSlave}},
      {K::wrong_transaction, "wrong_transaction", E::window_or_count, {kP}},
      {K::echo, "echo", E::window_or_count, {kP}},
      {K::late, "late", E::window_or_count, {kP, kDelay}},
      {K::exception, "exception", E::window_or_count, {kP, kException}},
      {K::ignored_writes, "ignored_writes", E::window_or_count, {kP}},
      {K::reads_as, "reads_as", E::window, {kRegister, kValue}},
      {K::closed, "closed", E::window, {}},
      {K::trip, "trip", E::instant, {kTrip}},
      {K::panel, "panel", E::instant, {kRegister, kValue}},
  };
  return table;
}

const Kind& kind_named(const std::string& name) {
  std::string known;
  for (const Kind& kind : kinds()) {
    if (kind.name == name) return kind;
    known += fmt::format("{}{}", known.empty() ? "" : ", ", kind.name);
  }
  throw FaultEntryError("kind", fmt::format("no fault of the supply is called '{}'; there are {}", name, known));
}

std::vector<Parameter> parameters_of(const Kind& kind) {
  std::vector<Parameter> all = kind.parameters;
  all.push_back({"at_s", as_number<&F::at>, 0, kLatest, false, true});
  if (kind.extent != Extent::instant) all.push_back({"for_s", as_number<&F::lasts>, 1e-6, kLatest});
  if (kind.extent == Extent::window_or_count) all.push_back({"count", as_number<&F::count>, 1, 1e9, true});
  return all;
}

double number_within(const Parameter& parameter, const std::string& text) {
  const std::string key(parameter.name);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) {
    throw FaultEntryError(key, fmt::format("'{}' is no number", text));
  }
  if (!(value >= parameter.low && value <= parameter.high)) {
    throw FaultEntryError(key, fmt::format("{} is outside {} to {}", value, parameter.low, parameter.high));
  }
  if (parameter.whole && value != std::floor(value)) throw FaultEntryError(key, fmt::format("{} is not whole", value));
  return value;
}

void check_extent(const Kind& kind, const FaultEntry& entry) {
  const bool has_end = entry.contains("for_s");
  if (kind.extent == Extent::window && !has_end) throw FaultEntryError("", fmt::format("{} needs for_s", kind.name));
  if (kind.extent == Extent::window_or_count && !has_end && !entry.contains("count")) {
    throw FaultEntryError("", fmt::format("{} needs for_s or count", kind.name));
  }
}

}  // namespace

std::string_view name_of(SupplyFaultKind kind) noexcept {
  for (const Kind& known : kinds()) {
    if (known.kind == kind) return known.name;
  }
  return "?";
}

SupplyFault supply_fault_of(const FaultEntry& entry) {
  const auto named = entry.find("kind");
  if (named == entry.end()) throw FaultEntryError("", "the kind is missing");
  const Kind& kind = kind_named(named->second);
  const auto parameters = parameters_of(kind);
  for (const auto& [key, value] : entry) {
    const bool known = key == "kind" || std::any_of(parameters.begin(), parameters.end(),
                                                    [&name = key](const Parameter& p) { return p.name == name; });
    if (!known) throw FaultEntryError(key, fmt::format("{} has no '{}'", kind.name, key));
  }
  check_extent(kind, entry);
  SupplyFault fault;
  fault.kind = kind.kind;
  for (const Parameter& parameter : parameters) {
    const auto given = entry.find(std::string(parameter.name));
    if (given != entry.end()) {
      parameter.set(fault, number_within(parameter, given->second));
    } else if (parameter.required) {
      throw FaultEntryError("", fmt::format("{} needs {}", kind.name, parameter.name));
    }
  }
  return fault;
}

}  // namespace kphi::sim
