// How much the stand shakes: what scatters about the mean of each axis, and how much of the thrust beats with the
// blades. Shown, never judged.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>

namespace kphi::daq {

/// Of the newest whole window; not a number before the first.
struct Vibration {
  static constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  std::array<double, 6> rms{kNone, kNone, kNone, kNone, kNone, kNone};  ///< N and N m, noise of the cell included
  double blade_pass_hz = kNone;  ///< blades · speed / 2π; not a number for unknown blades, or beyond 0.45 of the rate
  double blade_pass_n = kNone;   ///< amplitude of the thrust axis there
};

/// Windows of half a second: a line is 2 Hz wide. One thread.
class VibrationMeter {
 public:
  static constexpr double kWindow = 0.5;  ///< s

  /// `axis` 0..2 of the thrust; `blades` 0: unknown.
  VibrationMeter(int axis, int blades, double sample_rate_hz, double counts_per_newton, double counts_per_newton_metre);

  /// The rotor turns with `speed_rad_s` now. True: a window is complete.
  bool add(const std::array<std::int32_t, 6>& counts, double speed_rad_s) noexcept;
  [[nodiscard]] const Vibration& newest() const noexcept { return newest_; }

 private:
  void begin(const std::array<std::int32_t, 6>& counts, double speed_rad_s) noexcept;
  void end() noexcept;

  const std::size_t axis_;
  const int blades_;
  const double rate_hz_;
  const std::array<double, 2> scale_;  ///< counts per N and per N m
  const std::size_t window_;           ///< samples
  std::size_t n_ = 0;
  std::array<std::int32_t, 6> first_{};
  std::array<double, 6> sum_{}, squares_{};                     ///< of what differs from the first, counts
  double line_hz_ = 0;                                          ///< 0: none in this window
  double turn_[2]{}, phase_[2]{}, found_[2]{}, constant_[2]{};  ///< cosine and sine
  Vibration newest_;
};

}  // namespace kphi::daq
