// How much of a propeller's disk lies over the body, as the simulated air sees it: apart from the library's own
// geometry, by crossings and midpoints instead of intervals of cosines, so that an error in one is not in the other.
#pragma once

#include <array>
#include <vector>

#include "compensation/airframe.hpp"

namespace kphi::flight {

/// Length [rad] of the circle about (x, y) that lies inside the outline. All in m.
[[nodiscard]] double covered_arc(const compensation::ConvexPolygon& outline, double radius, double x, double y);

/// 2π times the share of a T ∝ r² dr loaded disk over the outline.
[[nodiscard]] double covered_load(const compensation::ConvexPolygon& outline, double radius, double x, double y);

/// Both, of each arm over its angle, from a table of 2048 angles with straight lines between. Read by any number of
/// threads.
class Shadow {
 public:
  explicit Shadow(const compensation::Airframe& airframe);
  [[nodiscard]] double arc(std::size_t arm, Radians angle) const noexcept { return at(arc_[arm], angle.value()); }
  [[nodiscard]] double load(std::size_t arm, Radians angle) const noexcept { return at(load_[arm], angle.value()); }

 private:
  [[nodiscard]] static double at(const std::vector<double>& table, double angle) noexcept;
  std::array<std::vector<double>, 4> arc_;
  std::array<std::vector<double>, 4> load_;
};

}  // namespace kphi::flight
