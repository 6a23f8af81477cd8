// Which steps enter a fit. A flagged step is left out and listed with its reason.
#pragma once

#include <limits>
#include <span>
#include <string>
#include <vector>

#include "fit/model/thrust_fit.hpp"
#include "results/step_mean.hpp"

namespace kphi::fit {

/// Thrust below this speed is under the noise of the load cell: 100 RPM on a 5-inch propeller is 0.2 mN. In a fit on
/// ω² such steps do no harm, but they would widen the range of speeds that the file states.
inline constexpr double kSpeedMinRpm = 3000;

struct SpeedRange {
  double min_rad_s = 0;
  double max_rad_s = std::numeric_limits<double>::infinity();
};

/// A run left out by hand, with the cause.
struct LeftOutRun {
  double phi_deg = 0;
  int repetition = 0;
  std::string cause;
};
/// "PHI:REPETITION:CAUSE", such as "90:2:plate slipped". Throws ConfigurationError.
[[nodiscard]] LeftOutRun parse_left_out_run(const std::string& text);

struct FlaggedStep {
  results::StepMean step;
  std::string reason;    ///< "speed not reached, derated"
  bool left_out = true;  ///< false: kept, but listed (lost samples alone)
};

struct StepSelection {
  std::vector<results::StepMean> used;
  std::vector<FlaggedStep> flagged;  ///< in the order given
  std::size_t outside_range = 0;
};

/// The level of a step: what was commanded, or, in imported tables without a command, what was measured. rad/s.
[[nodiscard]] double level(const results::StepMean& step);

/// Averages over repetitions (repetition 0) are dropped where single repetitions exist: they would count twice.
/// A step is left out for a quality flag (results::kHarmlessFlags are listed only), which names a cause, and never for
/// being far from the others: the scatter of the repetitions is their uncertainty (JCGM 100, 3.4.7 and 4.2). means.csv
/// follows the same rule. Runs left out by hand are listed step by step, with the cause.
[[nodiscard]] StepSelection select_steps(std::span<const results::StepMean> steps, const SpeedRange& range,
                                         std::span<const LeftOutRun> left_out = {});

/// The points of one fit. Their uncertainty is the step's own (correlated samples, zero) if every step has it;
/// otherwise s/√n for all, since the two differ by a factor and must not be mixed. The same for the speed.
[[nodiscard]] std::vector<Point> points_of(std::span<const results::StepMean> steps);

}  // namespace kphi::fit
