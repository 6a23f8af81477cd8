#include "drivers/sim/supply_faults.hpp"

#include "drivers/sim/fault_table.hpp"

namespace kphi::sim {
namespace {

constexpr std::string_view kPrefix = "supply_";

using Parameter = FaultParameter<SupplyFault>;

constexpr double kHour = 3600;

using F = SupplyFault;
constexpr Parameter kP{"p", Parameter::into<&F::p>, 0, 1};
constexpr Parameter kSize{"size", Parameter::into<&F::size>, 0, 260, true};
constexpr Parameter kDelay{"delay_s", Parameter::into<&F::delay>, 0, kHour, false, true};
constexpr Parameter kGap{"gap_s", Parameter::into<&F::delay>, 0, 10, false, true};
constexpr Parameter kSlave{"slave", Parameter::into<&F::slave>, 0, 255, true};
constexpr Parameter kException{"code", Parameter::into<&F::code>, 1, 11, true};
constexpr Parameter kTrip{"code", Parameter::into<&F::code>, 1, 5, true, true};
constexpr Parameter kRegister{"register", Parameter::into<&F::address>, 0, 65535, true, true};
constexpr Parameter kVolts{"volts", Parameter::into<&F::volts>, 0, 100, false, true};
constexpr Parameter kValue{"value", Parameter::into<&F::value>, 0, 65535, true, true};

const FaultTable<SupplyFault>& table() {
  using K = SupplyFaultKind;
  using E = FaultExtent;
  static const FaultTable<SupplyFault> all(
      "the supply", {
                        {K::bad_crc, "supply_bad_crc", E::window_or_count, {kP}},
                        {K::no_reply, "supply_no_reply", E::window_or_count, {kP}},
                        {K::deaf, "supply_deaf", E::window_or_count, {kP}},
                        {K::truncated, "supply_truncated", E::window_or_count, {kP, kSize}},
                        {K::dribble, "supply_dribble", E::window_or_count, {kP, kGap}},
                        {K::garbage, "supply_garbage", E::window_or_count, {kP, kSize}},
                        {K::wrong_slave, "supply_wrong_slave", E::window_or_count, {kP, kSlave}},
                        {K::wrong_transaction, "supply_wrong_transaction", E::window_or_count, {kP}},
                        {K::echo, "supply_echo", E::window_or_count, {kP}},
                        {K::late, "supply_late", E::window_or_count, {kP, kDelay}},
                        {K::exception, "supply_exception", E::window_or_count, {kP, kException}},
                        {K::ignored_writes, "supply_ignored_writes", E::window_or_count, {kP}},
                        {K::reads_as, "supply_reads_as", E::window, {kRegister, kValue}},
                        {K::closed, "supply_closed", E::window, {}},
                        {K::trip, "supply_trip", E::instant, {kTrip}},
                        {K::panel, "supply_panel", E::instant, {kRegister, kValue}},
                        {K::sag, "supply_sag", E::window, {kVolts}},
                    });
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
