// Readings of the motor module in one run, by channel and time.
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "results/records.hpp"
#include "results/reduction/bin_statistics.hpp"

namespace kphi::results {

struct Statistics {
  std::uint64_t n = 0;
  double mean = std::numeric_limits<double>::quiet_NaN();
  double deviation = 0;
  double least = std::numeric_limits<double>::infinity();
  MeanError error;
};

/// A speed that a rotor cannot have: further than a quarter (at least 50 rad/s) from the median of itself, the two
/// readings before and the two after. A monotonous change never is.
inline constexpr double kGlitchShare = 0.25;
inline constexpr double kGlitchSpeed = 50;  ///< rad/s

/// This many consecutive readings of a turning rotor, bit for bit the same over this span, are a repeated reading.
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
  /// True if a nonzero speed is repeated (kFrozenReadings) somewhere within the window.
  [[nodiscard]] bool speed_frozen(const Window& window) const;

 private:
  Readings readings_;
  std::vector<MotorReading> speeds_;
  std::vector<Nanoseconds> glitches_;
};

}  // namespace kphi::results
