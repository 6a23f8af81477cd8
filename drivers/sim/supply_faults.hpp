// The script of what goes wrong on the supply's wire and in the supply, as plain data; entries are written as those of
// faults.hpp: {at_s: 5, for_s: 1, kind: supply_late, delay_s: 0.55}; `late` there is supply_late here. Times are bench
// time.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "drivers/clock.hpp"
#include "drivers/sim/fault_entry.hpp"

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
  panel,           ///< somebody sets `register` to `value` by hand
  sag,             ///< its source gives way by `volts`
};

struct SupplyFault {
  SupplyFaultKind kind = SupplyFaultKind::no_reply;
  Instant at{0};
  Duration lasts{0};        ///< 0: no end in time
  std::uint64_t count = 0;  ///< of replies that it concerns; 0: no limit
  double p = 1;
  std::uint64_t size = 3;
  Duration delay{0};
  int slave = 2, code = 2;
  std::uint16_t address = 0, value = 0;  ///< of a register
  double volts = 0;

  [[nodiscard]] Instant end() const noexcept { return lasts > Duration{0} ? at + lasts : kNever; }
};

using SupplyFaultScript = std::vector<SupplyFault>;

[[nodiscard]] std::string_view name_of(SupplyFaultKind kind) noexcept;

/// Does this entry of a script belong here, by its kind's name?
[[nodiscard]] bool is_supply_fault(const FaultEntry& entry) noexcept;

/// Strict: unknown kinds and keys, values out of range and missing keys throw FaultEntryError.
[[nodiscard]] SupplyFault supply_fault_of(const FaultEntry& entry);

}  // namespace kphi::sim
