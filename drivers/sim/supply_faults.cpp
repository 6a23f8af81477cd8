#include "drivers/sim/supply_faults.hpp"

#include "drivers/sim/fault_table.hpp"

namespace kphi::sim {
namespace {

constexpr std::string_view kPrefix = "supply_";

using P = FaultParameter<SupplyFault>;

const FaultTable<SupplyFault>& table() {
  using F = SupplyFault;
  using K = SupplyFaultKind;
  using E = FaultExtent;
  const P p{"p", P::into<&F::p>, 0, 1}, size{"size", P::into<&F::size>, 0, 260, true};
  const P delay{"delay_s", P::into<&F::delay>, 0, 3600, false, true};
  const P gap{"gap_s", P::into<&F::delay>, 0, 10, false, true};
  const P slave{"slave", P::into<&F::slave>, 0, 255, true};
  const P exception{"code", P::into<&F::code>, 1, 11, true}, trip{"code", P::into<&F::code>, 1, 5, true, true};
  const P address{"register", P::into<&F::address>, 0, 65535, true, true};
  const P value{"value", P::into<&F::value>, 0, 65535, true, true};
  static const FaultTable<SupplyFault> all(
      "the supply", {{K::bad_crc, "supply_bad_crc", E::window_or_count, {p}},
                     {K::no_reply, "supply_no_reply", E::window_or_count, {p}},
                     {K::deaf, "supply_deaf", E::window_or_count, {p}},
                     {K::truncated, "supply_truncated", E::window_or_count, {p, size}},
                     {K::dribble, "supply_dribble", E::window_or_count, {p, gap}},
                     {K::garbage, "supply_garbage", E::window_or_count, {p, size}},
                     {K::wrong_slave, "supply_wrong_slave", E::window_or_count, {p, slave}},
                     {K::wrong_transaction, "supply_wrong_transaction", E::window_or_count, {p}},
                     {K::echo, "supply_echo", E::window_or_count, {p}},
                     {K::late, "supply_late", E::window_or_count, {p, delay}},
                     {K::exception, "supply_exception", E::window_or_count, {p, exception}},
                     {K::ignored_writes, "supply_ignored_writes", E::window_or_count, {p}},
                     {K::reads_as, "supply_reads_as", E::window, {address, value}},
                     {K::closed, "supply_closed", E::window, {}},
                     {K::trip, "supply_trip", E::instant, {trip}},
                     {K::panel, "supply_panel", E::instant, {address, value}},
                     {K::sag, "supply_sag", E::window, {{"volts", P::into<&F::volts>, 0, 100, false, true}}}});
  return all;
}

}  // namespace

std::string_view name_of(SupplyFaultKind kind) noexcept { return table().name_of(kind); }

bool is_supply_fault(const FaultEntry& entry) noexcept {
  const auto kind = entry.find("kind");
  return kind != entry.end() && kind->second.starts_with(kPrefix);
}

SupplyFault supply_fault_of(const FaultEntry& entry) { return table().read(entry); }

}  // namespace kphi::sim
