// How one maker's supplies want to be asked. One row per family; the first whose pattern stands in *IDN? counts.
#pragma once

#include <string_view>

namespace kphi::scpi {

/// Commands without their argument; empty: this family has none.
struct Dialect {
  std::string_view family;           ///< for messages
  std::string_view identity;         ///< part of *IDN?; empty: any
  std::string_view over_voltage;     ///< threshold
  std::string_view over_voltage_on;  ///< whole command that arms it; empty: always armed
  std::string_view over_current;
  std::string_view over_current_on;
  std::string_view over_voltage_tripped;  ///< query; answers 1 or YES
  std::string_view over_current_tripped;
  std::string_view regulation;  ///< query
  /// True: `regulation` answers CV, CC or UR. False: bits of the questionable status (SCPI-99, 20.3): bit 1 = current
  /// is what is held.
  bool regulation_by_name = false;
  double voltage_step_v = 0.001, current_step_a = 0.001;
};

[[nodiscard]] const Dialect& dialect_of(std::string_view identity) noexcept;

}  // namespace kphi::scpi
