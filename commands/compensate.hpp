// The work behind `kphi compensate`: rows of arm angles and thrusts in, rows of φ, k_i and speeds out.
#pragma once

#include <cstdint>
#include <iosfwd>

#include "compensation/compensator.hpp"

namespace kphi::commands {

enum class RowFormat { csv, json_lines };
/// How a row tells the shape: by angles of arms, or by places of hubs.
enum class RowShape { arms, hubs };

struct RowCounts {
  std::uint64_t written = 0;
  std::uint64_t rejected = 0;
  std::uint64_t out_of_reach = 0;  ///< of those written: with an arm angle or a hub that cannot be
};

/// Reads CSV with a header naming theta1_deg, theta2_deg and so on, or hub1_x_m, hub1_y_m and so on, and thrust1_n and
/// so on, for each rotor of the compensator, in any order; other columns are ignored. Writes phi1_deg.., k1..,
/// speed1_rpm.., flags as CSV, or one JSON object per line, numbers in shortest round trip. A flag reads "rotor:what",
/// several are separated by a blank. A row that cannot be used is left out, counted, and told on `words` with its line
/// number. A row with an arm angle outside the airframe's limits is flagged and counted. Output is handed on whenever
/// no further input waits, so that it can stand in a pipe. Throws ConfigurationError for a header that does not name
/// all of them.
[[nodiscard]] RowCounts compensate_rows(std::istream& in, std::ostream& out, std::ostream& words,
                                        compensation::Compensator& compensator, RowFormat format,
                                        RowShape shape = RowShape::arms);

}  // namespace kphi::commands
