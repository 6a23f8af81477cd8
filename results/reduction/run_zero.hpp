// The zero that all steps of a run share: how far it moves, and what it does to the k of the run (science.md, eq. 8 and
// 9).
#pragma once

#include <limits>
#include <map>
#include <string>
#include <tuple>
#include <vector>

#include "results/step_mean.hpp"

namespace kphi::results {

/// How far the zero usually moves during a run, from the good steps of all runs: add() them. One run tells little: a
/// zero that wandered may be back where it began.
class ZeroMovement {
 public:
  void add(const StepMean& step);
  [[nodiscard]] double usual_n() const;  ///< root mean square over the runs, N; 0: unknown
  /// How far the zero of the run of this step wandered, N: half by its own movement, which tells all of a jump, half by
  /// the usual one, since the run's own tells nothing of a walk (root mean square of both); each less what the noise of
  /// two zeros moves, which SharedZero counts as measured.
  [[nodiscard]] double of_run_n(const StepMean& step) const;
  [[nodiscard]] double runs() const { return static_cast<double>(of_run_.size()); }

 private:
  struct Range {
    double moved = kNotMeasured;  ///< as the run's own zeros say
    double lowest = std::numeric_limits<double>::infinity(), highest = -lowest;
    double least_u_n = kNotMeasured;  ///< halfway between two zeros, where their mean counts
    [[nodiscard]] double movement() const;
    [[nodiscard]] double noise_n2() const;  ///< of the difference of two zeros
  };
  std::map<std::tuple<std::string, double, int>, Range> of_run_;
};

/// What the zero that all steps of a run share does to the k of that run.
class SharedZero {
 public:
  /// `weight` of the step in the mean of the zero: ω² where T = k ω² is fitted.
  void add(const StepMean& step, double weight) { add(step.zero_u_n, step.window_begin_s, step.window_end_s, weight); }
  void add(double zero_u_n, double begin_s, double end_s, double weight);
  /// Standard uncertainty, N: of the measured zeros at the mean time of the steps (the zero is a line in time, so its
  /// variance is a parabola, and the mean over the steps has that of their mean time), and of a zero that wanders
  /// between them by `movement_n`, where it is taken as a line in time. A random walk tied at both ends, and a jump at
  /// any time, have the covariance min(s, t) − s t between the shares s and t of that time: steps beside one of the
  /// zeros feel little of it. 0.28 of the movement in a run of rising speeds; without times 1/√12, as of a rectangle
  /// (JCGM 100, 4.3.7).
  [[nodiscard]] double u_n(double movement_n) const;

 private:
  struct Part {
    double middle_s, weight, u_n;
  };
  [[nodiscard]] double measured_variance(double mean_s) const;

  std::vector<Part> parts_;
  double weights_ = 0;
  double begin_s_ = std::numeric_limits<double>::infinity(), end_s_ = -begin_s_;
};

}  // namespace kphi::results
