// The load on the cell from every sample; a single outlier is rejected: each axis goes through a median of three, which
// delays a true value by one sample. The load of an axis is that median: a peak of two samples counts, since it strains
// the cell. Thrust and the torque about the shaft are means of
// the median over 5 ms, one turn at 12,000 RPM: the blades' beat, up to 8 % of the thrust, averages out, and noise
// shrinks sixfold at 7 kHz. A jump from a third of a limit to 1.5 times the limit is seen within 4 ms; below 200 Hz the
// window is one sample.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "results/records.hpp"

namespace kphi::daq {

/// How thrust is read off the six axes, and which way the motor turns.
struct Mounting {
  int axis = 2;   ///< 0..2 = Fx, Fy, Fz
  int sign = +1;  ///< of the axis when the propeller pulls
  int spin = +1;  ///< +1 counter-clockwise
};

class LoadWatch {
 public:
  static constexpr double kWindow = 0.005;  ///< s; at least one sample

  LoadWatch(const Mounting& mounting, const results::LoadCellScale& scale);

  void add(const results::LoadCellRecord& record) noexcept;
  /// Axis 0..5 = Fx..Tz, N or N m, unsigned, as the box shows it; 0 before the third sample.
  [[nodiscard]] double load(std::size_t axis) const noexcept;
  /// The means are known: a window has passed.
  [[nodiscard]] bool full() const noexcept { return medians_ >= sums_.size(); }
  /// N, positive when the propeller pulls; its zero included.
  [[nodiscard]] double thrust() const noexcept;
  /// N m about the thrust axis; its zero included.
  [[nodiscard]] double shaft_torque() const noexcept;

 private:
  struct Pair {
    std::int64_t thrust = 0, torque = 0;  ///< counts
  };
  Mounting mounting_;
  double counts_per_newton_, counts_per_newton_metre_;
  std::array<std::array<std::int32_t, 6>, 3> last_{};
  std::array<std::int32_t, 6> median_{};
  std::uint64_t samples_ = 0, medians_ = 0;
  std::vector<Pair> sums_;  ///< the medians of the window
  Pair total_;
};

}  // namespace kphi::daq
