// Gain of the motor module's clock from the blade-pass line: the blades load the cell blades · ω/2π times a second, and
// the box's clock times that line. Its frequency over the one of the reported speed is the gain.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "fit/numerics/hypothesis_test.hpp"
#include "results/records.hpp"

namespace kphi::fit {

/// The line of one step.
struct BladePassLine {
  int step = 0;
  double frequency_hz = 0;          ///< of the blade-pass line, by the clock of the box
  double reported_speed_rad_s = 0;  ///< mean over the same window, as reported
  double gain = 1;                  ///< true speed over reported speed
  double u_gain = 0;                ///< from the noise about the line and the scatter of the speed
  double signal_to_noise = 0;       ///< amplitude over the rms of the bins around it
};

struct BladePassCheck {
  std::vector<BladePassLine> lines;  ///< those found
  Estimate gain;                     ///< weighted mean, with the box's clock (u_box) in it
  double lower = 1, upper = 1;       ///< 95 %
  /// Agreement with another estimate of the same gain.
  [[nodiscard]] HypothesisTest against(const Estimate& other) const { return welch_test(gain, other); }
};

struct BladePassOptions {
  double u_box = 30e-6;              ///< relative standard uncertainty of the box's sample clock, a quartz
  double search = 0.02;              ///< search range about the reported speed, relative
  double least_signal_to_noise = 8;  ///< of the line over the noise of one bin
};

/// Speeds in `runs` are as the module reported them. nullopt if no step shows a line.
[[nodiscard]] std::optional<BladePassCheck> check_by_blade_pass(std::span<const results::RunRecording> runs,
                                                                const BladePassOptions& options = {});

}  // namespace kphi::fit
