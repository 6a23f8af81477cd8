#include "compensation/occlusion.hpp"

#include "compensation/rim_arc.hpp"

namespace kphi::compensation {

Radians occlusion_beside_body(const Airframe& airframe, HubPosition hub) noexcept {
  const Metres radius = airframe.propeller_radius;
  if (airframe.polygon) return occlusion_angle(airframe.polygon->outline, radius, hub, airframe.overlap);
  if (airframe.overlap == OverlapMeasure::rim_arc) return rim_arc(airframe.half_side, radius, hub.x, hub.y);
  return occlusion_angle(ConvexPolygon::square(airframe.half_side), radius, hub, airframe.overlap);
}

}  // namespace kphi::compensation
