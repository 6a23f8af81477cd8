// Any table, told which column is what: `--column thrust="Load [g]" --column speed=rpm`.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "fit/logs/stand_log.hpp"

namespace kphi::fit {

/// What a column is taken for.
enum class Role { time, throttle, speed, electrical_speed, thrust, torque, voltage, current, occlusion, repetition };

struct ColumnRole {
  Role role{};
  std::string header;  ///< the whole header, or its part before the unit
  std::string unit;    ///< empty: as the header tells
};

/// "thrust=Load [g]", "speed=n:rpm": role, header and, behind the last ':', a unit that the header does not tell.
/// Throws ConfigurationError that lists the roles.
[[nodiscard]] ColumnRole parse_column_role(std::string_view text);

struct CsvDialect {
  char separator = 0;          ///< 0: the one of , ; tab that the header line has most of
  bool decimal_comma = false;  ///< 1,5 is one and a half
};

/// Needs a thrust and a speed. Throws ConfigurationError (path:line) when a column is missing or stands twice, its unit
/// is nowhere told, not known, or another in header and mapping. Lines whose thrust is no number are left out and
/// listed.
[[nodiscard]] StandLog read_mapped(std::string_view text, std::string path, const std::vector<ColumnRole>& columns,
                                   const CsvDialect& dialect = {});

}  // namespace kphi::fit
