// Thrust at rest and over ω²: rows with the motor off, and the straight line through all others, whose slope tells the
// sign of the channel whatever its zero is.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "fit/logs/stand_log.hpp"
#include "fit/model/thrust_fit.hpp"

namespace kphi::fit {

/// Rows with the motor off at one end of a log.
struct RestRows {
  double mean_n = 0;
  double sd_n = 0;
  std::size_t rows = 0;

  [[nodiscard]] double u_mean() const { return sd_n / std::sqrt(static_cast<double>(rows)); }
  /// Their mean is known to worse than 1 % of the largest thrust.
  [[nodiscard]] bool scatters(double largest_n) const { return u_mean() > 0.01 * largest_n; }
  /// "-4.104 N before (252 rows, sd 0.004 N)"
  [[nodiscard]] std::string words(const char* when) const;
};
/// Up to the first row that turns, from the begin or from the end; nullopt with fewer than 10 rows.
[[nodiscard]] std::optional<RestRows> rest_before(const StandLog& log, SpeedSource source);
[[nodiscard]] std::optional<RestRows> rest_after(const StandLog& log, SpeedSource source);

/// A table with fewer rows is one of averaged steps, which the stand's program tared.
inline constexpr std::size_t kRowsOfASeries = 50;

/// T = k x + offset, x = ω².
struct ThrustLine {
  double k = 0, offset = 0, u_offset = 0, squares = 0;  ///< squares: of the residuals
  double correlation = 0;
};

[[nodiscard]] ThrustLine line_through(const std::vector<Point>& points);

/// Whether thrust falls with ω², is only below 0 at one speed, or does neither.
enum class ThrustSign : std::uint8_t { rises, falls, cannot_tell };
[[nodiscard]] ThrustSign sign_of(const std::vector<Point>& points);

}  // namespace kphi::fit
