#include "compensation/occlusion.hpp"

#include <algorithm>
#include <cmath>

#include "compensation/strict_math.hpp"

namespace kphi::compensation {
namespace {

Real overlap(Real from, Real to, Real other_from, Real other_to) noexcept {
  return std::max(Real(0), std::min(to, other_to) - std::max(from, other_from));
}

// Beyond ±1 the rim lies wholly on one side of the edge; most edges are such, and then no library call is made.
Real clamped_acos(Real c) noexcept { return c >= 1 ? Real(0) : c <= -1 ? kPi : std::acos(c); }
Real clamped_asin(Real s) noexcept { return s >= 1 ? kPi / 2 : s <= -1 ? -kPi / 2 : std::asin(s); }

}  // namespace

Radians rim_arc(Metres half_side, Metres radius, Metres hub_x, Metres hub_y) noexcept {
  const Real a = half_side.value(), r = radius.value(), x = hub_x.value(), y = hub_y.value();
  const Real away_x = std::max(std::fabs(x) - a, Real(0));
  const Real away_y = std::max(std::fabs(y) - a, Real(0));
  if (!(away_x * away_x + away_y * away_y < r * r)) return Radians(0);

  // The square, seen from the hub in units of the radius.
  const Real per_radius = 1 / r;
  const Real left = (-a - x) * per_radius, right = (a - x) * per_radius;
  const Real bottom = (-a - y) * per_radius, top = (a - y) * per_radius;
  if (left >= 1 || right <= -1 || bottom >= 1 || top <= -1) return Radians(0);

  // cos t in [left, right] and sin t in [bottom, top], each as two intervals of t.
  const Real a1 = clamped_acos(right), a2 = clamped_acos(left);
  const Real b1 = clamped_asin(bottom), b2 = clamped_asin(top);
  // Seen from a hub beside the body one half of the rim stays empty.
  Real arc = 0;
  if (right > 0) arc += overlap(a1, a2, b1, b2) + overlap(-a2, -a1, b1, b2);
  if (left < 0) {
    arc += overlap(a1, a2, kPi - b2, kPi - b1) + overlap(2 * kPi - a2, 2 * kPi - a1, kPi - b2, kPi - b1);
  }
  return Radians(std::min(arc, 2 * kPi));
}

ContactFreeWindow contact_free_window(Metres half_side, Metres arm_length, Metres radius) noexcept {
  const Real a = half_side.value(), arm = arm_length.value(), r = radius.value();
  if (!(arm > r)) return {Radians(1), Radians(-1)};
  if (arm - 2 * a >= r) return {Radians(-kPi / 2), Radians(kPi)};
  const Real cos_at_corner = (r * r - 4 * a * a - arm * arm) / (4 * a * arm);
  const bool corner_first = cos_at_corner >= -1 && a + arm * cos_at_corner <= -a;
  const Real contact = corner_first ? std::acos(cos_at_corner) : kPi - std::asin(r / arm);
  return {Radians(kPi / 2 - contact), Radians(contact)};
}

Radians occlusion_beside_body(const Airframe& airframe, std::size_t rotor, HubPosition hub) noexcept {
  const Metres radius = radius_of(airframe, rotor);
  if (airframe.polygon) {
    Radians phi = occlusion_angle(airframe.polygon->outline, radius, hub, airframe.overlap);
    for (const auto& part : airframe.polygon->more) {
      if (part) phi = phi + occlusion_angle(*part, radius, hub, airframe.overlap);
    }
    return Radians(std::min(phi.value(), 2 * kPi));
  }
  if (airframe.overlap == OverlapMeasure::rim_arc) return rim_arc(airframe.half_side, radius, hub.x, hub.y);
  return occlusion_angle(ConvexPolygon::square(airframe.half_side), radius, hub, airframe.overlap);
}

}  // namespace kphi::compensation
