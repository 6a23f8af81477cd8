// What the flights say of the coefficient file, in words: whether it may fly in this world.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "compensation/flight/study.hpp"

namespace kphi::flight {

enum class Fitness : std::uint8_t { fit_to_fly, not_better, loses_the_vehicle };

/// One thing that speaks against the file, with the number and the next move.
struct Judgement {
  Fitness fitness = Fitness::fit_to_fly;
  std::vector<std::string> doubts;  ///< worst first; empty where it is fit to fly
};

/// Limits of the verdict.
inline constexpr double kLostShare = 0.02;       ///< of the draws, lost with compensation or in X
inline constexpr double kHoverInX = 0.05;        ///< m, median, where nothing is covered
inline constexpr double kBetterShare = 0.8;      ///< of the draws: hover height nearer with compensation than without
inline constexpr double kOverCompensated = 0.5;  ///< of the height error without, beyond the reference
inline constexpr double kSidewaysRatio = 1.15;   ///< horizontal error with compensation over without, median
inline constexpr double kSidewaysNoise = 0.02;  ///< m, more of it than without: less than this is the estimator's noise

/// Of many draws, or of one.
[[nodiscard]] Judgement judgement_of(const Findings& findings);

/// Errors of a file that the verdict does not notice in one scene: the largest of those tried.
struct BlindZone {
  double least_fall = 1, most_fall = 1;  ///< what k(φ) loses over φ, as a share of what the file says
  double least_k_t = 1, most_k_t = 1;    ///< K_T of the file over that of the air
};
/// Flies the nine experiments once for each step away from the file, until the verdict changes. Of a scene that is fit
/// to fly.
[[nodiscard]] BlindZone blind_zone_of(const Scene& nominal, const Shadow& shadow);
/// One sentence. `k_t_judged`: the air has a K_T that is not the file's own.
[[nodiscard]] std::string words_of(const BlindZone& blind, bool k_t_judged);

/// "verdict: fit to fly …", or what speaks against it, a line each.
[[nodiscard]] std::string words_of(const Judgement& judgement, const Findings& findings);
[[nodiscard]] constexpr const char* name_of(Fitness fitness) noexcept {
  return fitness == Fitness::fit_to_fly   ? "fit_to_fly"
         : fitness == Fitness::not_better ? "not_better"
                                          : "loses_the_vehicle";
}

}  // namespace kphi::flight
