#include "drivers/sim/netbox/faults.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>

#include <algorithm>

namespace kphi::sim {
namespace {

using Parameter = FaultParameter<Fault>;

constexpr Duration kOvertaken = std::chrono::milliseconds(10);
constexpr Duration kBetweenSegments = std::chrono::milliseconds(2);
constexpr double kMany = 4294967295.0;

void as_tag(Fault& fault, const Parameter& parameter, const std::string& word) {
  fault.tag = word;
  const bool good = !word.empty() && std::all_of(word.begin(), word.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9');
  });
  if (!good)
    throw FaultEntryError(std::string(parameter.name), fmt::format("\"{}\" is not the name of an element", word));
}
void as_address(Fault& fault, const Parameter& parameter, const std::string& word) {
  fault.address = word;
  in_addr parsed{};
  if (::inet_pton(AF_INET, word.c_str(), &parsed) != 1)
    throw FaultEntryError(std::string(parameter.name), fmt::format("\"{}\" is not an IPv4 address", word));
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

}  // namespace

const FaultTable<Fault>& load_cell_faults() {
  using F = Fault;
  using K = FaultKind;
  using E = FaultExtent;
  static const FaultTable<Fault> all(
      "the load cell",
      {
          {K::loss, "loss", E::window_or_count, {key<&F::p>("p"), key<&F::burst>("burst", 1, 1e6)}},
          {K::gilbert,
           "gilbert",
           E::window_or_count,
           {required<&F::p_good_bad>("p_good_bad"), required<&F::p_bad_good>("p_bad_good"), key<&F::loss>("loss")}},
          {K::duplicate, "duplicate", E::window_or_count, {key<&F::p>("p"), key<&F::delay>("delay_s")}},
          {K::reorder,
           "reorder",
           E::window_or_count,
           {key<&F::p>("p"), key<&F::depth>("depth", 1, 1000), key<&F::delay>("delay_s")},
           delayed_by(kOvertaken)},
          {K::delay, "delay", E::window_or_count, {required<&F::delay>("delay_s"), key<&F::jitter>("jitter_s")}},
          {K::jitter,
           "jitter",
           E::window_or_count,
           {required<&F::jitter>("mean_s"), key<&F::p>("p"), key<&F::spike>("spike_s")}},
          {K::hold, "hold", E::window, {}},
          {K::wrong_size,
           "wrong_size",
           E::window_or_count,
           {key<&F::p>("p"), {"size", as_wrong_size, 0, 1476, true}, key<&F::replaces>("replaces")}},
          {K::short_block, "short_block", E::window_or_count, {key<&F::p>("p"), key<&F::records>("records", 1, 39)}},
          {K::foreign_source, "foreign_source", E::window_or_count, {key<&F::p>("p")}},
          {K::lost_start, "lost_start", E::window_or_count, {}},
          {K::doubled_start, "doubled_start", E::window_or_count, {key<&F::delay>("delay_s")}},
          {K::delayed_start, "delayed_start", E::window_or_count, {required<&F::delay>("delay_s")}},
          {K::taken_over, "taken_over", E::instant, {key<&F::buffered>("buffered")}},
          {K::restart, "restart", E::instant, {}},
          {K::reboot, "reboot", E::instant, {key<&F::down>("down_s"), key<&F::resume>("resume")}},
          {K::stall, "stall", E::window, {}},
          {K::ft_jump_back, "ft_jump_back", E::instant, {required<&F::samples>("samples", 1, kMany)}},
          {K::overrun, "overrun", E::instant, {required<&F::samples>("samples", 1, 1e6)}},
          {K::wrap, "wrap", E::instant, {required<&F::samples>("samples", 1, kMany)}},
          {K::clock_skew,
           "clock_skew",
           E::window_or_forever,
           {required<&F::ppm>("ppm", -1000, 1000), key<&F::wander_ppm>("wander_ppm", 0, 1000),
            key<&F::period>("period_s", 1, 1e6)}},
          {K::status,
           "status",
           E::window_or_forever,
           {required<&F::bits>("bits", 1, kMany), key<&F::latched>("latched")}},
          {K::saturation, "saturation", E::window_or_forever, {required<&F::axes>("axes", 1, 63)}},
          {K::units,
           "units",
           E::instant,
           {required<&F::force_unit>("force_unit", 1, 6), key<&F::torque_unit>("torque_unit", 1, 6)}},
          {K::rate, "rate", E::instant, {required<&F::rate_hz>("rate_hz", 1, 7000)}},
          {K::zero_drift,
           "zero_drift",
           E::instant,
           {key<&F::axis>("axis", 0, 5), required<&F::amount>("amount", -1000, 1000),
            key<&F::tau>("tau_s", 1e-3, 1e6)}},
          {K::address, "address", E::window_or_forever, {{"address", as_address, 0, 0, true}}},
          {K::http_slow, "http_slow", E::window_or_count, {required<&F::delay>("delay_s")}},
          {K::http_truncated, "http_truncated", E::window_or_count, {required<&F::size>("size", 0, 1e6)}},
          {K::http_status, "http_status", E::window_or_count, {required<&F::code>("code", 400, 599)}},
          {K::http_oversized, "http_oversized", E::window_or_count, {required<&F::size>("size", 1, 1e8)}},
          {K::http_charset, "http_charset", E::window_or_count, {key<&F::utf16>("utf16")}},
          {K::http_missing_tag, "http_missing_tag", E::window_or_count, {Parameter{"tag", as_tag, 0, 0, true}}},
          {K::http_duplicate_tag, "http_duplicate_tag", E::window_or_count, {Parameter{"tag", as_tag, 0, 0, true}}},
          {K::http_refused, "http_refused", E::window, {}},
          {K::tcp_split,
           "tcp_split",
           E::window_or_count,
           {required<&F::size>("size", 1, 23), key<&F::delay>("delay_s")},
           delayed_by(kBetweenSegments)},
          {K::tcp_merged, "tcp_merged", E::window_or_count, {required<&F::delay>("delay_s")}},
          {K::tcp_short, "tcp_short", E::window_or_count, {required<&F::size>("size", 0, 23)}},
      });
  return all;
}

}  // namespace kphi::sim
