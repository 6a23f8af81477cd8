// The air that the propeller works on: thrust is proportional to its density.
#pragma once

#include <string>

namespace kphi::ambient {

/// Moist air with the standard uncertainties (k = 1) of what was measured.
struct Air {
  double temperature_c = 0;      ///< °C
  double pressure_pa = 0;        ///< absolute, at the stand: not reduced to sea level
  double relative_humidity = 0;  ///< 0..1
  double u_temperature_c = 0;
  double u_pressure_pa = 0;
  double u_relative_humidity = 0;
};

struct Density {
  double kg_m3 = 0;
  double u_kg_m3 = 0;  ///< standard uncertainty, of the measured quantities and of the formula
};

/// The range of the formula; a reading outside it means a broken sensor.
inline constexpr double kColdest = -40, kHottest = 60;                    // °C
inline constexpr double kLowestPressure = 5e4, kHighestPressure = 1.1e5;  // Pa

[[nodiscard]] bool plausible(const Air& air) noexcept;

/// CIPM-2007 (Picard et al., Metrologia 45, 2008, eq. 1, A1.1 to A1.4; x_CO2 = 400e-6), its relative uncertainty 22e-6
/// within 15..27 °C and 600..1100 hPa. Outside, the terms of the enhancement factor are extrapolated: 1e-4 is taken.
/// First-order propagation (JCGM 100, eq. 10). Throws std::invalid_argument unless plausible.
[[nodiscard]] Density density_of(const Air& air);

/// A source of the state of the air.
class Ambient {
 public:
  virtual ~Ambient() = default;
  /// One measurement. Blocks for some 110 ms, at most about two seconds; throws DeviceError.
  [[nodiscard]] virtual Air read() = 0;
  /// "BME280 at 0x76 behind USB device 04d8:00dd, serial 0001".
  [[nodiscard]] virtual const std::string& identity() const noexcept = 0;
};

}  // namespace kphi::ambient
