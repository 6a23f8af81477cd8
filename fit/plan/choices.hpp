// The cheapest campaigns that tell what somebody wants to know, beside the campaign as it is written.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "fit/plan/prediction.hpp"
#include "profiles/bench_config.hpp"
#include "profiles/campaign.hpp"
#include "profiles/plan.hpp"

namespace kphi::fit {

/// One campaign: what it costs and what it will tell.
struct Choice {
  profiles::Campaign campaign;
  double bench_min = 0;     ///< motor on and zeros, minutes
  double mounting_min = 0;  ///< a person at the stand, minutes
  int mountings = 0;
  int runs = 0;
  std::uint64_t bytes = 0;   ///< on disk
  std::vector<Budget> told;  ///< one for each number wanted
  double bend_seen = 0;      ///< see Prediction
  [[nodiscard]] double minutes() const { return bench_min + mounting_min; }
};

/// A wish that no campaign on this stand fulfils.
struct Unreachable {
  Wish wish;
  double best = 0;      ///< share, of the largest campaign looked at
  std::string because;  ///< the row that is left
};

struct PlanQuestion {
  profiles::Campaign campaign;
  profiles::BenchConfig bench;
  StandNoise noise;
  BenchUncertainty uncertainty;
  CurveOptions curve;
  std::vector<Wish> wishes;  ///< may be empty: then only the campaign as written is told
  double minutes_per_mounting = 2;
  std::function<std::uint64_t(const profiles::Plan&)> bytes;
};

struct PlanAnswer {
  std::vector<Wanted> told;
  Choice as_written;
  std::vector<Choice> choices;           ///< that fulfil every wish, cheapest first, at most kMostChoices
  std::vector<Unreachable> unreachable;  ///< with any, there are no choices
};
inline constexpr std::size_t kMostChoices = 6;

/// Searches repetitions (2 to 8), remounting, number of speeds, dwell, steps that end by themselves, zeros, and which
/// of the campaign's occlusions are run: always 0°, the smallest and the widest, and where there are three or more one
/// between them, so that k(φ) can be seen to bend. No choice sees a smaller bend worse than the campaign as written
/// does or 1 % of K_T, the larger of the two. Throws ConfigurationError as Prediction does.
[[nodiscard]] PlanAnswer answer(const PlanQuestion& question);

/// A table of choices with minutes, mountings and what each tells; then what limits each number.
[[nodiscard]] std::string answer_text(const PlanQuestion& question, const PlanAnswer& answer);
[[nodiscard]] std::string answer_json(const PlanQuestion& question, const PlanAnswer& answer);

}  // namespace kphi::fit
