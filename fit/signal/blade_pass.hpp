// Gain of the motor module's clock from the blade-pass line: the blades load the cell blades · ω/2π times a second, and
// the box's clock times that line (science.md, eq. 34). Its frequency over the one of the reported speed is the gain.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "fit/numerics/hypothesis_test.hpp"
#include "results/records.hpp"

namespace kphi::fit {

struct BladePassCheck {
  std::vector<Estimate> lines;  ///< true speed over reported speed, one per step whose line was found
  Estimate gain;                ///< weighted mean, with the box's clock in it
  double lower = 1, upper = 1;  ///< 95 %
  /// Agreement with another estimate of the same gain.
  [[nodiscard]] HypothesisTest against(const Estimate& other) const { return welch_test(gain, other); }
};

/// Speeds in `runs` are as the module reported them. nullopt if no step shows a line.
[[nodiscard]] std::optional<BladePassCheck> check_by_blade_pass(std::span<const results::RunRecording> runs);

}  // namespace kphi::fit
