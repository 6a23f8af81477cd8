// A quantity over φ that is known at knots and straight between them: k(φ) of a propeller that follows no line, or its
// drag torque.
#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <optional>

#include "compensation/units.hpp"

namespace kphi::compensation {

struct Knot {
  Radians occlusion;
  Real value = 0;
  Real standard_error = std::numeric_limits<Real>::infinity();  ///< +∞: unknown
};

inline constexpr std::size_t kMostKnots = 12;

/// Knots wherever they are, and whatever their type is there.
struct KnotList {
  const void* from = nullptr;
  std::size_t count = 0;
  Knot (*at)(const void* from, std::size_t i) = nullptr;
  [[nodiscard]] Knot operator[](std::size_t i) const noexcept { return at(from, i); }
};

/// Whether they can be a table: 2 to kMostKnots, the first at φ = 0, ascending up to 2π, with finite values and
/// standard errors that are not negative.
[[nodiscard]] bool sound(const KnotList& knots) noexcept;

/// Index of the knot before φ, with another one after it.
template <class AnyKnot>
[[nodiscard]] std::size_t knot_before(const AnyKnot* knots, std::size_t count, Radians occlusion_angle) noexcept {
  std::size_t i = 0;
  while (i + 2 < count && occlusion_angle >= knots[i + 1].occlusion) ++i;
  return i;
}

/// Straight between knots, of which there are two at least; beyond the last as between the last two.
template <class AnyKnot>
[[nodiscard]] Real value_between(const AnyKnot* knots, std::size_t count, Radians occlusion_angle) noexcept {
  const AnyKnot* const knot = knots + knot_before(knots, count, occlusion_angle);
  const Real slope = (knot[1].value - knot[0].value) / (knot[1].occlusion - knot[0].occlusion).value();
  return knot->value + slope * (occlusion_angle - knot->occlusion).value();
}

/// Plain data, of the same size for any number of knots.
class OcclusionTable {
 public:
  /// Without knots; then only empty(), begin() and end() may be asked.
  OcclusionTable() noexcept = default;
  /// nullopt unless the knots are sound().
  [[nodiscard]] static std::optional<OcclusionTable> from(const Knot* knots, std::size_t count) noexcept;

  [[nodiscard]] bool empty() const noexcept { return count_ == 0; }
  [[nodiscard]] const Knot* begin() const noexcept { return knots_.data(); }
  [[nodiscard]] const Knot* end() const noexcept { return knots_.data() + count_; }
  /// Of this table, as long as it lives.
  [[nodiscard]] KnotList list() const noexcept;

  /// Beyond the last knot as between the last two.
  [[nodiscard]] Real at(Radians occlusion_angle) const noexcept {
    return value_between(knots_.data(), count_, occlusion_angle);
  }
  /// Of the straight piece there [1/rad].
  [[nodiscard]] Real slope_at(Radians occlusion_angle) const noexcept;
  /// Standard uncertainty of at(): that of the knots, taken to be wrong together, which is the most it can be; and
  /// between two of them how far the truth may bend away, by the change of slope that the neighbours show. +∞ if
  /// unknown.
  [[nodiscard]] Real standard_error_at(Radians occlusion_angle) const noexcept;
  /// The second part of it alone: 0 at the knots and beyond the last.
  [[nodiscard]] Real bend_error_at(Radians occlusion_angle) const noexcept;
  /// Every value moved: `base` + (value − first value) times `steepness`.
  [[nodiscard]] OcclusionTable moved(Real base, Real steepness) const noexcept;

 private:
  [[nodiscard]] std::size_t before(Radians occlusion_angle) const noexcept {
    return knot_before(knots_.data(), count_, occlusion_angle);
  }
  [[nodiscard]] Real width(std::size_t piece) const noexcept {
    return (knots_[piece + 1].occlusion - knots_[piece].occlusion).value();
  }
  [[nodiscard]] Real slope(std::size_t piece) const noexcept {
    return (knots_[piece + 1].value - knots_[piece].value) / width(piece);
  }
  /// Second derivative at a knot [1/rad²], without its sign; 0 at the ends.
  [[nodiscard]] Real bend(std::size_t knot) const noexcept;

  std::array<Knot, kMostKnots> knots_{};
  std::size_t count_ = 0;
};

}  // namespace kphi::compensation
