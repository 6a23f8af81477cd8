// The zero of a log: what its thrust channel reads without thrust, from rows with the motor off or, without such rows,
// from thrust over ω².
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "fit/logs/log_audit.hpp"
#include "fit/logs/thrust_slope.hpp"

namespace kphi::fit {

/// What a log reads at rest, and what there is to compare it with.
struct LogRest {
  std::optional<RestRows> before, after;
  double largest_n = 0;  ///< |thrust|
  std::size_t rows = 0;
};
[[nodiscard]] LogRest rest_of(const StandLog& log, SpeedSource source);

/// What is subtracted from the thrust, and how well it is known.
struct ZeroOfLog {
  enum class Source : std::uint8_t {
    as_written,  ///< 0: nothing speaks against it
    tare_rows,   ///< as was asked for
    motor_off,   ///< rows with the motor off, which are not at 0
    fitted,      ///< the offset of thrust over ω²
    unknown,     ///< 0, but the log cannot tell: no rows with the motor off, and speeds too alike
  };
  Source source = Source::as_written;
  double zero_n = 0;
  double u_n = results::kNotMeasured;  ///< standard uncertainty; NaN: nothing is known of it
};

/// Of the rows of `table`, which were tared as `selection` asks.
[[nodiscard]] ZeroOfLog zero_of(const LogRest& rest, const ImportedTable& table, const RowSelection& selection);
/// What is found of it; empty if it is as it should be.
[[nodiscard]] std::vector<LogFinding> findings_of(const ZeroOfLog& zero, const ImportedTable& table);

/// How far the k of a fit through the origin moves for a zero that is off by 1 N, 1/(rad/s)²: Σω²/Σω⁴.
[[nodiscard]] double k_per_zero(const ImportedTable& table);

}  // namespace kphi::fit
