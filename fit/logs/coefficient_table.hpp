// Coefficients that others published: static tables of the UIUC Propeller Database (RPM, CT, CP; cite Brandt, Deters,
// Ananda, Dantsker, Selig) and tables of k over φ.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "fit/logs/row_selection.hpp"
#include "fit/model/line_fit.hpp"

namespace kphi::fit {

/// Whether the header's columns are RPM and CT.
[[nodiscard]] bool is_uiuc(std::string_view text);

/// The tables do not give the air they were measured in; the coefficients hold for any, and thrust is computed for
/// this.
inline constexpr double kUiucDensityKgM3 = 1.225;

struct UiucOptions {
  std::optional<double> diameter_in{};  ///< default: nominal, from the file's name ("apcsf_10x7_static_…" is 10 inch)
  double density_kg_m3 = kUiucDensityKgM3;
};

/// The number before the first "x" between two numbers in the file's name; 0 < D ≤ 60.
[[nodiscard]] std::optional<double> diameter_from_name(std::string_view file_name);

/// T = CT ρ n² D⁴, n in 1/s, D in m. Throws ConfigurationError (path:line) when a column is missing, no row is left, or
/// the diameter is unknown.
[[nodiscard]] ImportedTable read_uiuc(std::string_view text, std::string path, const UiucOptions& options = {});

/// Whether the header has the columns phi_deg and k (or k_n_per_rpm2).
[[nodiscard]] bool is_k_table(std::string_view text);

/// CSV with phi_deg, k and, if known, its standard error u_k, in N/(rad/s)²; `k_n_per_rpm2` and `u_k_n_per_rpm2`
/// instead are in N/RPM². Throws ConfigurationError (path:line) for a missing column, a line that does not fit, a φ
/// outside [0, 360), or a negative k or u_k (k = 0 is allowed: a fully blocked propeller).
[[nodiscard]] std::vector<LinePoint> read_k_table(std::string_view text, std::string path);

}  // namespace kphi::fit
