// Any foreign table: picks the reader by the header.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "fit/rcbenchmark_csv.hpp"
#include "fit/uiuc_table.hpp"

namespace kphi::fit {

struct ImportOptions {
  RcbenchmarkSelection rows;
  std::optional<double> diameter_in{};
  std::string propeller;  ///< default: the file's name without ending
  int blades = 0;         ///< 0: not known
};

/// UIUC when the header's columns are RPM and CT, else RCbenchmark. Throws ConfigurationError (path:line).
[[nodiscard]] ImportedTable import_table(std::string_view text, const std::string& path, const ImportOptions& options);

/// "10 of 11 rows, thrust in gf, electrical speed, k = 1.1107e-06 ± 1.0e-08 N/(rad/s)^2, rms 0.0453 N". Throws
/// FitError.
[[nodiscard]] std::string summary_of(const ImportedTable& imported);

}  // namespace kphi::fit
