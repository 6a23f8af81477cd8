// How a device's faults are written in a script, as a table: which kinds there are, which keys each has and within
// which limits, and how long it goes on. A device brings its own Kind, its own Fault and its rows.
#pragma once

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "drivers/clock.hpp"
#include "drivers/sim/faults.hpp"

namespace kphi::sim {

/// How long a fault of a kind goes on: no time at all; a window (for_s); a window or so many times (count).
enum class FaultExtent : std::uint8_t { instant, window, window_or_count };

template <class Fault>
struct FaultParameter {
  std::string_view name;
  void (*set)(Fault& fault, double value);
  double low, high;
  bool whole = false, required = false;

  /// For a member that is a number or a Duration (then the script's value is in seconds).
  template <auto Member>
  static void into(Fault& fault, double value) {
    using T = std::remove_reference_t<decltype(fault.*Member)>;
    if constexpr (std::is_same_v<T, Duration>) {
      fault.*Member = from_seconds(value);
    } else {
      fault.*Member = static_cast<T>(value);
    }
  }
};

/// `Fault` has kind, at, lasts and count, as those of faults.hpp.
template <class Fault>
class FaultTable {
 public:
  using Kind = decltype(Fault::kind);
  using Parameter = FaultParameter<Fault>;
  struct Row {
    Kind kind;
    std::string_view name;
    FaultExtent extent;
    std::vector<Parameter> parameters;
  };

  FaultTable(std::string device, std::vector<Row> rows) : device_(std::move(device)), rows_(std::move(rows)) {}

  [[nodiscard]] std::string_view name_of(Kind kind) const noexcept {
    for (const Row& row : rows_)
      if (row.kind == kind) return row.name;
    return "?";
  }

  /// Strict: unknown kinds and keys, values out of range and missing keys throw FaultEntryError.
  [[nodiscard]] Fault read(const FaultEntry& entry) const {
    const Row& row = row_of(entry);
    const std::vector<Parameter> parameters = parameters_of(row);
    refuse_unknown_keys(row, parameters, entry);
    const bool ends = entry.contains("for_s"), counts = entry.contains("count");
    if (row.extent == FaultExtent::window && !ends) refuse("", fmt::format("{} needs for_s", row.name));
    if (row.extent == FaultExtent::window_or_count && !ends && !counts)
      refuse("", fmt::format("{} needs for_s or count", row.name));
    Fault fault;
    fault.kind = row.kind;
    for (const Parameter& parameter : parameters) {
      const auto found = entry.find(std::string(parameter.name));
      if (found != entry.end()) {
        parameter.set(fault, within(parameter, found->second));
      } else if (parameter.required) {
        refuse("", fmt::format("{} needs {}", row.name, parameter.name));
      }
    }
    return fault;
  }

 private:
  static constexpr double kLatest = 1e6;  // s

  [[noreturn]] static void refuse(std::string_view key, const std::string& what) {
    throw FaultEntryError(std::string(key), what);
  }

  const Row& row_of(const FaultEntry& entry) const {
    const auto named = entry.find("kind");
    if (named == entry.end()) refuse("", "the kind is missing");
    std::string known;
    for (const Row& row : rows_) {
      if (row.name == named->second) return row;
      known += fmt::format("{}{}", known.empty() ? "" : ", ", row.name);
    }
    refuse("kind", fmt::format("no fault of {} is called '{}'; there are {}", device_, named->second, known));
  }

  static std::vector<Parameter> parameters_of(const Row& row) {
    std::vector<Parameter> all = row.parameters;
    all.push_back({"at_s", Parameter::template into<&Fault::at>, 0, kLatest, false, true});
    if (row.extent != FaultExtent::instant)
      all.push_back({"for_s", Parameter::template into<&Fault::lasts>, 1e-6, kLatest});
    if (row.extent == FaultExtent::window_or_count)
      all.push_back({"count", Parameter::template into<&Fault::count>, 1, 1e9, true});
    return all;
  }

  static void refuse_unknown_keys(const Row& row, const std::vector<Parameter>& known, const FaultEntry& entry) {
    for (const auto& [key, unused] : entry) {
      bool found = key == "kind";
      for (const Parameter& parameter : known) found = found || parameter.name == key;
      if (!found) refuse(key, fmt::format("{} has no '{}'", row.name, key));
    }
  }

  static double within(const Parameter& parameter, const std::string& text) {
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc{} || end != text.data() + text.size())
      refuse(parameter.name, fmt::format("'{}' is no number", text));
    if (!(value >= parameter.low && value <= parameter.high))
      refuse(parameter.name, fmt::format("{} is outside {} to {}", value, parameter.low, parameter.high));
    if (parameter.whole && value != std::floor(value)) refuse(parameter.name, fmt::format("{} is not whole", value));
    return value;
  }

  std::string device_;
  std::vector<Row> rows_;
};

}  // namespace kphi::sim
