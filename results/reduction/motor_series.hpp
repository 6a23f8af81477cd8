// What the motor module reported in one run, by channel and time.
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "results/records.hpp"
#include "results/reduction/mean_error.hpp"

namespace kphi::results {

struct Statistics {
  std::uint64_t n = 0;
  double mean = std::numeric_limits<double>::quiet_NaN();
  double deviation = 0;
  double least = std::numeric_limits<double>::infinity();
  MeanError error;
};

/// A speed that a rotor cannot have: further than a quarter (at least 50 rad/s) from the median of itself, the two
/// readings before and the two after. A monotonous change is never one.
inline constexpr double kGlitchShare = 0.25;
inline constexpr double kGlitchSpeed = 50;  ///< rad/s

/// So many readings of a turning rotor's speed, bit for bit the same in a row and this long, are one that was repeated.
inline constexpr std::ptrdiff_t kFrozenReadings = 8;
inline constexpr double kFrozenSpeedSpan = 0.1;  ///< s

class MotorSeries {
 public:
  /// `readings`: sorted by channel, then time; must outlive the series.
  explicit MotorSeries(std::span<const MotorReading> readings);

  using Readings = std::span<const MotorReading>;

  /// Of one channel within a window; speeds without glitches.
  [[nodiscard]] Readings over(MotorChannel channel, const Window& window) const;
  /// Values times `sign`.
  [[nodiscard]] Statistics statistics(MotorChannel channel, const Window& window, double sign = 1) const;
  [[nodiscard]] std::uint64_t glitches(const Window& window) const;
  /// Its speed stands still somewhere within the window, other than at 0.
  [[nodiscard]] bool speed_frozen(const Window& window) const;

 private:
  Readings readings_;
  std::vector<MotorReading> speeds_;
  std::vector<Nanoseconds> glitches_;
};

}  // namespace kphi::results
