#include "compensation/file/plausibility.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace kphi::compensation {
namespace {

constexpr double kMetresPerInch = 0.0254;
constexpr double kStandardDensity = 1.225;  // kg/m³, where the file does not know its air

}  // namespace

std::optional<std::string> doubt_of_thrust(ThrustCoefficient k_t, double diameter_in,
                                           std::optional<double> air_density_kg_m3) {
  if (!(diameter_in > 0)) return std::nullopt;
  const double per_turn = k_t.value() * 4 * kPi * kPi;
  const double c_t =
      per_turn / (air_density_kg_m3.value_or(kStandardDensity) * std::pow(diameter_in * kMetresPerInch, 4));
  if (c_t >= kLeastCt && c_t <= kLargestCt) return std::nullopt;
  char words[256];
  std::snprintf(words, sizeof words,
                "K_T = %.3g N/(rad/s)^2 makes C_T = %.2g of a %.3g-inch propeller, %s %g; usual is 0.05 to 0.2: check "
                "the unit of k (1 N/RPM^2 = 91.19 N/(rad/s)^2), speed and diameter",
                k_t.value(), c_t, diameter_in, c_t < kLeastCt ? "below" : "above",
                c_t < kLeastCt ? kLeastCt : kLargestCt);
  return words;
}

std::optional<std::string> doubt_of_angles(const std::vector<double>& angles_deg) {
  const auto largest = std::max_element(angles_deg.begin(), angles_deg.end());
  const bool whole =
      std::all_of(angles_deg.begin(), angles_deg.end(), [](double a) { return std::fabs(a - std::round(a)) < 1e-9; });
  if (largest == angles_deg.end() || whole || *largest > 2 * kPi + 0.01) return std::nullopt;
  char words[160];
  std::snprintf(words, sizeof words,
                "no occlusion above %.4g°: these look like radians; write degrees (%.4g rad = %.4g°)", *largest,
                *largest, to_degrees(Radians(*largest)));
  return words;
}

std::vector<std::string> doubts_of(ThrustCoefficient k_t, double diameter_in, std::optional<double> air_density_kg_m3,
                                   const std::vector<double>& angles_deg) {
  std::vector<std::string> doubts;
  for (const auto& doubt : {doubt_of_thrust(k_t, diameter_in, air_density_kg_m3), doubt_of_angles(angles_deg)})
    if (doubt) doubts.push_back(*doubt);
  return doubts;
}

std::vector<std::string> doubts_of(const Coefficients& coefficients) {
  std::vector<double> angles;
  for (const auto& row : coefficients.table) angles.push_back(to_degrees(row.occlusion));
  return doubts_of(coefficients.curve.thrust_coefficient(), coefficients.propeller.diameter_in,
                   coefficients.air_density_kg_m3, angles);
}

}  // namespace kphi::compensation
