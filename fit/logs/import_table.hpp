// `kphi import` of one table: picks the reader, audits what it read, and says what it found.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "fit/logs/log_audit.hpp"

namespace kphi::fit {

struct ImportOptions {
  RowSelection rows;
  std::vector<ColumnRole> columns;  ///< given: a table of any make
  CsvDialect dialect;               ///< of such a table
  std::optional<double> diameter_in{};
  std::optional<double> air_density_kg_m3{};  ///< of a UIUC table
  std::string propeller;                      ///< default: the file's name without ending
  int blades = 0;                             ///< 0: unknown
};

struct Import {
  ImportedTable table;
  std::vector<LogFinding> findings;
};

/// As the columns say, or UIUC when the header's columns are RPM and CT, else RCbenchmark. Two speeds at a ratio other
/// than 1 need a decision: without `rows.speed` such a table throws FitError. Throws ConfigurationError (path:line).
[[nodiscard]] Import import_table(std::string_view text, const std::string& path, const ImportOptions& options);

/// "10 of 11 rows, thrust in gf, electrical speed, k = 1.1107e-06 ± 1.0e-08 N/(rad/s)^2, rms 0.0453 N". Throws
/// FitError.
[[nodiscard]] std::string summary_of(const ImportedTable& imported);

/// import.json: the source with its hash, what was asked, what was taken, and every finding.
[[nodiscard]] std::string import_record(const Import& import, std::string_view text, const std::string& path,
                                        const ImportOptions& options, const std::string& tool_version);

}  // namespace kphi::fit
