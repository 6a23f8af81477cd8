#include "compensation/convex_polygon.hpp"

#include <algorithm>
#include <cmath>

#include "compensation/strict_math.hpp"

namespace kphi::compensation {
namespace {

/// Where three corners count as on one line [rad].
constexpr Real kStraight = sizeof(Real) == sizeof(double) ? Real(1e-9) : Real(1e-5);

/// A directed edge in units of the radius, the hub at the origin: points at `offset` to its right, `along` from the
/// foot.
struct Edge {
  Real offset;  ///< distance of the line from the hub, positive when the hub lies on the body's side
  Real from;
  Real to;
};

Real turn(const Position& a, const Position& b, const Position& c) noexcept {
  return (b.x - a.x).value() * (c.y - b.y).value() - (b.y - a.y).value() * (c.x - b.x).value();
}

Edge edge_between(const Position& a, const Position& b, const Position& hub, Real radius) noexcept {
  const Real ax = (a.x - hub.x).value() / radius, ay = (a.y - hub.y).value() / radius;
  const Real dx = (b.x - a.x).value() / radius, dy = (b.y - a.y).value() / radius;
  const Real length = std::hypot(dx, dy), ex = dx / length, ey = dy / length;
  const Real from = ax * ex + ay * ey;
  return {ax * ey - ay * ex, from, from + length};
}

/// The angle under which the hub sees the stretch of the edge, positive counter-clockwise.
Real subtended(Real offset, Real from, Real to) noexcept {
  return std::atan2(offset * (to - from), offset * offset + from * to);
}

/// ∮ of the measure's potential along a stretch inside the disk; a whole turn of the rim counts 2π.
Real inside_the_disk(Real offset, Real from, Real to, OverlapMeasure measure) noexcept {
  if (measure == OverlapMeasure::rim_arc) return 0;
  if (measure == OverlapMeasure::area_share) return offset * (to - from);
  // ∫ r³ dα = offset ∫ r dl, r² = offset² + l².
  const auto antiderivative = [offset](Real along) {
    const Real distance = std::hypot(offset, along);
    const Real logarithm = std::fabs(offset) > 0 ? offset * offset * std::asinh(along / std::fabs(offset)) : Real(0);
    return (along * distance + logarithm) / 2;
  };
  return offset * (antiderivative(to) - antiderivative(from));
}

}  // namespace

std::optional<ConvexPolygon> ConvexPolygon::from(const Position* corners, std::size_t count) noexcept {
  if (corners == nullptr || count < 3 || count > kMaxCorners) return std::nullopt;
  ConvexPolygon polygon;
  polygon.size_ = static_cast<std::uint32_t>(count);
  Real turned = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const Position &here = corners[i], &next = corners[(i + 1) % count], &after = corners[(i + 2) % count];
    if (!is_finite(here.x.value()) || !is_finite(here.y.value())) return std::nullopt;
    const Real cross = turn(here, next, after);
    const Real along =
        (next.x - here.x).value() * (after.x - next.x).value() + (next.y - here.y).value() * (after.y - next.y).value();
    const Real angle = std::atan2(cross, along);
    if (!(cross > 0) || !(angle > kStraight)) return std::nullopt;
    turned += angle;
    polygon.corners_[i] = here;
  }
  // A star turns left at every corner, too, but more than once round.
  if (!(turned < 3 * kPi)) return std::nullopt;
  return polygon;
}

ConvexPolygon ConvexPolygon::square(Metres half_side) noexcept {
  ConvexPolygon polygon;
  polygon.size_ = 4;
  polygon.corners_[0] = {half_side, half_side};
  polygon.corners_[1] = {-half_side, half_side};
  polygon.corners_[2] = {-half_side, -half_side};
  polygon.corners_[3] = {half_side, -half_side};
  return polygon;
}

/// Whether all of `b` is on the outer side of an edge of `a`.
static bool beside_an_edge(const ConvexPolygon& a, const ConvexPolygon& b) noexcept {
  for (std::size_t i = 0; i < a.size(); ++i) {
    bool outside = true;
    for (std::size_t j = 0; outside && j < b.size(); ++j)
      outside = !(turn(a.corner(i), a.corner((i + 1) % a.size()), b.corner(j)) > 0);
    if (outside) return true;
  }
  return false;
}

bool overlap(const ConvexPolygon& a, const ConvexPolygon& b) noexcept {
  return !beside_an_edge(a, b) && !beside_an_edge(b, a);
}

Radians occlusion_angle(const ConvexPolygon& body, Metres radius, Position hub, OverlapMeasure measure) noexcept {
  if (!(radius.value() > 0)) return Radians(0);
  Real sum = 0;
  bool apart = true, hub_inside = true;
  for (std::size_t i = 0; i < body.size(); ++i) {
    const Edge edge = edge_between(body.corner(i), body.corner((i + 1) % body.size()), hub, radius.value());
    hub_inside = hub_inside && edge.offset > 0;
    const Real chord = std::sqrt(std::max(Real(0), (1 - edge.offset) * (1 + edge.offset)));
    const Real enters = std::max(edge.from, -chord), leaves = std::min(edge.to, chord);
    if (!(enters < leaves)) {
      sum += subtended(edge.offset, edge.from, edge.to);
      continue;
    }
    apart = false;
    sum += inside_the_disk(edge.offset, enters, leaves, measure);
    if (edge.from < enters) sum += subtended(edge.offset, edge.from, enters);
    if (leaves < edge.to) sum += subtended(edge.offset, leaves, edge.to);
  }
  if (apart) return Radians(hub_inside ? 2 * kPi : Real(0));
  return Radians(sum > 0 ? std::min(sum, 2 * kPi) : Real(0));
}

}  // namespace kphi::compensation
