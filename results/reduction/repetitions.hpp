// What several runs of a propeller tell together: repetitions averaged and judged, a run up and down, and the reference
// runs at the two ends of a session.
#pragma once

#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "results/step_mean.hpp"

namespace kphi::results {

/// One row per propeller, occlusion and step, in the order of first appearance, with repetition = 0.
/// T = k ω² is linear in ω², so the averaged speed is the root of the mean of the squares, and thrust over speed² of
/// the row is the k that the repetitions have together. Thrust, torque, zero, electrical and thermal readings, the
/// commanded speed, the lag and the window's ends: arithmetic means over the repetitions that have them. Standard
/// deviations: root mean square (the spread within a step, not between repetitions). Standard uncertainties: of the
/// mean, as if nothing but what is within the steps made the repetitions differ; judge_repetitions tells whether that
/// is so. Numbers of samples: sums. Flags: those of any repetition.
[[nodiscard]] std::vector<StepMean> average_repetitions(std::span<const StepMean> steps);

/// What means.csv holds: average_repetitions without the steps that do not tell k, where another repetition does; the
/// rows tell of it: repetitions_averaged, repetitions_left_out. The rule is that of the fit: a step is left out for a
/// flag, which names a cause, never for being far from the others (JCGM 100, 3.4.7 and 4.2: what repetitions scatter
/// is their uncertainty). An outlying one asks for another run, and stays.
[[nodiscard]] std::vector<StepMean> means_of(std::span<const StepMean> steps);

/// Without a flag about thrust over speed² (kHarmlessFlags do not count).
[[nodiscard]] bool tells_k(const StepMean& step);
/// Standard uncertainty of the thrust from within the step alone, N; older files do not tell it.
[[nodiscard]] double thrust_u_within(const StepMean& step);

/// k of one repetition, N/(rad/s)²: least squares of T = k ω² over the levels that all repetitions have.
struct RepetitionFigure {
  int repetition = 0;
  double k = std::numeric_limits<double>::quiet_NaN();
  double u = std::numeric_limits<double>::quiet_NaN();  ///< standard, from within the steps and the zeros
  bool usable = false;                                  ///< at least half of its steps are without a flag about k
  bool outlying = false;                                ///< by Hampel's identifier
};

/// What repetitions of one propeller and occlusion say of each other.
struct RepetitionVerdict {
  std::string propeller;
  double occlusion_deg = 0;
  std::vector<RepetitionFigure> repetitions;                     ///< every one stays here, whatever becomes of it
  double k = std::numeric_limits<double>::quiet_NaN();           ///< median
  double between_sd = std::numeric_limits<double>::quiet_NaN();  ///< of k from repetition to repetition
  double within_u = std::numeric_limits<double>::quiet_NaN();    ///< root mean square of u
  double f = std::numeric_limits<double>::quiet_NaN();  ///< between² over within² (one-way analysis of variance)
  double p = std::numeric_limits<double>::quiet_NaN();  ///< how probable so large an f is when nothing is between
  bool asks_for_another = false;
  std::string reason;  ///< one line; empty when nothing is to be said
};

struct RepetitionRule {
  int wanted = 3;   ///< repetitions of the campaign
  int at_most = 5;  ///< runs: after these it is no longer chance
  /// Hampel's identifier: further from the median than so many times the largest of 1.4826 · median absolute
  /// deviation, the uncertainty within, and least_share · k.
  double threshold = 3;
  double least_share = 0.001;
  /// From the lowest to the highest more than this share of k is too much, even when none of them stands out.
  double spread_share = 0.02;
};

/// One verdict per propeller and occlusion, in the order of first appearance; rows with repetition 0 do not count. Once
/// the wanted repetitions are there, another is asked for while fewer of them are good (usable and not outlying), or
/// while their spread is too large, up to at_most.
[[nodiscard]] std::vector<RepetitionVerdict> judge_repetitions(std::span<const StepMean> steps,
                                                               const RepetitionRule& rule = {});

/// Whether the thrust at a speed depends on the side from which the speed was reached.
struct HysteresisPoint {
  double speed_rad_s = 0;      ///< of the rising step
  double up_minus_down_n = 0;  ///< thrust, the falling step's scaled to that speed by ω²
  double u_n = 0;              ///< standard, from within the two steps; the zero's is common to both
  [[nodiscard]] bool significant() const { return up_minus_down_n * up_minus_down_n > 4 * u_n * u_n; }
};

struct Hysteresis {
  std::vector<HysteresisPoint> speeds;  ///< ascending
  double share = 0;                     ///< k rising less k falling, of k
  double u_share = 0;                   ///< standard
  [[nodiscard]] bool significant() const { return share * share > 4 * u_share * u_share; }
  /// "thrust up minus down: k +0.12 ± 0.05 % …", one line.
  [[nodiscard]] std::string to_words() const;
};

/// Of the steps of one run; nothing when fewer than two speeds were held on both ways without a flag about k.
[[nodiscard]] std::optional<Hysteresis> hysteresis_of(std::span<const StepMean> run);

/// A bench whose k of the same propeller changed by more than this share (and twice its uncertainty) has drifted: as
/// much as a zero may drift.
inline constexpr double kReferenceDriftShare = 0.005;

struct ReferenceDrift {
  double k_begin = 0;  ///< N/(rad/s)², least squares over the levels that both runs have
  double k_end = 0;
  double share = 0;       ///< k_end / k_begin - 1; at equal density of the air where it is known of both
  double u_share = 0;     ///< standard, from within the steps and the zeros
  bool same_air = false;  ///< share is at equal density
  [[nodiscard]] bool drifted() const;
  /// One line.
  [[nodiscard]] std::string to_words() const;
};

/// `steps`: of the reference runs, repetition -1, -2, …; the first is held against the last. Nothing when there are not
/// two, or one of them has too few steps without a flag about k.
[[nodiscard]] std::optional<ReferenceDrift> reference_drift(std::span<const StepMean> steps);

}  // namespace kphi::results
