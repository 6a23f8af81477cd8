#include "compensation/flown_curves.hpp"

#include <cmath>

#include "compensation/strict_math.hpp"

namespace kphi::compensation {

bool FlownCurves::place(const KnotList& knots, Piece& piece) noexcept {
  // The first place where they are, or where they may go on beyond the last that is known.
  std::size_t first = 0, same = 0;
  while (same < knots.count && first + same < kMostKnots) {
    const Knot knot = knots[same];
    FlownKnot& here = knots_[first + same];
    if (first + same >= knot_count_) here = {knot.occlusion, knot.value};
    if (!(std::fabs((here.occlusion - knot.occlusion).value()) + std::fabs(here.value - knot.value) > 0)) {
      ++same;
    } else {
      ++first;
      same = 0;
    }
  }
  if (same < knots.count) return false;
  if (first + same > knot_count_) knot_count_ = static_cast<std::uint8_t>(first + same);
  piece = {static_cast<std::uint8_t>(first), static_cast<std::uint8_t>(knots.count)};
  return true;
}

bool FlownCurves::add(const CurveParts& curve) noexcept {
  const std::size_t count = curves_.size();
  if (count == kMostRotors) return false;
  Curve flown{curve.thrust_coefficient.value(),
              curve.intercept.value(),
              curve.slope_per_rad,
              curve.largest_fitted,
              curve.speed_trend,
              {},
              {}};
  const std::uint8_t before = knot_count_;
  if (!place(curve.k, flown.k) || !place(curve.torque, flown.torque)) {
    knot_count_ = before;
    return false;
  }
  curves_.add(flown);
  return true;
}

Real FlownCurves::k_at(std::size_t rotor, Radians occlusion_angle) const noexcept {
  const Curve& curve = curves_[rotor];
  if (curve.k.count > 0) return value_between(knots_ + curve.k.first, curve.k.count, occlusion_angle);
  return curve.intercept + curve.slope_per_rad * occlusion_angle.value();
}

Real FlownCurves::torque_share_at(std::size_t rotor, Radians occlusion_angle) const noexcept {
  const Piece& torque = curves_[rotor].torque;
  return torque.count == 0 ? Real(1)
                           : held_torque_share(value_between(knots_ + torque.first, torque.count, occlusion_angle));
}

}  // namespace kphi::compensation
