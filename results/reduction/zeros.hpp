// Zeros of a run: the load cell at standstill before and after it, interpolated in between. The box's own bias is
// separate: it is recorded with the run and does not change the stored counts.
#pragma once

#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "results/records.hpp"
#include "results/reduction/bin_statistics.hpp"
#include "results/reduction/cell_stream.hpp"
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

/// Check of the zeros of a run, N.
struct ZeroCheck {
  double moved_n = 0;      ///< from before to after; NaN if one is missing or the box restarted in between
  double tolerated_n = 0;  ///< limit of moved_n
  double deviation_n = 0;  ///< of the samples, the larger one
  bool only_one = false;   ///< in a finished run, of one power-up: the movement is unknown
  double u_n = 0;          ///< standard uncertainty of a zero, the larger one; NaN: zero too short
  [[nodiscard]] bool drifted() const;
  /// The samples scatter too much, or the mean is less certain than half of the limit of movement.
  [[nodiscard]] bool noisy() const;
  /// Causes and next moves, one line each; empty: the zeros are good.
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
  double u = 0;        ///< of the force, standard (science.md, eq. 7); excludes deviations from a linear drift
  double freedom = 0;  ///< degrees of freedom of u
};

class Zeros {
 public:
  /// Means of zero_before and zero_after, the latter without its beginning and only at standstill. Their uncertainty is
  /// about a line, since the linear drift is subtracted.
  Zeros(const RunRecording& run, const CellStream& cell, const MotorSeries& motor);

  [[nodiscard]] bool empty() const { return !zeros_[0]; }
  /// Power-up of the first zero; steps of any other one are flagged.
  [[nodiscard]] std::size_t boot() const { return zeros_[0]->boot; }
  /// Linear in time between the two; a single one is constant. After a restart of the box, the zero of that power-up if
  /// there is one.
  [[nodiscard]] ZeroThen at(double time, std::size_t boot) const;
  /// Force of at().
  [[nodiscard]] double force_at(double time, std::size_t boot) const;
  /// Counts from before to after; NaN: unknown.
  [[nodiscard]] double movement() const;
  [[nodiscard]] double largest_deviation() const;
  [[nodiscard]] double largest_u() const;

 private:
  void add(const Zero& zero) { (zeros_[0] ? zeros_[1] : zeros_[0]) = zero; }
  /// The one zero that applies to a power-up; nullptr: both do.
  [[nodiscard]] const Zero* only(std::size_t boot) const;
  [[nodiscard]] double share(double time) const {
    return (time - zeros_[0]->time) / (zeros_[1]->time - zeros_[0]->time);
  }
  std::array<std::optional<Zero>, 2> zeros_;
};

}  // namespace kphi::results
