// Several runs of a propeller compared: repetitions averaged and judged, rising against falling speeds, and the
// reference runs at the two ends of a session.
#pragma once

#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <tuple>
#include <vector>

#include "results/step_mean.hpp"

namespace kphi::results {

/// The rows of means.csv: one per propeller, occlusion and step, in the order of first appearance, with repetition = 0.
/// T = k ω² is linear in ω², so the averaged speed is the root of the mean of the squares, and thrust over speed² of
/// the row is the common k of the repetitions. Thrust, torque, zero, electrical and thermal readings, the commanded
/// speed, the lag and the window's ends: arithmetic means over the repetitions that have them. Standard deviations:
/// root mean square (the spread within a step, not between repetitions). Standard uncertainties: of the mean, assuming
/// that the repetitions differ only by the noise within them; judge_repetitions() checks that. Numbers of samples:
/// sums. Flags: those of any repetition.
/// Averages leave out a flagged step if another repetition has a good one (repetitions_averaged, repetitions_left_out),
/// by the rule of the fit: a step is left out for a flag, which names a cause, never for being far from the others
/// (JCGM 100, 3.4.7 and 4.2: the scatter of repetitions is their uncertainty).
[[nodiscard]] std::vector<StepMean> means_of(std::span<const StepMean> steps);

/// True for a measured thrust without a flag that concerns k (kHarmlessFlags do not).
[[nodiscard]] bool is_good(const StepMean& step);
/// Standard uncertainty of the thrust from the noise within the step, N.
[[nodiscard]] double thrust_u_within(const StepMean& step);

/// How far the zero usually moves during a run, from the good steps of all runs: add() them. One run tells little: a
/// zero that wandered may be back where it began.
class ZeroMovement {
 public:
  void add(const StepMean& step);
  [[nodiscard]] double usual_n() const;  ///< root mean square over the runs, N; 0: unknown
  /// Of the run of this step, N: half by its own movement, which tells all of a jump, half by the usual one, since the
  /// run's own tells nothing of a walk (root mean square of both).
  [[nodiscard]] double of_run_n(const StepMean& step) const;
  [[nodiscard]] double runs() const { return static_cast<double>(of_run_.size()); }

 private:
  struct Range {
    double moved = kNotMeasured;  ///< as the run's own zeros say
    double lowest = std::numeric_limits<double>::infinity(), highest = -lowest;
    [[nodiscard]] double movement() const;
  };
  std::map<std::tuple<std::string, double, int>, Range> of_run_;
};

/// What the zero that all steps of a run share does to the k of that run.
class SharedZero {
 public:
  /// `weight` of the step in the mean of the zero: ω² where T = k ω² is fitted.
  void add(const StepMean& step, double weight) { add(step.zero_u_n, step.window_begin_s, step.window_end_s, weight); }
  void add(double zero_u_n, double begin_s, double end_s, double weight);
  /// Standard uncertainty, N: of the measured zeros, and of a zero that wanders between them by `movement_n`, where it is
  /// taken as a line in time. A random walk tied at both ends, and a jump at any time, have the covariance
  /// min(s, t) − s t between the shares s and t of that time: steps beside one of the zeros feel little of it. 0.28 of the
  /// movement in a run of rising speeds; without times 1/√12, as of a rectangle (JCGM 100, 4.3.7).
  [[nodiscard]] double u_n(double movement_n) const;

 private:
  struct Part {
    double begin_s, end_s, weight;
  };
  std::vector<Part> parts_;
  double measured_ = 0, weights_ = 0;
};

/// k of one run as a share of the k of its occlusion, with the variance that its noise and its zero explain.
struct RunShare {
  double k = 0;
  double variance = 0;
};
/// Degrees of freedom of the scatter between runs, pooled over occlusions: runs less one for each.
[[nodiscard]] double freedom_between(std::span<const std::vector<RunShare>> occlusions);
/// Variance from run to run beyond the explained one, pooled over occlusions: the one at which χ² of the runs about the
/// mean of their occlusion has its expectation (Mandel, Paule, Anal. Chem. 42 (1970) 1194). 0 without repetitions.
[[nodiscard]] double variance_between(std::span<const std::vector<RunShare>> occlusions);
/// Degrees of freedom of that variance: fewer than between the runs where noise and zero explain much of their scatter
/// (twice its square over the variance of its estimate).
[[nodiscard]] double freedom_of(double variance_between, std::span<const std::vector<RunShare>> occlusions);

/// k of one repetition, N/(rad/s)²: least squares of T = k ω² over the levels that all repetitions have.
struct RepetitionFigure {
  int repetition = 0;
  double k = kNotMeasured;
  double u = kNotMeasured;  ///< standard, from within the steps, the zeros and their drift
  bool usable = false;      ///< at least half of its steps are good
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
  /// other runs (variance_between), at this level for one of all runs (Bonferroni). threshold · least_share of k is
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

/// Thrust at one speed, reached from below and from above.
struct HysteresisPoint {
  double speed_rad_s = 0;      ///< of the rising step
  double up_minus_down_n = 0;  ///< thrust; the falling step scaled to that speed by ω²
  double u_n = 0;              ///< standard, from the noise within both steps; they share the zero
  [[nodiscard]] bool significant() const { return up_minus_down_n * up_minus_down_n > 4 * u_n * u_n; }
};

struct Hysteresis {
  std::vector<HysteresisPoint> speeds;  ///< ascending
  double share = 0;                     ///< k rising less k falling, as a share of k
  double u_share = 0;                   ///< standard
  [[nodiscard]] bool significant() const { return share * share > 4 * u_share * u_share; }
  /// "thrust going up minus going down: +0.12 ± 0.05 % of k …"
  [[nodiscard]] std::string to_words() const;
};

/// `run`: the steps of one run. nullopt if fewer than two speeds have a good step on both ways.
[[nodiscard]] std::optional<Hysteresis> hysteresis_of(std::span<const StepMean> run);

/// The bench has drifted if k of the same propeller changed by more than this share and twice its uncertainty.
inline constexpr double kReferenceDriftShare = 0.005;

struct ReferenceDrift {
  double k_begin = 0;  ///< N/(rad/s)², least squares over the levels that both runs have
  double k_end = 0;
  double share = 0;       ///< k_end / k_begin - 1; at equal air density if both are known
  double u_share = 0;     ///< standard, from within the steps, the zeros and their drift
  bool same_air = false;  ///< share is at equal density
  [[nodiscard]] bool drifted() const;
  /// One line.
  [[nodiscard]] std::string to_words() const;
};

/// `steps`: of the reference runs, repetition -1, -2, …; compares the first with the last. nullopt if there are not
/// two, or one of them has too few good steps.
[[nodiscard]] std::optional<ReferenceDrift> reference_drift(std::span<const StepMean> steps);

}  // namespace kphi::results
