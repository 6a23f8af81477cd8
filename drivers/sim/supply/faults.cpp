#include "drivers/sim/supply/faults.hpp"

namespace kphi::sim {
namespace {

using F = SupplyFault;
using Parameter = FaultParameter<F>;
constexpr Parameter kP = key<&F::p>("p");
constexpr Parameter kSize = key<&F::size>("size", 0, 260);
constexpr Parameter kRegister = required<&F::address>("register", 0, 65535);
constexpr Parameter kValue = required<&F::value>("value", 0, 65535);

}  // namespace

const FaultTable<SupplyFault>& supply_faults() {
  using K = SupplyFaultKind;
  using E = FaultExtent;
  static const FaultTable<SupplyFault> all(
      "the supply",
      {
          {K::bad_crc, "supply_bad_crc", E::window_or_count, {kP}},
          {K::no_reply, "supply_no_reply", E::window_or_count, {kP}},
          {K::deaf, "supply_deaf", E::window_or_count, {kP}},
          {K::truncated, "supply_truncated", E::window_or_count, {kP, kSize}},
          {K::dribble, "supply_dribble", E::window_or_count, {kP, required<&F::delay>("gap_s", 0, 10)}},
          {K::garbage, "supply_garbage", E::window_or_count, {kP, kSize}},
          {K::wrong_slave, "supply_wrong_slave", E::window_or_count, {kP, key<&F::slave>("slave", 0, 255)}},
          {K::wrong_transaction, "supply_wrong_transaction", E::window_or_count, {kP}},
          {K::echo, "supply_echo", E::window_or_count, {kP}},
          {K::late, "supply_late", E::window_or_count, {kP, required<&F::delay>("delay_s")}},
          {K::exception, "supply_exception", E::window_or_count, {kP, key<&F::code>("code", 1, 11)}},
          {K::ignored_writes, "supply_ignored_writes", E::window_or_count, {kP}},
          {K::reads_as, "supply_reads_as", E::window, {kRegister, kValue}},
          {K::closed, "supply_closed", E::window, {}},
          {K::trip, "supply_trip", E::instant, {required<&F::code>("code", 1, 5)}},
          {K::panel, "supply_panel", E::instant, {kRegister, kValue}},
          {K::sag, "supply_sag", E::window, {required<&F::volts>("volts", 0, 100)}},
      });
  return all;
}

}  // namespace kphi::sim
