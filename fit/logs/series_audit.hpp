// What only a time series shows: stamps that go back, a frozen channel, thrust that drifts at constant speed, noise
// that is not white.
#pragma once

#include <vector>

#include "fit/logs/stand_log.hpp"

namespace kphi::fit {

/// The rows within 2 % of the speed at which the log stays longest: places in log.rows. Empty with fewer than 100 of
/// them, or under a tenth of the rows that turn.
[[nodiscard]] std::vector<std::size_t> plateau(const StandLog& log, SpeedSource source);

/// Sum of the autocorrelation, 1 + 2 Σ ρ, up to its first value below 0.05: so many rows are worth one.
[[nodiscard]] double correlation_time(const std::vector<double>& values);

/// time_backward, time_repeated, thrust_frozen, thrust_drifts, correlated_noise.
[[nodiscard]] std::vector<Finding> audit_series(const StandLog& log, SpeedSource source);

}  // namespace kphi::fit
