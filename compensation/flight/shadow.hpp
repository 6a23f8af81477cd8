// How much of a propeller's disk lies over the body, as the simulated air sees it: apart from the library's own
// geometry, by crossings and midpoints instead of intervals of cosines, so that an error in one is not in the other.
// And what that costs.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "compensation/airframe.hpp"
#include "compensation/flight/simulated_vehicle.hpp"

namespace kphi::flight {

/// Length [rad] of the circle about (x, y) that lies inside the outline. All in m.
[[nodiscard]] double covered_arc(const compensation::ConvexPolygon& outline, double radius, double x, double y);

/// 2π times the share of a T ∝ r² dr loaded disk over the outline.
[[nodiscard]] double covered_load(const compensation::ConvexPolygon& outline, double radius, double x, double y);

/// Both, of each arm over its angle or way, from a table of 2048 angles with straight lines between. Read by any number
/// of threads.
class Shadow {
 public:
  explicit Shadow(const Vehicle& vehicle);
  [[nodiscard]] double arc(std::size_t arm, Radians angle) const noexcept { return at(arc_[arm], angle.value()); }
  [[nodiscard]] double load(std::size_t arm, Radians angle) const noexcept { return at(load_[arm], angle.value()); }

 private:
  [[nodiscard]] static double at(const std::vector<double>& table, double angle) noexcept;
  Rotors<std::vector<double>> arc_, load_;
};

/// What an occlusion truly costs in the simulated air. None of these laws is the line that the controller flies with:
/// it knows neither their form nor the factor γ.
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
