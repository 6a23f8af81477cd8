// The thrusts, within the rotors' limits, that meet several demands in order of priority: none may make an earlier one
// worse.
// Bounded least squares, one demand after the other, by an active set: along what the demands before leave free, from
// limit to limit.
//
// Real-time: no allocation, no lock; the steps are counted and bounded.
#pragma once

#include <cstddef>

#include "compensation/rotors.hpp"
#include "compensation/units.hpp"

namespace kphi::compensation {

/// What one demand weighs the thrusts with, a number for each rotor: the demand is about their sum of products.
using Row = Rotors<Real>;

[[nodiscard]] inline Real dot(const Row& a, const Row& b) noexcept {
  Real sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
  return sum;
}

struct Range {
  Real low;
  Real high;
};

/// Begins at thrusts within the limits, and changes them by one demand after the other.
class WithinLimits {
 public:
  /// `low` <= `high` in every rotor.
  struct Limits {
    Row low, high;
  };
  /// `start` is cut to the limits.
  WithinLimits(const Limits& limits, const Row& start) noexcept;

  enum class Keep { as_it_is, within };
  /// row·f comes as near to `wanted` as can be. From now on it stays there; with Keep::within it may move within
  /// `wanted` if it has reached it, which is for one row alone: the last one.
  void reach(const Row& row, Range wanted, Keep keep = Keep::as_it_is) noexcept;
  /// (a·f, b·f) comes as near to (wanted_a, wanted_b) as can be, in the sum of squares. From now on it stays there.
  void reach(const Row& a, const Row& b, Real wanted_a, Real wanted_b) noexcept;

  [[nodiscard]] const Row& thrusts() const noexcept { return thrusts_; }
  /// So far, of all demands.
  [[nodiscard]] int steps() const noexcept { return steps_; }
  /// Per demand; a demand that takes more is left as near as it has come.
  [[nodiscard]] static constexpr int most_steps(std::size_t rotors) noexcept { return 6 * static_cast<int>(rotors); }

 private:
  static constexpr std::size_t kMostKept = 3;
  /// What must not change, made orthogonal to each other over the free rotors.
  struct Basis {
    Row rows[kMostKept + 1];
    std::size_t size = 0;
    bool ends_with_bounded = false;
  };

  [[nodiscard]] Basis basis() const noexcept;
  /// From row·f to what of `wanted` is nearest.
  [[nodiscard]] Real missing(const Row& row, Range wanted) const noexcept;
  /// As near to both as can be, in the sum of squares; changes nothing of what is kept.
  void go_towards(const Row& a, const Row& b, Range wanted_a, Real wanted_b) noexcept;
  /// Over the free rotors.
  [[nodiscard]] Real free_dot(const Row& a, const Row& b) const noexcept;
  /// `row` without what `basis` holds: over the free rotors the way to go, over the others what to gain by freeing
  /// them.
  [[nodiscard]] Row reduced(Row row, const Basis& basis) const noexcept;
  /// Goes `share` of the way along `way`, or to the first limit, which then holds.
  void go(const Row& way, Real share) noexcept;
  /// Lets go of the limit that holds back the most: `gain` is what is left of `wish`. False: no limit holds back more
  /// than `least`.
  [[nodiscard]] bool let_go(const Row& gain, const Row& wish, const Basis& basis, Real least) noexcept;

  Row low_, high_, thrusts_;
  bool free_[kMostRotors] = {};
  Row kept_[kMostKept];
  std::size_t kept_count_ = 0;
  Row bounded_;
  Range bounds_{0, 0};
  bool bounded_counts_ = false;
  int at_bound_ = 0;  ///< −1: at the lower, 1: at the upper
  int steps_ = 0;
};

}  // namespace kphi::compensation
