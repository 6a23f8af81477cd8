#include "compensation/occlusion_table.hpp"

#include <algorithm>
#include <cmath>

namespace kphi::compensation {

std::optional<OcclusionTable> OcclusionTable::from(const Knot* knots, std::size_t count) noexcept {
  if (count < 2 || count > kMostKnots || std::fabs(knots[0].occlusion.value()) > 0) return std::nullopt;
  OcclusionTable table;
  table.count_ = count;
  for (std::size_t i = 0; i < count; ++i) {
    const Knot& knot = knots[i];
    if (!std::isfinite(knot.value) || !(knot.standard_error >= 0)) return std::nullopt;
    if (i > 0 && !(knot.occlusion > knots[i - 1].occlusion && knot.occlusion.value() <= 2 * kPi)) return std::nullopt;
    table.knots_[i] = knot;
  }
  return table;
}

std::size_t OcclusionTable::before(Radians occlusion_angle) const noexcept {
  std::size_t i = 0;
  while (i + 2 < count_ && occlusion_angle >= knots_[i + 1].occlusion) ++i;
  return i;
}

Real OcclusionTable::at(Radians occlusion_angle) const noexcept {
  const std::size_t i = before(occlusion_angle);
  return knots_[i].value + slope(i) * (occlusion_angle - knots_[i].occlusion).value();
}

Real OcclusionTable::slope_at(Radians occlusion_angle) const noexcept { return slope(before(occlusion_angle)); }

Real OcclusionTable::standard_error_at(Radians occlusion_angle) const noexcept {
  const std::size_t i = before(occlusion_angle);
  const Real share = (occlusion_angle - knots_[i].occlusion).value() / width(i);
  const Real first = knots_[i].standard_error, change = knots_[i + 1].standard_error - first;
  const Real u = std::hypot(first + change * share, bend_error_at(occlusion_angle));
  return std::isnan(u) ? std::numeric_limits<Real>::infinity() : u;  // where both knots are unknown
}

Real OcclusionTable::bend(std::size_t knot) const noexcept {
  if (knot == 0 || knot + 1 >= count_) return 0;
  return std::fabs(slope(knot) - slope(knot - 1)) * 2 / (width(knot) + width(knot - 1));
}

Real OcclusionTable::bend_error_at(Radians occlusion_angle) const noexcept {
  constexpr Real kOfHalfWidth = Real(0.5773502691896258);  // 1/sqrt(3): anywhere up to there is as likely
  const std::size_t i = before(occlusion_angle);
  const Real from = (occlusion_angle - knots_[i].occlusion).value(), to = width(i) - from;
  // A parabola leaves its chord by f'' a b/2, a and b away from its ends.
  return from > 0 && to > 0 ? kOfHalfWidth * std::max(bend(i), bend(i + 1)) * from * to / 2 : Real(0);
}

OcclusionTable OcclusionTable::moved(Real base, Real steepness) const noexcept {
  OcclusionTable result = *this;
  for (std::size_t i = 0; i < count_; ++i)
    result.knots_[i].value = base + (knots_[i].value - knots_[0].value) * steepness;
  return result;
}

}  // namespace kphi::compensation
