// How a device's faults are written in a script, as a table: which kinds there are, which keys each has and within
// which limits, and how long it goes on. A device brings its own Kind, its own Fault and its rows.
#pragma once

#include <fmt/format.h>

#include <cstdint>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "drivers/clock.hpp"
#include "drivers/sim/fault_entry.hpp"

namespace kphi::sim {

/// How long a fault of a kind goes on: no time at all; a window (for_s); a window or so many times (count); a window,
/// or from then on.
enum class FaultExtent : std::uint8_t { instant, window, window_or_count, window_or_forever };

/// A key of a kind: how its text becomes a member.
template <class Fault>
struct FaultParameter {
  std::string_view name;
  /// Throws FaultEntryError for a text that will not do.
  void (*set)(Fault& fault, const FaultParameter& parameter, const std::string& text);
  double low = 0, high = 0;
  bool whole = false, required = false;

  /// For a member that is a number or a Duration (then the script's value is in seconds).
  template <auto Member>
  static void into(Fault& fault, const FaultParameter& parameter, const std::string& text) {
    using T = std::remove_reference_t<decltype(fault.*Member)>;
    const double value = fault_number(parameter.name, text, {parameter.low, parameter.high, parameter.whole});
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
    Fault usual{};  ///< where the script is silent
  };

  FaultTable(std::string device, std::vector<Row> rows) : device_(std::move(device)), rows_(std::move(rows)) {}

  [[nodiscard]] std::string_view name_of(Kind kind) const noexcept {
    for (const Row& row : rows_)
      if (row.kind == kind) return row.name;
    return "?";
  }

  [[nodiscard]] std::vector<Kind> kinds() const {
    std::vector<Kind> all;
    for (const Row& row : rows_) all.push_back(row.kind);
    return all;
  }

  /// Strict: unknown kinds and keys, values out of range and missing keys throw FaultEntryError.
  [[nodiscard]] Fault read(const FaultEntry& entry) const {
    const Row& row = row_named(kind_of(entry));
    const std::vector<Parameter> parameters = parameters_of(row);
    refuse_unknown_keys(row, parameters, entry);
    refuse_endlessness(row, entry);
    Fault fault = row.usual;
    fault.kind = row.kind;
    for (const Parameter& parameter : parameters) {
      const auto found = entry.find(std::string(parameter.name));
      if (found != entry.end()) {
        parameter.set(fault, parameter, found->second);
      } else if (parameter.required) {
        refuse("", fmt::format("{} needs {}", row.name, parameter.name));
      }
    }
    return fault;
  }

 private:
  static constexpr double kLatest = 1e6;  // s

  [[noreturn]] static void refuse(const std::string& key, const std::string& what) { throw FaultEntryError(key, what); }

  const Row& row_named(const std::string& name) const {
    std::string known;
    for (const Row& row : rows_) {
      if (row.name == name) return row;
      known += fmt::format("{}{}", known.empty() ? "" : ", ", row.name);
    }
    refuse("kind", fmt::format("no fault of {} is called '{}'; there are {}", device_, name, known));
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

  static void refuse_endlessness(const Row& row, const FaultEntry& entry) {
    const bool ends = entry.contains("for_s"), counts = entry.contains("count");
    if (row.extent == FaultExtent::window && !ends) refuse("", fmt::format("{} needs for_s", row.name));
    if (row.extent == FaultExtent::window_or_count && !ends && !counts)
      refuse("", fmt::format("{} needs for_s or count", row.name));
  }

  std::string device_;
  std::vector<Row> rows_;
};

}  // namespace kphi::sim
