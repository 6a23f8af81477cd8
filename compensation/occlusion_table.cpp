#include "compensation/occlusion_table.hpp"

#include <algorithm>
#include <cmath>

#include "compensation/strict_math.hpp"

namespace kphi::compensation {

bool sound(const KnotList& knots) noexcept {
  if (knots.count < 2 || knots.count > kMostKnots) return false;
  Radians before(0);
  for (std::size_t i = 0; i < knots.count; ++i) {
    const Knot knot = knots[i];
    const Real phi = knot.occlusion.value();
    if (!is_finite(phi) || !is_finite(knot.value) || is_nan(knot.standard_error) || knot.standard_error < 0)
      return false;
    if (i == 0 ? std::fabs(phi) > 0 : !(knot.occlusion > before) || phi > 2 * kPi) return false;
    before = knot.occlusion;
  }
  return true;
}

KnotList OcclusionTable::list() const noexcept {
  return {knots_.data(), count_,
          [](const void* from, std::size_t i) noexcept { return static_cast<const Knot*>(from)[i]; }};
}

std::optional<OcclusionTable> OcclusionTable::from(const Knot* knots, std::size_t count) noexcept {
  OcclusionTable table;
  if (count > kMostKnots) return std::nullopt;
  for (std::size_t i = 0; i < count; ++i) table.knots_[i] = knots[i];
  table.count_ = count;
  return sound(table.list()) ? std::optional<OcclusionTable>(table) : std::nullopt;
}

Real OcclusionTable::slope_at(Radians occlusion_angle) const noexcept { return slope(before(occlusion_angle)); }

Real OcclusionTable::standard_error_at(Radians occlusion_angle) const noexcept {
  const std::size_t i = before(occlusion_angle);
  const Real share = (occlusion_angle - knots_[i].occlusion).value() / width(i);
  const Real first = knots_[i].standard_error, change = knots_[i + 1].standard_error - first;
  const Real u = std::hypot(first + change * share, bend_error_at(occlusion_angle));
  return is_nan(u) ? std::numeric_limits<Real>::infinity() : u;  // where both knots are unknown
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
