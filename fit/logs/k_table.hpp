// A table of coefficients found elsewhere: CSV with the columns phi_deg, k and, if known, u_k.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "fit/model/line_fit.hpp"

namespace kphi::fit {

/// `k` and `u_k` (standard error) are in N/(rad/s)²; columns named `k_n_per_rpm2` and `u_k_n_per_rpm2` instead are in
/// N/RPM². Throws ConfigurationError (path:line) for a missing column, a line that does not fit, a φ outside [0, 360),
/// or a k or u_k that is no number or negative (k = 0 is allowed: a fully blocked propeller).
[[nodiscard]] std::vector<LinePoint> read_k_table(std::string_view text, std::string path);

/// True when the header line has the columns of such a table.
[[nodiscard]] bool is_k_table(std::string_view text);

}  // namespace kphi::fit
