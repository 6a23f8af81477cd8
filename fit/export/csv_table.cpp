// The table per occlusion with the line beside it. phi_deg,k,u_k come first: `kphi fit` takes them again.
#include <fmt/format.h>

#include <cmath>

#include "fit/export/wording.hpp"
#include "results/number.hpp"

namespace kphi::fit {
namespace {

std::string error_of_line(const compensation::Coefficients& file, Radians phi) {
  if (!file.line.covariance) return "";
  const auto& c = *file.line.covariance;
  const double variance = c[0][0] + 2 * phi.value() * c[0][1] + phi.value() * phi.value() * c[1][1];
  return results::shortest(std::sqrt(std::max(0.0, variance)));
}

}  // namespace

Export to_csv(const compensation::Coefficients& file, const ExportOptions&) {
  using results::shortest;
  const compensation::ThrustLine line = compensation::thrust_line(file);
  Export result;
  result.text = "phi_deg,k,u_k,line_k,u_line_k,scaling_factor\n";
  for (const auto& row : file.table) {
    result.text += fmt::format(
        "{},{},{},{},{},{}\n", shortest(std::round(to_degrees(row.occlusion) * 1e9) / 1e9), shortest(row.k.value()),
        shortest(row.standard_error.value_or(ThrustCoefficient()).value()), shortest(line.at(row.occlusion).value()),
        error_of_line(file, row.occlusion), shortest(line.scaling_factor(row.occlusion)));
  }
  result.lost = {
      "units: k, u_k and line_k are in N/(rad/s)^2, a header line has no place to say so",
      "slope, covariance, validity, hashes of the runs: a table has rows only; they stay in the coefficient file"};
  return result;
}

}  // namespace kphi::fit
