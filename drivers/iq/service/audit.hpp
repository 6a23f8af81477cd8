// Checks a module's parameters, read at connection, against the intended run. The values go into the run's header; the
// findings are listed worst first, each with a remedy. A fault: do not spin.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "base/finding.hpp"
#include "drivers/iq/session/connecting.hpp"
#include "drivers/iq/wire/identity.hpp"

namespace kphi::iq {

/// All audited entries, in one inquiry; those of one of the two clients that tell the coil's temperature.
[[nodiscard]] AuditRecord read_audit(const Ask& ask, bool newer_coil_client);

/// What a person may accept that a firmware lacks, by the names of a bench file: client 84, or one entry.
inline constexpr std::array<const char*, 2> kMayLack{"power_safety", "volts_limit"};

/// The intended use. Zero or empty: unknown, not checked.
struct Intention {
  double supply_voltage_max_v = 0;  ///< largest supply voltage; the present voltage counts, too
  double speed_max_rad_s = 0;       ///< fastest step
  double coil_temperature_max_degc = 0;
  bool clock_unchecked = false;                 ///< the gain of the module's clock is unknown: add a note
  std::string uid;                              ///< of the expected module: seen before, or named by the clock gain
  std::vector<std::string> accepted_without{};  ///< of kMayLack, whose absence is then only a warning
};

/// Worst first.
[[nodiscard]] std::vector<Finding> audit(const AuditRecord& module, const Intention& intention = {});

/// "motor current, coil temperature": the set bits of power_safety.fault_now or fault_ever.
[[nodiscard]] std::string fault_words(int bits);

}  // namespace kphi::iq
