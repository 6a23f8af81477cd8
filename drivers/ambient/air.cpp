#include "drivers/ambient/air.hpp"

#include <cmath>
#include <stdexcept>

namespace kphi::ambient {
namespace {

double cipm_2007(double temperature_c, double pressure_pa, double relative_humidity) noexcept {
  const double t = temperature_c, p = pressure_pa, kelvin = t + 273.15;
  const double saturation_pa =
      std::exp(1.2378847e-5 * kelvin * kelvin - 1.9121316e-2 * kelvin + 33.93711047 - 6.3431645e3 / kelvin);
  const double enhancement = 1.00062 + 3.14e-8 * p + 5.6e-7 * t * t;
  const double vapour = relative_humidity * enhancement * saturation_pa / p;  // mole fraction
  const double compressibility =
      1 -
      p / kelvin *
          (1.58123e-6 - 2.9331e-8 * t + 1.1043e-10 * t * t + (5.707e-6 - 2.051e-8 * t) * vapour +
           (1.9898e-4 - 2.376e-6 * t) * vapour * vapour) +
      p * p / (kelvin * kelvin) * (1.83e-11 - 0.765e-8 * vapour * vapour);
  return 3.483740e-3 * p / (compressibility * kelvin) * (1 - 0.3780 * vapour);
}

double square(double x) noexcept { return x * x; }

}  // namespace

bool plausible(const Air& air) noexcept {
  return air.temperature_c >= kColdest && air.temperature_c <= kHottest && air.pressure_pa >= kLowestPressure &&
         air.pressure_pa <= kHighestPressure && air.relative_humidity >= 0 && air.relative_humidity <= 1;
}

Density density_of(const Air& air) {
  if (!plausible(air)) throw std::invalid_argument("air: temperature, pressure or humidity out of range");
  const double t = air.temperature_c, p = air.pressure_pa, h = air.relative_humidity;
  const double density = cipm_2007(t, p, h);
  // Central differences: the formula is smooth, their error is 1e-9 of the slope.
  const double per_kelvin = (cipm_2007(t + 0.01, p, h) - cipm_2007(t - 0.01, p, h)) / 0.02;
  const double per_pascal = (cipm_2007(t, p + 10, h) - cipm_2007(t, p - 10, h)) / 20;
  const double per_humidity = (cipm_2007(t, p, h + 0.001) - cipm_2007(t, p, h - 0.001)) / 0.002;
  const bool well_known = t >= 15 && t <= 27 && p >= 6e4;
  const double formula = (well_known ? 22e-6 : 1e-4) * density;
  return {density, std::sqrt(square(per_kelvin * air.u_temperature_c) + square(per_pascal * air.u_pressure_pa) +
                             square(per_humidity * air.u_relative_humidity) + square(formula))};
}

}  // namespace kphi::ambient
