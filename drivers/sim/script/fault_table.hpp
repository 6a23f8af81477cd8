// How the faults of one device are written in a script, as a table: its kinds, the keys of each with their limits, and
// how long each lasts. A device brings its own kinds, its own fault and its rows.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <map>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "base/clock.hpp"

namespace kphi::sim {

/// One entry of a script: names and values as text.
using FaultEntry = std::map<std::string, std::string>;

/// What is wrong in an entry, and at which of its keys; an empty key: the whole entry.
class FaultEntryError : public std::runtime_error {
 public:
  FaultEntryError(std::string at_key, const std::string& what) : std::runtime_error(what), key(std::move(at_key)) {}
  const std::string key;
};

/// Closed.
struct FaultRange {
  double low = -std::numeric_limits<double>::max(), high = std::numeric_limits<double>::max();
  bool whole = false;
};

/// Finite; "true" and "false" are 1 and 0, "0x1F" is 31. Throws FaultEntryError, also outside `range`.
[[nodiscard]] double fault_number(std::string_view key, const std::string& text, const FaultRange& range = {});

/// When a fault acts, bench time, and how often.
template <class KindOfDevice>
struct ScriptedFault {
  KindOfDevice kind{};
  Instant at{0};
  Duration lasts{0};        ///< 0: no end in time
  std::uint64_t count = 0;  ///< of datagrams, requests, replies or bytes that it concerns; 0: no limit

  [[nodiscard]] Instant end() const noexcept { return lasts > Duration{0} ? at + lasts : kNever; }
  /// `used`: how many it has concerned so far.
  [[nodiscard]] bool active(Instant now, std::uint64_t used = 0) const noexcept {
    return now >= at && now < end() && (count == 0 || used < count);
  }
};

/// What a script made happen, when.
struct FaultEvent {
  Instant at{0};
  std::string what;
};

/// How long a fault of a kind lasts: a moment; a window (for_s); a window or a number of times (count); a window or for
/// ever.
enum class FaultExtent : std::uint8_t { instant, window, window_or_count, window_or_forever };

/// A key of a kind: how its text becomes a member.
template <class Fault>
struct FaultParameter {
  std::string_view name;
  /// Throws FaultEntryError for an invalid text.
  void (*set)(Fault& fault, const FaultParameter& parameter, const std::string& text);
  double low = 0, high = 0;
  bool required = false;
  const char* usual = nullptr;  ///< when an entry does not say; nullptr: as the member is

  /// A member that is a number (an integer takes whole numbers only) or a Duration (the script has seconds).
  template <auto Member>
  static void into(Fault& fault, const FaultParameter& parameter, const std::string& text) {
    using T = std::remove_reference_t<decltype(fault.*Member)>;
    const double value = fault_number(parameter.name, text, {parameter.low, parameter.high, std::is_integral_v<T>});
    if constexpr (std::is_same_v<T, Duration>) {
      fault.*Member = from_seconds(value);
    } else {
      fault.*Member = static_cast<T>(value);
    }
  }
};

template <auto Member>
struct FaultMember;
template <class F, class T, T F::*Member>
struct FaultMember<Member> {
  using Fault = F;
  static constexpr double kUsualMax = std::is_same_v<T, Duration> ? 3600 : 1;  ///< an hour, a certainty
};

/// An optional key for a member, see FaultParameter::into.
template <auto Member>
[[nodiscard]] constexpr auto key(std::string_view name, double low = 0, double high = FaultMember<Member>::kUsualMax,
                                 const char* usual = nullptr) {
  using Parameter = FaultParameter<typename FaultMember<Member>::Fault>;
  return Parameter{name, Parameter::template into<Member>, low, high, false, usual};
}
/// The same for a key that an entry must have.
template <auto Member>
[[nodiscard]] constexpr auto required(std::string_view name, double low = 0,
                                      double high = FaultMember<Member>::kUsualMax) {
  auto parameter = key<Member>(name, low, high);
  parameter.required = true;
  return parameter;
}

/// `Fault` has kind, at, lasts and count, as ScriptedFault.
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

  [[nodiscard]] const std::vector<Row>& rows() const noexcept { return rows_; }

  [[nodiscard]] std::string_view name_of(Kind kind) const noexcept {
    for (const Row& row : rows_)
      if (row.kind == kind) return row.name;
    return "?";
  }

  /// Strict: unknown kinds and keys, values out of range and missing keys throw FaultEntryError.
  [[nodiscard]] Fault read(const FaultEntry& entry) const {
    const Row& row = row_of(entry);
    const std::vector<Parameter> parameters = parameters_of(row);
    for (const auto& [key, unused] : entry) {
      const bool known = std::any_of(parameters.begin(), parameters.end(),
                                     [&name = key](const Parameter& parameter) { return parameter.name == name; });
      if (!known && key != "kind") refuse(key, fmt::format("{} has no key \"{}\"", row.name, key));
    }
    const bool ends = entry.contains("for_s"), counts = entry.contains("count");
    if (row.extent == FaultExtent::window && !ends) refuse("", fmt::format("{} needs for_s", row.name));
    if (row.extent == FaultExtent::window_or_count && !ends && !counts)
      refuse("", fmt::format("{} needs for_s or count", row.name));
    Fault fault;
    fault.kind = row.kind;
    for (const Parameter& parameter : parameters) {
      const auto found = entry.find(std::string(parameter.name));
      if (found != entry.end()) {
        parameter.set(fault, parameter, found->second);
      } else if (parameter.usual != nullptr) {
        parameter.set(fault, parameter, parameter.usual);
      } else if (parameter.required) {
        refuse("", fmt::format("{} needs {}", row.name, parameter.name));
      }
    }
    return fault;
  }

 private:
  static constexpr double kLatest = 1e6;  // s

  [[noreturn]] static void refuse(const std::string& key, const std::string& what) { throw FaultEntryError(key, what); }

  const Row& row_of(const FaultEntry& entry) const {
    const auto named = entry.find("kind");
    if (named == entry.end()) refuse("", "no kind given");
    std::string known;
    for (const Row& row : rows_) {
      if (row.name == named->second) return row;
      known += fmt::format("{}{}", known.empty() ? "" : ", ", row.name);
    }
    refuse("kind", fmt::format("unknown fault \"{}\" of {}; known: {}", named->second, device_, known));
  }

  static std::vector<Parameter> parameters_of(const Row& row) {
    std::vector<Parameter> all = row.parameters;
    all.push_back({"at_s", Parameter::template into<&Fault::at>, 0, kLatest, true});
    if (row.extent != FaultExtent::instant)
      all.push_back({"for_s", Parameter::template into<&Fault::lasts>, 1e-6, kLatest});
    if (row.extent == FaultExtent::window_or_count)
      all.push_back({"count", Parameter::template into<&Fault::count>, 1, 1e9});
    return all;
  }

  std::string device_;
  std::vector<Row> rows_;
};

}  // namespace kphi::sim
