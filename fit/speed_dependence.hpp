// Is T = k ω² true? k level by level, its trend with speed, and the lack-of-fit test against what repetitions scatter.
// On real propellers k rises by up to a fifth over the speeds of a sweep, far above all noise.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "fit/statistical_test.hpp"
#include "results/step_mean.hpp"

namespace kphi::fit {

/// k at one commanded speed.
struct LevelCoefficient {
  double speed_rad_s = 0;  ///< mean measured
  double k = 0;            ///< N/(rad/s)², mean of T/ω² over the repetitions
  double standard_error = std::numeric_limits<double>::quiet_NaN();  ///< s/√n; NaN from one repetition
  std::size_t repetitions = 0;
};

struct SpeedDependence {
  double phi_deg = 0;
  std::vector<LevelCoefficient> levels;  ///< ascending speed
  /// Of k from the lowest to the highest speed, as a share of k, by the straight line through T/ω² weighted in ω⁴.
  Estimate change;
  /// Level means about k ω² against the interaction of level and repetition: an error that a whole run shares
  /// (mounting, air) is in neither. From one repetition it cannot be tested.
  StatisticalTest lack_of_fit;
  StatisticalTest trend;  ///< change = 0
  /// Rms deviation of the levels' k from the k of the range, weighted in ω⁴, beyond what noise explains. N/(rad/s)².
  double inadequacy = 0;
};

/// `steps` of one φ. Levels that not every repetition measured are left out of the tests.
[[nodiscard]] SpeedDependence speed_dependence(double phi_deg, std::span<const results::StepMean> steps);

}  // namespace kphi::fit
