// The zeros of a run: what the load cell said while the motor stood, before and after, and what lies between.
// Apart from the box's own bias, which is recorded with the run and changes no count that is stored.
#pragma once

#include <algorithm>
#include <array>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "results/records.hpp"
#include "results/reduction/cell_stream.hpp"
#include "results/reduction/mean_error.hpp"
#include "results/reduction/motor_series.hpp"

namespace kphi::results {

/// Deviation of one unfiltered record of the cell at rest.
inline constexpr double kRestForce = 0.03;     ///< N
inline constexpr double kRestTorque = 0.0009;  ///< N m

/// Deviation of one record above which the cell was not at rest while its zero was taken, N.
inline constexpr double kNoisyZero = 5 * kRestForce;

inline constexpr const char* kZeroNextMove = "let the stand come to rest, keep hands and wind off, and try again";

/// How far the zeros before and after a run may differ, N.
[[nodiscard]] inline double tolerated_drift(double largest_thrust_n) {
  return std::max(0.005 * largest_thrust_n, 0.02);
}

/// What the zeros of a run say of its thrust, N.
struct ZeroCheck {
  double moved_n = 0;      ///< from before to after; NaN with one of them only, or when the box started anew between
  double tolerated_n = 0;  ///< of moved_n
  double deviation_n = 0;  ///< of the samples, the larger one
  bool only_one = false;   ///< of one power-up, in a run that was finished: nobody knows how far it moved
  double u_n = 0;          ///< standard uncertainty of a zero, the larger one; NaN: too short to tell
  [[nodiscard]] bool drifted() const;
  /// Its samples scatter, or its mean is less certain than half of what it may move.
  [[nodiscard]] bool noisy() const;
  /// Why it is refused and what to do, one line each; empty when it is good.
  [[nodiscard]] std::vector<std::string> reasons() const;
};

/// One zero, counts.
struct Zero {
  double time = 0;  ///< ns, centre of its window
  MeanError force;
  double torque = 0;
  double force_deviation = 0;
  std::size_t boot = 0;  ///< a zero holds for one power-up of the box
};

/// The zero at some time of the run, counts.
struct ZeroThen {
  double force = 0;
  double torque = 0;
  double u = 0;        ///< of the force, standard; without how far from a line it moved
  double freedom = 0;  ///< degrees of freedom of u
};

class Zeros {
 public:
  /// Means of zero_before and of zero_after, the latter without its beginning, and only once the motor stands. Their
  /// uncertainty is about a line: what they drift is subtracted, not unknown.
  Zeros(const RunRecording& run, const CellStream& cell, const MotorSeries& motor);

  [[nodiscard]] bool empty() const { return !zeros_[0]; }
  [[nodiscard]] bool both() const { return zeros_[1].has_value(); }
  /// Power-up of the first zero: the only one without a flag.
  [[nodiscard]] std::size_t boot() const { return zeros_[0]->boot; }
  /// Linear in time between the two; with one of them only, that one. Of another power-up, its own if there is one.
  [[nodiscard]] ZeroThen at(double time, std::size_t boot) const;
  /// Of the same, the force alone.
  [[nodiscard]] double force_at(double time, std::size_t boot) const;
  /// Counts from before to after; NaN when nobody can tell.
  [[nodiscard]] double movement() const;
  [[nodiscard]] double largest_deviation() const;
  [[nodiscard]] double largest_u() const;

 private:
  void add(const Zero& zero) { (zeros_[0] ? zeros_[1] : zeros_[0]) = zero; }
  /// The only one that holds for a power-up; nullptr: both do.
  [[nodiscard]] const Zero* only(std::size_t boot) const;
  [[nodiscard]] double share(double time) const {
    return (time - zeros_[0]->time) / (zeros_[1]->time - zeros_[0]->time);
  }
  std::array<std::optional<Zero>, 2> zeros_;
};

}  // namespace kphi::results
