// What an occlusion truly costs in the simulated air. None of these laws is the line that the controller flies with: it
// knows neither their form nor the factor γ.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "compensation/flight/shadow.hpp"

namespace kphi::flight {

enum class LossLaw : std::uint8_t {
  quadratic,          ///< through (0°, 1), (45°, 0.90) and (270°, 0.25), over the rim arc
  quadratic_by_load,  ///< the same over the load-weighted share of the disk
  steep_onset,        ///< 10 % within the first 15°, straight after 20°, over the rim arc
};
inline constexpr int kLossLaws = 3;

[[nodiscard]] constexpr const char* name_of(LossLaw law) noexcept {
  return law == LossLaw::quadratic           ? "quadratic"
         : law == LossLaw::quadratic_by_load ? "quadratic_by_load"
                                             : "steep_onset";
}

/// Thrust with the occlusion over thrust without; `degrees` of the measure that the law goes by.
[[nodiscard]] inline double thrust_share(LossLaw law, double degrees) noexcept {
  if (law == LossLaw::steep_onset) {
    return 1 - 0.1 * (1 - std::exp(-degrees / 15)) - 0.0026 * std::max(0.0, degrees - 20);
  }
  return 1 - degrees * (0.0021111 + 2.469e-6 * degrees);
}

/// In flight more is lost than on the bench: η = 1 − γ (1 − η_bench), held above 0.05.
[[nodiscard]] inline double thrust_share_in_flight(LossLaw law, double gamma, const Shadow& shadow, std::size_t arm,
                                                   Radians arm_angle) noexcept {
  const double covered = law == LossLaw::quadratic_by_load ? shadow.load(arm, arm_angle) : shadow.arc(arm, arm_angle);
  if (covered <= 0) return 1;
  return std::max(0.05, 1 - gamma * (1 - thrust_share(law, to_degrees(Radians(covered)))));
}

}  // namespace kphi::flight
