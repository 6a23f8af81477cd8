// The propellers of the simulated bench and their true coefficients. The controller and the fit never read this.
#pragma once

#include <array>
#include <string_view>

namespace kphi::sim {

/// One propeller on one motor. Coefficients of thrust in N/RPM², as the paper prints them.
struct PropellerTruth {
  std::string_view id;  ///< "5x3": diameter in inch, x, blades
  double diameter_in;
  int blades;
  double thrust_n_rpm2;          ///< K_T, without occlusion
  double line_intercept_n_rpm2;  ///< of the line k(φ) through the occluded points
  double line_slope_n_rpm2_deg;  ///< N/RPM² per degree, negative
  double torque_nm_rad2_s2;      ///< k_Q without occlusion, N m/(rad/s)²
  double inertia_kg_m2;          ///< of the propeller alone
};

/// Equal absolute slope per diameter, constant offset between blade counts (0.4e-8 and 0.5e-8 N/RPM²), as the paper
/// says. 5x3 passes through (45°, 0.90 K_T) and (270°, 0.25 K_T). The slope of the 6" pair is chosen so that an inch
/// more gives 1.7 to 2.2 times k at 45°, 90° and 180° for both blade counts, and k(270°) stays positive.
inline constexpr std::array<PropellerTruth, 4> kPropellers{{
    {"5x2", 5, 2, 1.3e-8, 1.351e-8, -1.7e-8 * 0.65 / 225, 1.6e-8, 3.5e-6},
    {"5x3", 5, 3, 1.7e-8, 1.751e-8, -1.7e-8 * 0.65 / 225, 1.9e-8, 5.0e-6},
    {"6x2", 6, 2, 2.6e-8, 2.683e-8, -9.35e-11, 2.4e-8, 6.5e-6},
    {"6x3", 6, 3, 3.1e-8, 3.183e-8, -9.35e-11, 2.8e-8, 9.0e-6},
}};

/// The occlusions of the paper's campaign, degrees.
inline constexpr std::array<double, 5> kOcclusionsDeg{0, 45, 90, 180, 270};

/// nullptr: no such propeller.
[[nodiscard]] const PropellerTruth* find_propeller(std::string_view id) noexcept;

/// k(φ) in N/(rad/s)²: exactly K_T at 0, the line (not below 0) for any occlusion. φ in degrees, [0, 360).
[[nodiscard]] double thrust_coefficient(const PropellerTruth& propeller, double occlusion_deg) noexcept;

/// k_Q(φ) in N m/(rad/s)²: an occlusion takes a little of the torque, 8 % at 360°.
[[nodiscard]] double torque_coefficient(const PropellerTruth& propeller, double occlusion_deg) noexcept;

}  // namespace kphi::sim
