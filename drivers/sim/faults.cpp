#include "drivers/sim/faults.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>

#include <algorithm>

#include "drivers/sim/fault_table.hpp"

namespace kphi::sim {
namespace {

using Parameter = FaultParameter<Fault>;

constexpr Duration kOvertaken = std::chrono::milliseconds(10);
constexpr Duration kBetweenSegments = std::chrono::milliseconds(2);
constexpr double kHour = 3600;
constexpr double kMany = 4294967295.0;

template <auto Member>
constexpr Parameter probability(std::string_view name, bool required = false) {
  return {name, Parameter::into<Member>, 0, 1, false, required};
}
template <auto Member>
constexpr Parameter seconds(std::string_view name, bool required = false) {
  return {name, Parameter::into<Member>, 0, kHour, false, required};
}
template <auto Member>
constexpr Parameter whole(std::string_view name, double low, double high, bool required = false) {
  return {name, Parameter::into<Member>, low, high, true, required};
}

void as_tag(Fault& fault, const Parameter& parameter, const std::string& word) {
  fault.tag = word;
  const bool good = !word.empty() && std::all_of(word.begin(), word.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9');
  });
  if (!good) throw FaultEntryError(std::string(parameter.name), fmt::format("'{}' is no element", word));
}
void as_address(Fault& fault, const Parameter& parameter, const std::string& word) {
  fault.address = word;
  in_addr parsed{};
  if (::inet_pton(AF_INET, word.c_str(), &parsed) != 1)
    throw FaultEntryError(std::string(parameter.name), fmt::format("'{}' is no IPv4 address", word));
}
void as_wrong_size(Fault& fault, const Parameter& parameter, const std::string& text) {
  Parameter::into<&Fault::size>(fault, parameter, text);
  if (fault.size > 0 && fault.size % 36 == 0 && fault.size <= 1440)
    throw FaultEntryError("size", "whole records are the right size: 36 to 1440 in steps of 36");
}

Fault delayed_by(Duration delay) {
  Fault fault;
  fault.delay = delay;
  return fault;
}

constexpr Parameter kP = probability<&Fault::p>("p");
constexpr Parameter kDelay = seconds<&Fault::delay>("delay_s");
constexpr Parameter kAnyDelay = seconds<&Fault::delay>("delay_s", true);
constexpr Parameter kTag{"tag", as_tag, 0, 0, false, true};

const FaultTable<Fault>& table() {
  using F = Fault;
  using K = FaultKind;
  using E = FaultExtent;
  static const FaultTable<Fault> all(
      "the load cell",
      {
          {K::loss, "loss", E::window_or_count, {kP, whole<&F::burst>("burst", 1, 1e6)}},
          {K::gilbert,
           "gilbert",
           E::window_or_count,
           {probability<&F::p_good_bad>("p_good_bad", true), probability<&F::p_bad_good>("p_bad_good", true),
            probability<&F::loss>("loss")}},
          {K::duplicate, "duplicate", E::window_or_count, {kP, kDelay}},
          {K::reorder,
           "reorder",
           E::window_or_count,
           {kP, whole<&F::depth>("depth", 1, 1000), kDelay},
           delayed_by(kOvertaken)},
          {K::delay, "delay", E::window_or_count, {kAnyDelay, seconds<&F::jitter>("jitter_s")}},
          {K::jitter,
           "jitter",
           E::window_or_count,
           {seconds<&F::jitter>("mean_s", true), kP, seconds<&F::spike>("spike_s")}},
          {K::hold, "hold", E::window, {}},
          {K::wrong_size,
           "wrong_size",
           E::window_or_count,
           {kP, {"size", as_wrong_size, 0, 1476, true, true}, whole<&F::replaces>("replaces", 0, 1)}},
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
           {{"ppm", Parameter::into<&F::ppm>, -1000, 1000, false, true},
            {"wander_ppm", Parameter::into<&F::wander_ppm>, 0, 1000},
            {"period_s", Parameter::into<&F::period>, 1, 1e6}}},
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
            {"amount", Parameter::into<&F::amount>, -1000, 1000, false, true},
            {"tau_s", Parameter::into<&F::tau>, 1e-3, 1e6}}},
          {K::address, "address", E::window_or_forever, {{"address", as_address, 0, 0, false, true}}},
          {K::http_slow, "http_slow", E::window_or_count, {kAnyDelay}},
          {K::http_truncated, "http_truncated", E::window_or_count, {whole<&F::size>("size", 0, 1e6, true)}},
          {K::http_status, "http_status", E::window_or_count, {whole<&F::code>("code", 400, 599, true)}},
          {K::http_oversized, "http_oversized", E::window_or_count, {whole<&F::size>("size", 1, 1e8, true)}},
          {K::http_charset, "http_charset", E::window_or_count, {whole<&F::utf16>("utf16", 0, 1)}},
          {K::http_missing_tag, "http_missing_tag", E::window_or_count, {kTag}},
          {K::http_duplicate_tag, "http_duplicate_tag", E::window_or_count, {kTag}},
          {K::http_refused, "http_refused", E::window, {}},
          {K::tcp_split,
           "tcp_split",
           E::window_or_count,
           {whole<&F::size>("size", 1, 23, true), kDelay},
           delayed_by(kBetweenSegments)},
          {K::tcp_merged, "tcp_merged", E::window_or_count, {kAnyDelay}},
          {K::tcp_short, "tcp_short", E::window_or_count, {whole<&F::size>("size", 0, 23, true)}},
      });
  return all;
}

}  // namespace

std::string_view name_of(FaultKind kind) noexcept { return table().name_of(kind); }

const std::vector<FaultKind>& all_fault_kinds() {
  static const std::vector<FaultKind> all = table().kinds();
  return all;
}

Fault fault_of(const FaultEntry& entry) { return table().read(entry); }

}  // namespace kphi::sim
