// The speed without the motor's own clock: the blades press on the load cell blades · ω/2π times a second, and that
// line in the spectrum is timed by the box. Against the reported speed it gives the gain of the module's clock.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "fit/numerics/hypothesis_test.hpp"
#include "results/records.hpp"

namespace kphi::fit {

/// One step.
struct BladePassLine {
  int step = 0;
  double frequency_hz = 0;          ///< of the blade-pass line, in seconds of the box's clock
  double reported_speed_rad_s = 0;  ///< mean over the same samples, as the module said
  double gain = 1;                  ///< true speed over reported speed
  double u_gain = 0;                ///< by the noise about the line and the speed's wander
  double signal_to_noise = 0;       ///< amplitude over the rms of the bins around it
};

struct BladePassCheck {
  std::vector<BladePassLine> lines;  ///< those that stand out
  Estimate gain;                     ///< weighted mean, with the box's clock (u_box) in it
  double lower = 1, upper = 1;       ///< 95 %
  /// Agreement with another estimate of the same gain.
  [[nodiscard]] HypothesisTest against(const Estimate& other) const { return welch_test(gain, other); }
};

struct BladePassOptions {
  double u_box = 30e-6;              ///< relative standard uncertainty of the box's sample clock, a quartz
  double search = 0.02;              ///< how far from the reported speed to look, relative
  double least_signal_to_noise = 8;  ///< of the line over the noise of one bin
};

/// Speeds in `runs` are as the module reported them. Nothing when no step shows a line.
[[nodiscard]] std::optional<BladePassCheck> check_by_blade_pass(std::span<const results::RunRecording> runs,
                                                                const BladePassOptions& options = {});

}  // namespace kphi::fit
