#include "drivers/sim/faults.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>

#include <algorithm>

namespace kphi::sim {
namespace {

struct Parameter {
  std::string_view name;
  void (*set)(Fault& fault, double value);
  double low, high;
  bool whole = false;
  bool required = false;
  /// Of a parameter that is a word: false when it is none of the right form.
  bool (*set_word)(Fault& fault, const std::string& word) = nullptr;
};

constexpr Duration kOvertaken = std::chrono::milliseconds(10);
constexpr Duration kBetweenSegments = std::chrono::milliseconds(2);
constexpr double kHour = 3600;
constexpr double kMany = 4294967295.0;

template <auto Member>
void as_number(Fault& fault, double value) {
  using T = std::remove_reference_t<decltype(fault.*Member)>;
  if constexpr (std::is_same_v<T, Duration>) {
    fault.*Member = from_seconds(value);
  } else {
    fault.*Member = static_cast<T>(value);
  }
}

template <auto Member>
constexpr Parameter probability(std::string_view name, bool required = false) {
  return {name, as_number<Member>, 0, 1, false, required};
}
template <auto Member>
constexpr Parameter seconds(std::string_view name, bool required = false) {
  return {name, as_number<Member>, 0, kHour, false, required};
}
template <auto Member>
constexpr Parameter whole(std::string_view name, double low, double high, bool required = false) {
  return {name, as_number<Member>, low, high, true, required};
}

bool set_tag(Fault& fault, const std::string& word) {
  fault.tag = word;
  return !word.empty() &&
         std::all_of(word.begin(), word.end(), [](char c) { return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9'); });
}
bool set_address(Fault& fault, const std::string& word) {
  fault.address = word;
  in_addr parsed{};
  return ::inet_pton(AF_INET, word.c_str(), &parsed) == 1;
}
constexpr Parameter word(std::string_view name, bool (*set)(Fault&, const std::string&)) {
  return {name, nullptr, 0, 0, false, true, set};
}

constexpr Parameter kP = probability<&Fault::p>("p");
constexpr Parameter kDelay = seconds<&Fault::delay>("delay_s");
constexpr Parameter kAnyDelay = seconds<&Fault::delay>("delay_s", true);

/// How long a fault of this kind goes on.
enum class Extent : std::uint8_t { instant, window, window_or_count, window_or_forever };

struct Kind {
  FaultKind kind;
  std::string_view name;
  Extent extent;
  std::vector<Parameter> parameters;
};

const std::vector<Kind>& kinds() {
  using F = Fault;
  using K = FaultKind;
  using E = Extent;
  static const std::vector<Kind> table{
      {K::loss, "loss", E::window_or_count, {kP, whole<&F::burst>("burst", 1, 1e6)}},
      {K::gilbert,
       "gilbert",
       E::window_or_count,
       {probability<&F::p_good_bad>("p_good_bad", true), probability<&F::p_bad_good>("p_bad_good", true),
        probability<&F::loss>("loss")}},
      {K::duplicate, "duplicate", E::window_or_count, {kP, kDelay}},
      {K::reorder, "reorder", E::window_or_count, {kP, whole<&F::depth>("depth", 1, 1000), kDelay}},
      {K::delay, "delay", E::window_or_count, {kAnyDelay, seconds<&F::jitter>("jitter_s")}},
      {K::jitter,
       "jitter",
       E::window_or_count,
       {seconds<&F::jitter>("mean_s", true), kP, seconds<&F::spike>("spike_s")}},
      {K::hold, "hold", E::window, {}},
      {K::wrong_size,
       "wrong_size",
       E::window_or_count,
       {kP, whole<&F::size>("size", 0, 1476, true), whole<&F::replaces>("replaces", 0, 1)}},
      {K::short_block, "short_block", E::window_or_count, {kP, whole<&F::records>("records", 1, 39)}},
      {K::foreign_source, "foreign_source", E::window_or_count, {kP}},
      {K::lost_start, "lost_start", E::window_or_count, {}},
      {K::doubled_start, "doubled_start", E::window_or_count, {kDelay}},
      {K::delayed_start, "delayed_start", E::window_or_count, {kAnyDelay}},
      {K::stolen, "stolen", E::instant, {whole<&F::buffered>("buffered", 0, 1)}},
      {K::restart, "restart", E::instant, {}},
      {K::reboot, "reboot", E::instant, {seconds<&F::down>("down_s"), whole<&F::resume>("resume", 0, 1)}},
      {K::stall, "stall", E::window, {}},
      {K::ft_jump_back, "ft_jump_back", E::instant, {whole<&F::samples>("samples", 1, kMany, true)}},
      {K::overrun, "overrun", E::instant, {whole<&F::samples>("samples", 1, 1e6, true)}},
      {K::wrap, "wrap", E::instant, {whole<&F::samples>("samples", 1, kMany, true)}},
      {K::clock_skew,
       "clock_skew",
       E::window_or_forever,
       {{"ppm", as_number<&F::ppm>, -1000, 1000, false, true},
        {"wander_ppm", as_number<&F::wander_ppm>, 0, 1000},
        {"period_s", as_number<&F::period>, 1, 1e6}}},
      {K::status,
       "status",
       E::window_or_forever,
       {whole<&F::bits>("bits", 1, kMany, true), whole<&F::latched>("latched", 0, 1)}},
      {K::saturation, "saturation", E::window_or_forever, {whole<&F::axes>("axes", 1, 63, true)}},
      {K::units,
       "units",
       E::instant,
       {whole<&F::force_unit>("force_unit", 1, 6, true), whole<&F::torque_unit>("torque_unit", 1, 6)}},
      {K::rate, "rate", E::instant, {whole<&F::rate_hz>("rate_hz", 1, 7000, true)}},
      {K::zero_drift,
       "zero_drift",
       E::instant,
       {whole<&F::axis>("axis", 0, 5),
        {"amount", as_number<&F::amount>, -1000, 1000, false, true},
        {"tau_s", as_number<&F::tau>, 1e-3, 1e6}}},
      {K::address, "address", E::window_or_forever, {word("address", set_address)}},
      {K::http_slow, "http_slow", E::window_or_count, {kAnyDelay}},
      {K::http_truncated, "http_truncated", E::window_or_count, {whole<&F::size>("size", 0, 1e6, true)}},
      {K::http_status, "http_status", E::window_or_count, {whole<&F::code>("code", 400, 599, true)}},
      {K::http_oversized, "http_oversized", E::window_or_count, {whole<&F::size>("size", 1, 1e8, true)}},
      {K::http_charset, "http_charset", E::window_or_count, {whole<&F::utf16>("utf16", 0, 1)}},
      {K::http_missing_tag, "http_missing_tag", E::window_or_count, {word("tag", set_tag)}},
      {K::http_duplicate_tag, "http_duplicate_tag", E::window_or_count, {word("tag", set_tag)}},
      {K::http_refused, "http_refused", E::window, {}},
      {K::tcp_split, "tcp_split", E::window_or_count, {whole<&F::size>("size", 1, 23, true), kDelay}},
      {K::tcp_merged, "tcp_merged", E::window_or_count, {kAnyDelay}},
      {K::tcp_short, "tcp_short", E::window_or_count, {whole<&F::size>("size", 0, 23, true)}},
  };
  return table;
}

const Kind& kind_named(const std::string& name) {
  for (const Kind& kind : kinds()) {
    if (kind.name == name) return kind;
  }
  std::string known;
  for (const Kind& kind : kinds()) known += fmt::format("{}{}", known.empty() ? "" : ", ", kind.name);
  throw FaultEntryError("kind", fmt::format("no fault is called '{}'; there are {}", name, known));
}

double number_within(const Parameter& parameter, const FaultEntry& entry) {
  return fault_number(parameter.name, entry.at(std::string(parameter.name)),
                      {parameter.low, parameter.high, parameter.whole});
}

void set(Fault& fault, const Parameter& parameter, const FaultEntry& entry) {
  if (parameter.set_word == nullptr) return parameter.set(fault, number_within(parameter, entry));
  const std::string key(parameter.name);
  if (!parameter.set_word(fault, entry.at(key)))
    throw FaultEntryError(key, fmt::format("'{}' is no {}", entry.at(key), key == "tag" ? "element" : "IPv4 address"));
}

void check_extent(const Kind& kind, const FaultEntry& entry) {
  const bool has_end = entry.contains("for_s"), has_count = entry.contains("count");
  if (kind.extent == Extent::window && !has_end) throw FaultEntryError("", fmt::format("{} needs for_s", kind.name));
  if (kind.extent == Extent::window_or_count && !has_end && !has_count) {
    throw FaultEntryError("", fmt::format("{} needs for_s or count", kind.name));
  }
}

std::vector<Parameter> parameters_of(const Kind& kind) {
  std::vector<Parameter> all = kind.parameters;
  all.push_back(seconds<&Fault::at>("at_s", true));
  all.back().high = 1e6;
  if (kind.extent != Extent::instant) all.push_back({"for_s", as_number<&Fault::lasts>, 1e-6, 1e6});
  if (kind.extent == Extent::window_or_count) all.push_back(whole<&Fault::count>("count", 1, 1e9));
  return all;
}

}  // namespace

std::string_view name_of(FaultKind kind) noexcept {
  const auto& table = kinds();
  const auto found = std::find_if(table.begin(), table.end(), [&](const Kind& k) { return k.kind == kind; });
  return found == table.end() ? "?" : found->name;
}

const std::vector<FaultKind>& all_fault_kinds() {
  static const std::vector<FaultKind> all = [] {
    std::vector<FaultKind> kinds_alone;
    for (const Kind& kind : kinds()) kinds_alone.push_back(kind.kind);
    return kinds_alone;
  }();
  return all;
}

Fault fault_of(const FaultEntry& entry) {
  const Kind& kind = kind_named(kind_of(entry));
  const auto parameters = parameters_of(kind);
  for (const auto& [key, value] : entry) {
    const bool known = key == "kind" || std::any_of(parameters.begin(), parameters.end(),
                                                    [&name = key](const Parameter& p) { return p.name == name; });
    if (!known) throw FaultEntryError(key, fmt::format("{} has no '{}'", kind.name, key));
  }
  check_extent(kind, entry);
  Fault fault;
  fault.kind = kind.kind;
  if (kind.kind == FaultKind::reorder) fault.delay = kOvertaken;
  if (kind.kind == FaultKind::tcp_split) fault.delay = kBetweenSegments;
  for (const Parameter& parameter : parameters) {
    if (entry.contains(std::string(parameter.name))) {
      set(fault, parameter, entry);
    } else if (parameter.required) {
      throw FaultEntryError("", fmt::format("{} needs {}", kind.name, parameter.name));
    }
  }
  if (fault.kind == FaultKind::wrong_size && fault.size > 0 && fault.size % 36 == 0 && fault.size <= 1440) {
    throw FaultEntryError("size", "whole records are the right size: 36 to 1440 in steps of 36");
  }
  return fault;
}

}  // namespace kphi::sim
