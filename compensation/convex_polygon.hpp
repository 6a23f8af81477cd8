// A body seen from above: a convex polygon, and how much of a propeller's disk lies over it, as one angle φ. On the
// bench's sector plates all three measures of φ agree; over a body they differ by tens of degrees, so a curve must be
// flown with the measure it was fitted with.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

#include "compensation/units.hpp"

namespace kphi::compensation {

enum class OverlapMeasure : std::uint8_t {
  rim_arc,     ///< arc of the rim over the body (the paper's "near the tips")
  area_share,  ///< 2π × share of the disk's area over the body
  load_share,  ///< 2π × share over the body of a disk whose thrust per ring grows like r² dr
};

struct OverlapMeasureName {
  OverlapMeasure measure;
  std::string_view name;  ///< as in coefficient and vehicle files
};
inline constexpr std::array<OverlapMeasureName, 3> kOverlapMeasureNames{{{OverlapMeasure::rim_arc, "rim_arc"},
                                                                         {OverlapMeasure::area_share, "area_share"},
                                                                         {OverlapMeasure::load_share, "load_share"}}};

/// "unknown" for any other value.
[[nodiscard]] constexpr std::string_view name_of(OverlapMeasure measure) noexcept {
  for (const OverlapMeasureName& entry : kOverlapMeasureNames) {
    if (entry.measure == measure) return entry.name;
  }
  return "unknown";
}

[[nodiscard]] constexpr std::optional<OverlapMeasure> overlap_measure_named(std::string_view name) noexcept {
  for (const OverlapMeasureName& entry : kOverlapMeasureNames) {
    if (entry.name == name) return entry.measure;
  }
  return std::nullopt;
}

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
  std::uint32_t size_ = 0;
};

/// Whether they have an area in common: more than an edge.
[[nodiscard]] bool overlap(const ConvexPolygon& a, const ConvexPolygon& b) noexcept;

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
