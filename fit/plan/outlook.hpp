// How far a campaign is: what it knows now, what the runs still planned will add, and what one more repetition would.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "fit/plan/prediction.hpp"
#include "profiles/bench_config.hpp"

namespace kphi::fit {

/// One number, half of its 95 % interval as a share of it.
struct Reached {
  Wanted of;
  double now = 0;
  std::optional<double> then{};    ///< with what is to come; nullopt: not to be said yet
  std::optional<double> wanted{};  ///< as asked
  int more_repetitions = 0;        ///< than planned, of every occlusion, until it is as wanted; at most kMostMore
};
inline constexpr int kMostMore = 10;

/// One more repetition of every occlusion.
struct OneMore {
  double minutes = 0;  ///< motor on and zeros
  int mountings = 0;   ///< that it takes
  std::vector<Reached> numbers;
};

/// Of a fitted campaign; nullopt where its repetitions are too few to tell.
[[nodiscard]] std::optional<OneMore> one_more_repetition(const Fitted& fitted, const profiles::Campaign& campaign,
                                                         const profiles::BenchConfig& config,
                                                         const BenchUncertainty& bench);
[[nodiscard]] nlohmann::ordered_json to_json(const OneMore& more);
/// "one more   repetition of each occlusion (7.0 min): K_T ± 0.060 -> 0.053 %, slope ± 0.119 -> 0.105 %"
[[nodiscard]] std::string to_words(const OneMore& more);

/// `steps` of the runs so far; `wishes` may be empty. Empty before K_T and two repetitions are there; the line as soon
/// as there is one, and where the plan ends as soon as the noise of the stand is known.
struct Standing {
  std::vector<Reached> numbers;
  double minutes_left = 0;  ///< of the plan, motor on and zeros
};
[[nodiscard]] Standing reached_so_far(std::span<const results::StepMean> steps, const profiles::Campaign& campaign,
                                      const BenchUncertainty& bench, std::span<const Wish> wishes);
/// "so far K_T ± 0.083 %, slope ± 0.41 %; the plan ends at 0.060 %, 0.12 % in 12 min"; with wishes "slope ± 1.4 % of 1
/// % wanted", and "1 % takes 2 repetitions more than planned". Empty without a number.
[[nodiscard]] std::string to_words(const Standing& standing);

}  // namespace kphi::fit
