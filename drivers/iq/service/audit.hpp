// Checks a module's parameters, read at connection, against the intended run. The values go into the run's header; the
// findings are listed worst first, each with a remedy. A fault: do not spin.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/finding.hpp"
#include "drivers/iq/service/dialogue.hpp"
#include "drivers/iq/wire/identity.hpp"

namespace kphi::iq {

template <Path path>
concept Audited = Readable<path> && entry<path>
.audited;

/// The values that were read.
struct AuditRecord {
  std::map<const Entry*, double> values;  ///< of audited entries, in the order of their table

  /// value<"brushless_drive.volts_limit">(); nullopt: no answer, or not asked. An entry that is not audited does not
  /// compile.
  template <Path path>
  requires Audited<path>
  [[nodiscard]] std::optional<double> value() const {
    const auto found = values.find(&entry<path>);
    return found == values.end() ? std::nullopt : std::optional(found->second);
  }

  [[nodiscard]] std::optional<FirmwareVersion> firmware() const;
  [[nodiscard]] std::optional<BoardVersion> hardware() const;
  [[nodiscard]] std::optional<BoardVersion> electronics() const;
  /// 24 hexadecimal digits; empty if unknown.
  [[nodiscard]] std::string uid() const;
  /// 83 or, with old firmware, 77; 0: no answer.
  [[nodiscard]] int coil_temperature_client() const;

  /// For the run's header: YAML, one line per known value ("brushless_drive.volts_limit: 27  # V"), starting with the
  /// decoded versions. Unknown values are left out.
  [[nodiscard]] std::string text() const;
  /// Reads text() back; other lines are skipped.
  [[nodiscard]] static AuditRecord of(std::string_view text);
};

/// Reads all entries; takes as long as the time-outs of the silent ones.
[[nodiscard]] AuditRecord read_audit(Dialogue& module);

/// The intended use. Zero or empty: unknown, not checked.
struct Intention {
  double supply_voltage_max_v = 0;  ///< largest supply voltage; the present voltage counts, too
  double timeout_max_s = 1;         ///< longest communication timeout that is accepted
  double speed_max_rad_s = 0;       ///< fastest step
  double coil_temperature_max_degc = 0;
  bool hobby_input_allowed = false;  ///< false: refuse a module whose hobby input may also command it
  bool clock_unchecked = false;      ///< the gain of the module's clock is unknown: add a note
  std::string uid;                   ///< of the expected module: seen before, or named by the clock gain
};

/// Worst first.
[[nodiscard]] std::vector<Finding> audit(const AuditRecord& module, const Intention& intention = {});

/// "motor current, coil temperature": the set bits of power_safety.fault_now or fault_ever.
[[nodiscard]] std::string fault_words(int bits);

}  // namespace kphi::iq
