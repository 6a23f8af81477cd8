// What the steps cannot tell of their own errors: standard uncertainties of the stand, by whoever calibrated it. An
// entry that nobody gave stays unknown: its row stands in the budget, empty, and is not taken for zero in words.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace kphi::fit {

struct BenchUncertainty {
  std::optional<double> cell_calibration;  ///< relative, of the load cell's sensitivity
  std::optional<double> cross_axis;        ///< relative to the thrust, what other loads make the cell read
  std::optional<double> alignment_rad;     ///< between thrust and the cell's axis
  std::optional<double> motor_clock;       ///< relative, of the clock by which the module tells its speed
  std::optional<double> air_density;       ///< relative; enters k in standard air only
};

/// "NAME=VALUE" with NAME one of calibration, cross-axis, alignment-deg, clock, density. Throws ConfigurationError.
void set_uncertainty(BenchUncertainty& bench, const std::string& text);

/// NAME and VALUE of those that are known; set_uncertainty takes them back.
[[nodiscard]] std::vector<std::pair<std::string, double>> known_uncertainties(const BenchUncertainty& bench);

}  // namespace kphi::fit
