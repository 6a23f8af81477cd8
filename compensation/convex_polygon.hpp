// A body seen from above: a convex polygon, and how much of a propeller's disk lies over it.
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "compensation/overlap_measure.hpp"
#include "compensation/units.hpp"

namespace kphi::compensation {

/// A point of the body frame [m], x forward, y left.
struct Position {
  Metres x;
  Metres y;
};

/// Corners in counter-clockwise order, every one of them a left turn. A ConvexPolygon that exists is valid.
class ConvexPolygon {
 public:
  static constexpr std::size_t kMaxCorners = 12;

  /// Nothing unless there are 3 to kMaxCorners corners, finite, counter-clockwise, going round once, none of them on
  /// the line of its neighbours.
  [[nodiscard]] static std::optional<ConvexPolygon> from(const Position* corners, std::size_t count) noexcept;
  /// |x|, |y| <= half_side, which must be positive.
  [[nodiscard]] static ConvexPolygon square(Metres half_side) noexcept;

  /// How many corners, 3 to kMaxCorners.
  [[nodiscard]] std::size_t size() const noexcept { return size_; }
  /// Corner 0 to size() − 1 [m].
  [[nodiscard]] const Position& corner(std::size_t i) const noexcept { return corners_[i]; }

 private:
  ConvexPolygon() noexcept = default;
  std::array<Position, kMaxCorners> corners_{};
  std::size_t size_ = 0;
};

/// The occlusion angle φ, in [0, 2π] rad, of the disk (hub [m], radius [m]) over the body, in any measure:
///   rim_arc     length of the rim inside the body, in radians of the rim,
///   area_share  2 × overlap/radius²,
///   load_share  3/radius³ × ∫ r dA over the overlap, r from the hub.
/// Exactly 0 where the disk does not reach the body, 2π where the body covers all of it. By Green's theorem, edge by
/// edge: what lies outside the disk counts with the angle it subtends, what lies inside with its own integral. Never
/// NaN: where an argument is NaN or the radius not positive the answer is 0.
[[nodiscard]] Radians occlusion_angle(const ConvexPolygon& body, Metres radius, Position hub,
                                      OverlapMeasure measure) noexcept;

}  // namespace kphi::compensation
