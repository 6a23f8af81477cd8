// The zero of the thrust channel: an untared one of 5 % of the largest thrust is an error of 7 % in k.
#pragma once

#include <optional>
#include <vector>

#include "fit/logs/stand_log.hpp"

namespace kphi::fit {

/// Rows of a still motor with the throttle idle, at one end of the log.
struct LogZero {
  double mean_n = 0;
  double sd_n = 0;
  std::size_t rows = 0;
};

/// Before the first row that turns, and after the last. None with fewer than 10 rows.
[[nodiscard]] std::optional<LogZero> zero_before(const StandLog& log, SpeedSource source);
[[nodiscard]] std::optional<LogZero> zero_after(const StandLog& log, SpeedSource source);

/// untared, zero_missing (time series only: a table of averaged steps was tared by its program), zero_drifted,
/// zero_scatters, negative_thrust. `tare_n` is what the import subtracts.
[[nodiscard]] std::vector<Finding> audit_zero(const StandLog& log, SpeedSource source, double tare_n);

}  // namespace kphi::fit
