// The loop that an ESC does not close: a throttle from a speed.
#pragma once

namespace kphi::second_bench {

/// From speed to throttle: what the speed needs at this voltage, and a correction that integrates the error.
class SpeedLoop {
 public:
  static constexpr double kLeast = 48, kMost = 2000;  ///< throttle: the least at which an ESC turns, and all

  struct Settings {
    double pole_pairs = 7;
    double kv_rad_s_per_v = 0;
    double proportional = 0, integral = 0;  ///< throttle per rad/s and per rad
  };
  explicit SpeedLoop(const Settings& settings) : settings_(settings) {}
  [[nodiscard]] const Settings& settings() const noexcept { return settings_; }
  /// From kLeast to kMost. Speeds in rad/s, unsigned.
  [[nodiscard]] int throttle(double wanted, double measured, double volts, double seconds) noexcept;
  void reset() noexcept { integral_ = 0; }

 private:
  const Settings settings_;
  double integral_ = 0;  ///< throttle
};

}  // namespace kphi::second_bench
