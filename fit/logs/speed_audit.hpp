// The speeds of a foreign log: errors there dominate everything, they enter k squared.
#pragma once

#include <optional>
#include <vector>

#include "fit/logs/stand_log.hpp"

namespace kphi::fit {

/// Two whole numbers whose quotient is close to the ratio of two speed sources.
struct PoleRatio {
  int numerator = 1;
  int denominator = 1;
};

/// p/q with p, q up to 24 and p ≠ q nearest to `ratio` within 0.2 %, smallest numbers first; nothing within 1 % of 1.
[[nodiscard]] std::optional<PoleRatio> pole_ratio(double ratio);

/// What two sources make of each other; `ratio` is the median of optical/electrical where both turn.
struct SpeedComparison {
  double ratio = 1;
  std::size_t rows = 0;  ///< in which both turn
  std::optional<PoleRatio> poles;
  std::vector<Finding> findings;  ///< speed_ratio, speed_disagrees, speed_dead
};
[[nodiscard]] SpeedComparison compare_speeds(const StandLog& log);

/// speed_spike, speed_missing, barely_turning, not_turning, coasting, current_limit; `zero_n` is the thrust of the
/// still motor.
[[nodiscard]] std::vector<Finding> audit_speed(const StandLog& log, SpeedSource source, double zero_n);

}  // namespace kphi::fit
