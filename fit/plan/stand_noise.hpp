// What a stand does to the k of a run, from one pilot campaign or several, or as stated: noise and its memory, zero and
// its wander, scatter from run to run and from mounting to mounting, what the model lacks. Enough to say how certain
// another campaign will be before it is run. Its memories are those of science.md, eq. 29.
#pragma once

#include <limits>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "fit/plan/memory.hpp"
#include "fit/uncertainty/analysis.hpp"

namespace kphi::fit {

struct StandNoise {
  // Standard deviation of the mean thrust of a step: constant and in proportion to the thrust.
  double noise_n = 0;      ///< averaged over 1 s, N; a longer window makes it smaller
  double noise_share = 0;  ///< of the thrust, over 1 s
  double memory_s = 0;     ///< correlation time of that noise; 0: none
  double slow_n = 0;       ///< beyond what the samples of a step tell of it, over 1 s, N
  double slow_share = 0;   ///< of the thrust, over 1 s
  double slow_memory_s =
      kEndlessMemory;      ///< correlation time of that; endless: a longer window does not make it smaller
  double settle_s = 1;     ///< from the command of a step to the begin of its window
  double zero_n = 0;       ///< of the mean of a run's two zeros, 1 s each, by their samples, standard, N
  double zero_walk_n = 0;  ///< how far the zero moves in a minute, standard deviation, N
  double runs = 0;         ///< from run to run beyond noise and zero, standard deviation, share of k
  double runs_n = 0;       ///< from run to run beyond noise and zero, added to the thrust, standard deviation, N
  double runs_freedom = std::numeric_limits<double>::infinity();  ///< degrees of freedom behind `runs`
  std::optional<double> mounting{};  ///< from mounting to mounting, share of k; nullopt: not measured
  double campaigns = 0;              ///< from campaign to campaign, common to all k, share
  double model = 0;                  ///< how far k at some speed is from the k of the fit, share
  double bend = 0;                   ///< how far k(φ) is from the curve, standard deviation, share of K_T
  double K_T = 0;                    ///< N/(rad/s)²; 0: unknown
  double intercept = 0;              ///< of the line, share of K_T
  double slope_per_deg = 0;          ///< of the line, share of K_T

  /// Standard deviation of the mean thrust of a step, N.
  [[nodiscard]] double step_n(double thrust_n, double window_s) const;
  /// Standard uncertainty of the mean of a run's two zeros, N, each of this length.
  [[nodiscard]] double zero_u_n(double zero_s) const;
  /// k(φ), N/(rad/s)²; K_T at φ = 0.
  [[nodiscard]] double k_at(double phi_deg) const;
};

/// A pilot, and what its steps do not say.
struct PilotCampaign {
  const Fitted& fitted;
  double zero_s = 0;          ///< length of each of a run's two zeros
  bool mounted_once = false;  ///< one mounting for all runs of an occlusion
};

/// Of all pilots together, which are of one propeller: noise as the root mean square, the scatter of runs pooled.
/// Throws ConfigurationError without any repetition, or if some pilots were remounted for each and others not.
[[nodiscard]] StandNoise noise_of(std::span<const PilotCampaign> pilots);

/// "NAME=VALUE" replaces one number, in the units of the members: noise-n, noise-share, memory-s, slow-n,
/// slow-share, slow-memory-s, settle-s, zero-n, zero-walk-n, runs, runs-n, mounting, campaigns, model, bend, k-t,
/// intercept, slope-per-deg. Throws ConfigurationError.
void state(StandNoise& noise, const std::string& text);

/// NAME and VALUE of all that is known, as state() reads them.
[[nodiscard]] std::vector<std::pair<std::string, double>> known_noise(const StandNoise& noise);

}  // namespace kphi::fit
