// Repetitions of an occlusion, judged; by science.md, eq. 14, without the run that is judged.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "results/step_mean.hpp"
#include "results/steps_csv.hpp"

namespace kphi::results {

/// k of one repetition, N/(rad/s)²: least squares of T = k ω² over the levels that all repetitions have.
struct RepetitionFigure {
  int repetition = 0;
  double k = kNotMeasured;
  double u = kNotMeasured;  ///< standard, from within the steps, the zeros and their drift
  double per_n = 0;         ///< change of k for 1 N of zero
  bool usable = false;      ///< at least half of its steps are good
  FlaggedSteps flags{};     ///< that spoil k
  bool outlying = false;
  double away = kNotMeasured;  ///< k over the median of all (Student: mean of others), less 1
  /// Probability that chance alone puts one of all runs this far off; NaN: judged by Hampel's identifier, or not at
  /// all.
  double p = kNotMeasured;
};

/// The repetitions of one propeller and occlusion, compared.
struct RepetitionVerdict {
  std::string propeller;
  double occlusion_deg = 0;
  std::vector<RepetitionFigure> repetitions;  ///< all of them, outlying ones included
  double k = kNotMeasured;                    ///< median
  double between_sd = kNotMeasured;           ///< of k from repetition to repetition
  double within_u = kNotMeasured;             ///< root mean square of u
  double f = kNotMeasured;                    ///< between² over within² (one-way analysis of variance)
  double p = kNotMeasured;                    ///< probability of an f this large if only the noise differs
  bool asks_for_another = false;
  std::string reason{};  ///< one line; empty if the repetitions agree
};

struct RepetitionRule {
  int wanted = 3;   ///< repetitions of the campaign
  int at_most = 5;  ///< runs; after these no further one is asked for
  /// Below two degrees of freedom between the other runs: Hampel's identifier. Outlying is further from the median than
  /// `threshold` times the largest of 1.4826 · median absolute deviation, the uncertainty within, and least_share · k.
  double threshold = 3;
  double least_share = 0.001;
  /// From then on: Student's test of the run against the mean of the others of its occlusion, with the scatter of all
  /// other runs (scatter_between), at this level for one of all runs (Bonferroni). threshold · least_share of k is
  /// never outlying.
  double level = 0.05;
  /// A spread of more than this share of k is too much, even if no repetition stands out.
  double spread_share = 0.02;
};

/// The one judge of repetitions: while a campaign runs, in a replay and in the fit. One verdict per propeller and
/// occlusion, in the order of first appearance; rows with repetition 0 are skipped. Pass all runs there are: the more
/// occlusions, the surer the verdict. Once the wanted repetitions are there, another is asked for while fewer of them
/// are good (usable and not outlying), or while their spread is too large, up to at_most.
[[nodiscard]] std::vector<RepetitionVerdict> judge_repetitions(std::span<const StepMean> steps,
                                                               const RepetitionRule& rule = {});

}  // namespace kphi::results
