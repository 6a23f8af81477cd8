// The fastest level that a motor can hold with its propeller, learned when it reaches full drive.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "compensation/units.hpp"
#include "profiles/plan.hpp"
#include "results/step_mean.hpp"

namespace kphi::daq {

/// A commanded level that the motor missed at full drive.
struct CapLesson {
  RadPerSec commanded;
  RadPerSec reached;  ///< mean of that step
  RadPerSec cap;      ///< the highest level below it that was reached with drive to spare (under 98 % of the supply)
};

/// By the newest readings of a step: the speed falls short of its command at full drive. The run then skips its
/// remaining steps at this level or above: only one step is flagged, the coil stays cooler, and all levels below are
/// measured.
[[nodiscard]] bool is_out_of_drive(RadPerSec commanded, RadPerSec reached, double drive_pwm);

/// For one propeller on one motor. Later runs skip the levels above: at full drive the speed is not controlled, the
/// coil heats, and all steps would be flagged. A cap falls and never rises.
class SpeedCap {
 public:
  /// The means of one run. nullopt: every level was reached, nothing new was learned, or no level was held.
  std::optional<CapLesson> learn(std::span<const results::StepMean> run);
  [[nodiscard]] const std::optional<RadPerSec>& speed() const { return cap_; }
  /// Removes the steps above the cap.
  void apply(std::vector<profiles::PlannedStep>& steps) const;

 private:
  std::optional<RadPerSec> cap_;
};

}  // namespace kphi::daq
