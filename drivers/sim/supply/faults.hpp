// Faults of the supply and its wire. In a script, kinds begin with supply_: {at_s: 5, for_s: 1, kind: supply_late,
// delay_s: 0.55}; times are bench time.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "base/clock.hpp"
#include "drivers/sim/script/fault_table.hpp"

namespace kphi::sim {

enum class SupplyFaultKind : std::uint8_t {
  // replies on their way to the host, with probability `p` each
  bad_crc,            ///< RTU
  no_reply,           ///< the request was obeyed
  deaf,               ///< the request was not even heard
  truncated,          ///< only the first `size` bytes
  dribble,            ///< byte by byte, `gap_s` apart
  garbage,            ///< `size` bytes before the reply
  wrong_slave,        ///< another sender, `slave`
  wrong_transaction,  ///< TCP: the number of another request
  echo,               ///< the request comes back first
  late,               ///< by `delay_s`; what comes after it waits its turn
  exception,          ///< `code` instead of obedience
  // the device
  ignored_writes,  ///< acknowledged, without effect
  reads_as,        ///< `register` reads `value`
  closed,          ///< port and connection are gone
  trip,            ///< switches itself off: `code` 1 OVP, 2 OCP, 3 OPP, 4 over-heated, 5 short circuit
  panel,           ///< `register` is set to `value` on the front panel
  sag,             ///< its output falls by `volts`
};

struct SupplyFault : ScriptedFault<SupplyFaultKind> {
  double p = 1;
  std::uint64_t size = 3;
  Duration delay{0};
  int slave = 2, code = 2;
  std::uint16_t address = 0, value = 0;  ///< of a register
  double volts = 0;
};

using SupplyFaultScript = std::vector<SupplyFault>;

[[nodiscard]] const FaultTable<SupplyFault>& supply_faults();

}  // namespace kphi::sim
