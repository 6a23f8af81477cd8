// `kphi import` of one table: picks the reader, audits what it read, and says what it found. And coefficients that
// others published: static tables of the UIUC Propeller Database (RPM, CT, CP; cite Brandt, Deters, Ananda, Dantsker,
// Selig) and tables of k over φ.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "fit/logs/k_audit.hpp"
#include "fit/logs/log_audit.hpp"
#include "fit/model/curve_fit.hpp"

namespace kphi::fit {

/// The tables do not give the air they were measured in; the coefficients hold for any, and thrust is computed for
/// this.
inline constexpr double kUiucDensityKgM3 = 1.225;

/// The number before the first "x" between two numbers in the file's name; 0 < D ≤ 60.
[[nodiscard]] std::optional<double> diameter_from_name(std::string_view file_name);

/// T = CT ρ n² D⁴, n in 1/s, D in m, by default the nominal one from the file's name ("apcsf_10x7_static_…" is 10
/// inch). Throws ConfigurationError (path:line) when a column is missing, no row is left, or the diameter is unknown.
[[nodiscard]] ImportedTable read_uiuc(TextBlocks text, std::string path, std::optional<double> diameter_in = {},
                                      double density_kg_m3 = kUiucDensityKgM3);

/// Whether the header has phi_deg and one of the columns of k.
[[nodiscard]] bool is_k_table(std::string_view text);

/// CSV with phi_deg, k and, if known, its standard error: k_n_s2_per_rad2 and u_k_n_s2_per_rad2 in N/(rad/s)², or
/// k_n_per_rpm2 and u_k_n_per_rpm2 in N/RPM², or k and u_k in `unit`, "N/(rad/s)^2" or "N/RPM^2": the paper's unit is
/// 91 times larger, so none is assumed. Throws ConfigurationError (path:line) where the unit is not known or given
/// twice, for a missing column, a line that does not fit, or a negative φ, k or u_k (k = 0 is allowed: a fully
/// blocked propeller).
[[nodiscard]] std::vector<CurvePoint> read_k_table(std::string_view text, std::string path, std::string_view unit = {});

struct ImportOptions {
  RowSelection rows;
  LayoutHints hints;
  std::optional<Layout> layout{};  ///< known, not to be found
  std::optional<double> diameter_in{};
  std::optional<double> air_density_kg_m3{};  ///< of the log; a UIUC table is computed for it
  std::string propeller;                      ///< default: the file's name without ending
  int blades = 0;                             ///< 0: unknown
};

struct Import {
  ImportedTable table;
  std::vector<LogFinding> findings;
  std::optional<Layout> layout{};  ///< not of a UIUC table
  std::string group{};             ///< "5x3, reverse"; empty: the only one
};

/// UIUC when the header's columns are RPM and CT, else a table of any make; one import for each of its groups of rows.
/// Two speeds at a ratio other than 1 need a decision: without `rows.speed` such a table throws FitError. Throws
/// ConfigurationError (path:line).
[[nodiscard]] std::vector<Import> import_groups(TextBlocks text, const std::string& path, const ImportOptions& options);
/// Of a table with one group; throws FitError for several.
[[nodiscard]] Import import_table(TextBlocks text, const std::string& path, const ImportOptions& options);

/// "10 of 11 rows, thrust in gf, electrical speed, k = 1.1107e-06 ± 1.0e-08 N/(rad/s)^2, rms 0.0453 N"; k of each
/// occlusion.
[[nodiscard]] std::string summary_of(const ImportedTable& imported, const std::vector<OcclusionFit>& fits);

/// One k for the table means nothing.
[[nodiscard]] bool spoilt(const Import& import, const JudgedFit& judged);

/// import.json: the source with its hash, what was asked, what was taken, and every finding.
[[nodiscard]] std::string import_record(const Import& import, const JudgedFit& judged, const std::string& sha256,
                                        const std::string& path, const ImportOptions& options,
                                        const std::string& tool_version);

}  // namespace kphi::fit
