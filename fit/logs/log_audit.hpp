// The whole judgement of a foreign log.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "fit/logs/row_selection.hpp"
#include "fit/logs/stand_log.hpp"

namespace kphi::fit {

/// Everything found, in the order of FindingKind's families: speeds, zero, series, lines. Judges the speed that
/// `selection` takes and the tare that it asks for.
[[nodiscard]] std::vector<Finding> audit(const StandLog& log, const RowSelection& selection);

/// Sets the flags of the steps whose rows are concerned: a wrong speed or frozen thrust spoils a step, a supply at its
/// limit does not (T = k ω² still holds).
void flag_steps(ImportedTable& table, const std::vector<Finding>& findings);

struct NamedCoefficient {
  std::string name;
  double k = 0;
};

/// Among files of one propeller: those whose k is further from the median than four robust standard deviations
/// (1.4826 MAD) and 5 %. Needs five files.
struct GroupOutlier {
  std::string name;
  double share = 0;      ///< k / median − 1
  double robust_sd = 0;  ///< of the group, as a share of its median
};
[[nodiscard]] std::vector<GroupOutlier> group_outliers(std::span<const NamedCoefficient> group);

}  // namespace kphi::fit
