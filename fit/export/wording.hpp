// What the targets share: the one coefficient that a target without φ gets, and text that cannot break out of a
// comment.
#pragma once

#include <string>
#include <vector>

#include "fit/export/targets.hpp"

namespace kphi::fit {

/// K_T k_i(φ), as it flies (ScalingLaw::clamped), N/(rad/s)². Throws ConfigurationError for a φ beyond the file's.
[[nodiscard]] double coefficient_at(const compensation::Coefficients& file, double phi_deg);

/// rad/s at full output: as asked, else the file's. Throws ConfigurationError when neither is known.
[[nodiscard]] double speed_max_of(const compensation::Coefficients& file, const ExportOptions& options);

/// Control characters become blanks.
[[nodiscard]] std::string one_line(const std::string& text);

/// "5x3, Cyclone T5040C; 1.23e-06 N/(rad/s)^2 at phi = 0 deg; measured …, fitted by kphi …; 15 runs", one line each.
[[nodiscard]] std::vector<std::string> provenance_lines(const compensation::Coefficients& file);
/// Those lines, each behind `mark`.
[[nodiscard]] std::string comment(const compensation::Coefficients& file, const std::string& mark);

/// A double-quoted scalar that YAML and JSON read alike.
[[nodiscard]] std::string json_text(const std::string& text);

/// The reason why a target with one constant loses the line.
[[nodiscard]] std::string no_phi(const char* target, double phi_deg);

}  // namespace kphi::fit
