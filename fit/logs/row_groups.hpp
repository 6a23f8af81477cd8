// Rows of one table that are different things: of several propellers, motors or directions by a column, of two
// directions of thrust by the sign of speed or thrust, of several supplies by a nominal voltage. One k holds for one of
// them.
#pragma once

#include <string>
#include <vector>

#include "fit/logs/log_audit.hpp"

namespace kphi::fit {

struct RowGroup {
  std::string name;  ///< "5x3, reverse"; empty: the table has one group
  StandLog log;
  bool turned = false;  ///< speed or thrust had the other sign and was turned
};

struct RowGroups {
  std::vector<RowGroup> groups;
  std::vector<LogFinding> findings;  ///< why there are several
};

/// `selection` tells which speed counts. Groups without a row that turns are left out.
[[nodiscard]] RowGroups split_groups(StandLog log, const RowSelection& selection);

/// Lines of rows whose T/ω² lies on one of two levels at the same speeds.
struct TwoLevels {
  double k[2]{};
  std::size_t rows[2]{};
  std::size_t first_line[2]{}, last_line[2]{};
  [[nodiscard]] std::string words() const;
};
/// nullopt: T/ω² has one level, or none.
[[nodiscard]] std::optional<TwoLevels> two_levels(const ImportedTable& table);

}  // namespace kphi::fit
