// The fastest level that a motor can hold with its propeller, learned when its drive comes to its end.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "compensation/units.hpp"
#include "profiles/order.hpp"
#include "results/step_mean.hpp"

namespace kphi::daq {

/// A level that was commanded and not reached, because no drive was left.
struct CapLesson {
  RadPerSec commanded;
  RadPerSec reached;  ///< mean of that step
  RadPerSec cap;      ///< the highest level below it that was reached with drive to spare (under 98 % of the supply)
};

/// A step at its end, by the newest readings: the speed falls short of its command, and no drive is left. What a run
/// then still has at this level or above is left out of it: only the step that was driven gets flags (and no mean a
/// place in a fit), the coil is spared, and the levels below are measured all the same.
[[nodiscard]] bool is_out_of_drive(RadPerSec commanded, RadPerSec reached, double drive_pwm);

/// Of one propeller on one motor. Later runs leave out the levels above: a drive at its end holds no speed, heats the
/// coil, and would only give flagged steps. A cap falls and never rises.
class SpeedCap {
 public:
  /// The means of one run. Nothing: all it asked for was reached, or it teaches nothing new, or not one level was held.
  std::optional<CapLesson> learn(std::span<const results::StepMean> run);
  [[nodiscard]] const std::optional<RadPerSec>& speed() const { return cap_; }
  /// Takes out what is above the cap; how many.
  int apply(std::vector<profiles::PlannedStep>& steps) const;

 private:
  std::optional<RadPerSec> cap_;
};

}  // namespace kphi::daq
