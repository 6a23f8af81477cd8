// One look at the bench supply, as it stands in the run file. Codes are those of the file.
#pragma once

#include <array>
#include <cstdint>

namespace kphi::results {

enum class SupplyRegulation : std::uint32_t { constant_voltage, constant_current, unknown };
inline constexpr std::array<const char*, 3> kSupplyRegulationNames{"constant voltage", "constant current", "unknown"};

/// Why the supply switched its output off by itself.
enum class SupplyProtection : std::uint32_t {
  none,
  over_voltage,
  over_current,
  over_power,
  over_temperature,
  short_circuit,
  unknown,
};
inline constexpr std::array<const char*, 7> kSupplyProtectionNames{
    "none", "over-voltage", "over-current", "over-power", "over-temperature", "short circuit", "unknown"};
[[nodiscard]] constexpr const char* name_of(SupplyProtection protection) {
  return kSupplyProtectionNames[static_cast<std::size_t>(protection)];
}

struct SupplyReading {
  std::int64_t time_ns = 0;         ///< bench time, midpoint of request and answer
  std::int64_t uncertainty_ns = 0;  ///< half of the time between the two
  double voltage_v = 0;             ///< at its terminals
  double current_a = 0;
  double set_voltage_v = 0;    ///< as the supply had it then
  double current_limit_a = 0;  ///< likewise
  SupplyRegulation regulation = SupplyRegulation::unknown;
  SupplyProtection protection = SupplyProtection::none;
  std::uint64_t output = 0;  ///< 1: on
};

// At a settled speed: share of the set voltage that may be missing at the terminals, and share above it that is more
// than a meter errs by, so that the motor feeds back.
inline constexpr double kSupplySag = 0.05;
inline constexpr double kSupplyRise = 0.03;

}  // namespace kphi::results
