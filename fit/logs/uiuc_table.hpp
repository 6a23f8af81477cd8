// Static tables of the UIUC Propeller Database: lines of RPM, CT, CP. Cite Brandt, Deters, Ananda, Dantsker, Selig.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "fit/logs/row_selection.hpp"

namespace kphi::fit {

/// The tables say nothing about the air they were measured in; the coefficients hold for any, thrust is given for this.
inline constexpr double kUiucDensityKgM3 = 1.225;

struct UiucOptions {
  std::optional<double> diameter_in{};  ///< default: nominal, from the file's name ("apcsf_10x7_static_…" is 10 inch)
  double density_kg_m3 = kUiucDensityKgM3;
};

/// The number before the first "x" that stands between two numbers of the file's name; 0 < D ≤ 60.
[[nodiscard]] std::optional<double> diameter_from_name(std::string_view file_name);

/// T = CT ρ n² D⁴, n in 1/s, D in m. Throws ConfigurationError (path:line) when a column is missing, no row is left, or
/// the diameter is neither given nor in the name.
[[nodiscard]] ImportedTable read_uiuc(std::string_view text, std::string path, const UiucOptions& options = {});

}  // namespace kphi::fit
