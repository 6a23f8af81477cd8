// What a coefficient file or a campaign says that no such propeller and no such stand would: mostly a unit mixed up.
// One line each, with the number, what is usual, and the next move; nothing is refused for it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "compensation/file/coefficient_file.hpp"

namespace kphi::compensation {

/// C_T = T/(ρ n² D⁴), n in turns per second, of open propellers at rest (UIUC: 0.05 to 0.2), with room on both sides.
inline constexpr double kLeastCt = 0.02, kLargestCt = 0.4;

/// Of a propeller without occlusion. nullopt: usual, or the diameter is not known.
[[nodiscard]] std::optional<std::string> doubt_of_thrust(ThrustCoefficient k_t, double diameter_in,
                                                         std::optional<double> air_density_kg_m3);

/// Occlusions in degrees that look like radians: none above 2π, and not whole.
[[nodiscard]] std::optional<std::string> doubt_of_angles(const std::vector<double>& angles_deg);

[[nodiscard]] std::vector<std::string> doubts_of(ThrustCoefficient k_t, double diameter_in,
                                                 std::optional<double> air_density_kg_m3,
                                                 const std::vector<double>& angles_deg);
[[nodiscard]] std::vector<std::string> doubts_of(const Coefficients& coefficients);

}  // namespace kphi::compensation
