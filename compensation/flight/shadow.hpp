// How much of a propeller's disk lies over the body, as the simulated air sees it: apart from the library's own
// geometry, by crossings and midpoints instead of intervals of cosines, so that an error in one is not in the other.
#pragma once

#include <vector>

#include "compensation/airframe.hpp"

namespace kphi::flight {

/// Length [rad] of the circle about (x, y) that lies inside the square |x|, |y| <= half_side. All in m.
[[nodiscard]] double covered_arc(double half_side, double radius, double x, double y);

/// 2π times the share of a T ∝ r² dr loaded disk over the square.
[[nodiscard]] double covered_load(double half_side, double radius, double x, double y);

/// Both, over the arm angle, from a table of 2048 angles with straight lines between. Read by any number of threads.
class Shadow {
 public:
  explicit Shadow(const compensation::Airframe& airframe);
  [[nodiscard]] double arc(Radians arm_angle) const noexcept { return at(arc_, arm_angle.value()); }
  [[nodiscard]] double load(Radians arm_angle) const noexcept { return at(load_, arm_angle.value()); }

 private:
  [[nodiscard]] static double at(const std::vector<double>& table, double angle) noexcept;
  std::vector<double> arc_;
  std::vector<double> load_;
};

}  // namespace kphi::flight
