#include "fit/air.hpp"

#include <cmath>

namespace kphi::fit {

std::optional<AirDensity> air_of(std::span<const results::StepMean> steps) {
  if (steps.empty()) return std::nullopt;
  AirDensity mean;
  const double n = static_cast<double>(steps.size());
  for (const results::StepMean& step : steps) {
    if (!(step.air_density_kg_m3 > 0)) return std::nullopt;
    mean.kg_m3 += step.air_density_kg_m3 / n;
    mean.u_kg_m3 += (std::isnan(step.air_density_u_kg_m3) ? 0.0 : step.air_density_u_kg_m3) / n;
  }
  return mean;
}

StandardCoefficient at_standard(double k, double standard_error, const AirDensity& air) {
  const double scaled = k * (kStandardDensity / air.kg_m3);
  return {scaled, std::hypot(scaled * standard_error / k, scaled * air.u_kg_m3 / air.kg_m3)};
}

}  // namespace kphi::fit
