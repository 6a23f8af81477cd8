// What a bench file says of the air: thrust is proportional to its density.
#pragma once

namespace kphi::profiles {

/// Read off a thermometer, a barometer and a hygrometer beside the stand, with standard uncertainties (k = 1).
struct AmbientPlace {
  double temperature_c = 0;      ///< °C
  double pressure_pa = 0;        ///< absolute, at the stand: not reduced to sea level
  double relative_humidity = 0;  ///< 0..1
  double u_temperature_c = 1;
  double u_pressure_pa = 100;
  double u_relative_humidity = 0.05;
};

}  // namespace kphi::profiles
