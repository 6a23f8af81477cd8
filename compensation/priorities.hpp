// The thrusts, within the rotors' limits, that meet several demands in order of priority: none may make an earlier one
// worse. Roll and pitch come as near as can be by geometry: all that the rotors can make of the two is a polygon with
// two edges for each rotor, and the nearest point of it is found without a search. Thrust and yaw follow one after the
// other by the simplex method for bounded variables, on a dictionary of four rows; where more than four rotors leave a
// choice it goes towards the smallest thrusts.
//
// Real-time: no allocation, no lock; the steps are counted and bounded.
#pragma once

#include <cstddef>
#include <cstdint>

#include "compensation/rotors.hpp"
#include "compensation/units.hpp"

namespace kphi::compensation {

/// A number for each rotor. Unlike Rotors, of no value before it has one: the mixer has many of them.
struct Row {
  Row() noexcept = default;
  explicit Row(std::size_t count) noexcept : count_(static_cast<std::uint32_t>(count)) {}
  [[nodiscard]] std::size_t size() const noexcept { return count_; }
  [[nodiscard]] Real& operator[](std::size_t i) noexcept { return values_[i]; }
  [[nodiscard]] const Real& operator[](std::size_t i) const noexcept { return values_[i]; }
  [[nodiscard]] const Real* begin() const noexcept { return values_; }
  [[nodiscard]] const Real* end() const noexcept { return values_ + count_; }

 private:
  Real values_[kMostRotors];
  std::uint32_t count_ = 0;
};

[[nodiscard]] inline Real dot(const Row& a, const Row& b) noexcept {
  Real sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
  return sum;
}

struct Range {
  Real low;
  Real high;
};

class WithinLimits {
 public:
  /// `low` <= `high` in every rotor, none above 1e9 N.
  struct Limits {
    Row low, high;
  };
  enum class Goal : std::uint8_t { roll, pitch, thrust, yaw };

  struct Sizes {
    Real reach;    ///< the largest of all x and y [m]
    Real yaw_arm;  ///< about the largest arm passed to set_yaw() [m]; 0: no yaw
  };

  /// Begins at `start`, cut to the limits, which must live as long as this and are narrowed by it. The rotors are at
  /// (`x`, `y`) [m], roll = y·f, pitch = −x·f. Yaw counts from set_yaw() on.
  WithinLimits(Limits& limits, const Row& start, const Row& x, const Row& y, Sizes sizes) noexcept;

  /// (roll, pitch) come as near to these [N m] as can be, in the sum of squares, and stay there.
  void reach_roll_pitch(Real roll, Real pitch) noexcept;
  /// From here on yaw changes with the thrusts by `arms` [m]; it is `now` [N m]. Thrust and yaw are free again.
  void set_yaw(const Row& arms, Real now) noexcept;
  /// Changes the thrusts so that yaw, told by its arms to be where it should, is further by `off` [N m] while all that
  /// was reached stays. False if yaw is free, or as near as can be.
  bool correct_yaw(Real off) noexcept;
  /// Thrust [N] or yaw [N m] comes as near to `wanted` as can be. It stays there, or within `wanted` if it is reached.
  void reach(Goal goal, Range wanted) noexcept;
  /// Towards the smallest of the thrusts that do the same, in the sum of squares.
  void ease() noexcept;

  /// Into `result`, which has as many rotors.
  void thrusts(Row& result) const noexcept;
  /// By the arms of set_yaw() [N m].
  [[nodiscard]] Real yaw() const noexcept { return values_[index(Goal::yaw)] * sizes_.yaw_arm; }
  /// Of the search so far; its beginning is one.
  [[nodiscard]] int steps() const noexcept { return steps_; }
  /// Whether a search ended at its bound of steps: a goal may come nearer than it is, or the thrusts be smaller.
  [[nodiscard]] bool cut_short() const noexcept { return cut_short_; }
  /// For one goal.
  static constexpr int kMostSteps = 24;

 private:
  // A variable is a rotor's thrust (0 to 7) or a goal (8 to 11), in newtons: torques by sizes_. The
  // variables of the rows are told by those of the columns: value = sum of entry times value.
  static constexpr std::size_t kGoals = 4, kVariables = kMostRotors + kGoals;
  struct Move {
    std::size_t column, blocking;
    Real by;
  };

  [[nodiscard]] static constexpr std::size_t index(Goal goal) noexcept {
    return kMostRotors + static_cast<std::size_t>(goal);
  }
  [[nodiscard]] Real room(std::size_t variable, bool upwards) const noexcept {
    return upwards ? high_[variable] - values_[variable] : values_[variable] - low_[variable];
  }
  [[nodiscard]] bool fixed(std::size_t variable) const noexcept { return !(low_[variable] < high_[variable]); }
  void fix(std::size_t variable) noexcept { low_[variable] = high_[variable] = values_[variable]; }
  /// If the rotors cannot make this roll and pitch, moves it to the nearest that they can and fixes those whose limits
  /// make it. Whether roll changes more than pitch along the edge there.
  inline bool cut_to_polygon(Real (&point)[2]) noexcept;
  /// Leaves out the rows and columns that will not change any more.
  inline void forget_fixed() noexcept;
  void approach(std::size_t goal, Range wanted) noexcept;
  /// The column that moves `row` by `need` the fastest; columns_count_ if none can.
  [[nodiscard]] inline std::size_t entering(std::size_t row, Real need, bool careful) const noexcept;
  /// How far until the variable, which changes by `change` of it, is at its limit.
  [[nodiscard]] Real distance(std::size_t variable, Real change) const noexcept;
  /// The first row whose limit a move of this column by `by` meets, which it cuts; kGoals if none.
  [[nodiscard]] std::size_t blocking(std::size_t column, Real& by, std::size_t but, bool careful) const noexcept;
  void move(std::size_t column, Real by) noexcept;
  void put_at_limit(std::size_t variable, bool upper) noexcept {
    values_[variable] = upper ? high_[variable] : low_[variable];
  }
  /// The variables of this row and this column change places.
  void pivot(std::size_t row, std::size_t column) noexcept;
  /// Of a goal that can still change, made a row if it was a column; kGoals if it cannot.
  [[nodiscard]] std::size_t row_of(std::size_t goal) noexcept;
  /// Makes the variable of this row a column. False if none can take its place.
  bool exchange(std::size_t row) noexcept;

  Limits& limits_;  // as roll and pitch leave them
  std::size_t rotors_, columns_count_, rows_count_ = 3;
  Real values_[kVariables] = {}, low_[kVariables], high_[kVariables];
  Real entries_[kGoals][kMostRotors];
  std::uint8_t variables_[kVariables];  // of the rows and, from kGoals on, of the columns
  Sizes sizes_;
  Real nothing_;  // a change of thrust that is rounding [N]
  int steps_ = 1;
  bool cut_short_ = false;
};

}  // namespace kphi::compensation
