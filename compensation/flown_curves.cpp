#include "compensation/flown_curves.hpp"

#include <algorithm>
#include <cmath>

#include "compensation/strict_math.hpp"

namespace kphi::compensation {

bool FlownCurves::place(const KnotList& knots, Piece& piece) noexcept {
  const auto same_at = [&](std::size_t first) {
    for (std::size_t i = 0; i < knots.count; ++i) {
      const Knot knot = knots[i];
      const Real further = (knot.occlusion - knots_[first + i].occlusion).value(),
                 more = knot.value - knots_[first + i].value;
      if (std::fabs(further) > 0 || std::fabs(more) > 0) return false;
    }
    return true;
  };
  std::size_t first = 0;
  while (first + knots.count <= knot_count_ && !same_at(first)) ++first;
  if (first + knots.count > knot_count_) {
    first = knot_count_;
    if (first + knots.count > kMostKnots) return false;
    for (std::size_t i = 0; i < knots.count; ++i) knots_[first + i] = {knots[i].occlusion, knots[i].value};
    knot_count_ = static_cast<std::uint8_t>(first + knots.count);
  }
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
