#include "fit/uncertainty_block.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>

#include "results/number.hpp"

namespace kphi::fit {
namespace {

std::string number(double value) { return std::isfinite(value) ? results::yaml_number(value) : "unknown"; }

std::string number(const std::optional<double>& value) { return value ? number(*value) : "none"; }

std::string errors(const Budget& budget) {
  return fmt::format("{{u: {}, freedom: {}, expanded_95: {}}}", number(budget.combined()),
                     std::isfinite(budget.freedom()) ? number(budget.freedom()) : ".inf", number(budget.expanded()));
}

std::string matrix(const std::vector<std::vector<double>>& rows) {
  std::vector<std::string> lines;
  for (const auto& row : rows) {
    std::vector<std::string> numbers;
    for (const double value : row) numbers.push_back(number(value));
    lines.push_back(fmt::format("[{}]", fmt::join(numbers, ", ")));
  }
  return fmt::format("[{}]", fmt::join(lines, ", "));
}

std::vector<std::string> not_known(const Budget& budget) {
  std::vector<std::string> names;
  for (const BudgetRow& row : budget.rows)
    if (!row.known()) names.push_back(row.source);
  return names;
}

}  // namespace

std::string format_uncertainty(const Analysis& analysis) {
  std::string text = "uncertainty:  # standard uncertainties by the GUM; expanded: 95 %\n";
  text += fmt::format("  K_T: {}\n", errors(analysis.coefficients.front()));
  text += fmt::format("  intercept: {}\n  slope_per_deg: {}\n", errors(analysis.intercept), errors(analysis.slope));
  text += fmt::format("  covariance: {}  # of K_T, intercept, slope_per_deg\n", matrix(analysis.covariance));
  text += fmt::format("  not_known: [{}]  # sources that the sums lack\n",
                      fmt::join(not_known(analysis.coefficients.front()), ", "));
  text += "  table:\n";
  for (const Budget& budget : analysis.coefficients)
    text += fmt::format("    - {{quantity: {}, u: {}, expanded_95: {}}}\n", budget.quantity, number(budget.combined()),
                        number(budget.expanded()));
  text += fmt::format("  line: {{clipping_deg: {}, zero_deg: {}, intercept_minus_K_T: {}, u: {}}}\n",
                      number(analysis.shape.clipping_deg), number(analysis.shape.zero_deg),
                      number(analysis.shape.mismatch.value), number(analysis.shape.mismatch.u));
  text += fmt::format("  line_lack_of_fit_p: {}\n  line_quadratic_p: {}\n", number(analysis.curvature.lack_of_fit.p),
                      number(analysis.curvature.quadratic.p));
  if (!analysis.speed.empty()) text += "  speed:\n";
  for (const SpeedDependence& one : analysis.speed)
    text += fmt::format("    - {{phi_deg: {}, change_share: {}, u: {}, lack_of_fit_p: {}}}\n", number(one.phi_deg),
                        number(one.change.value), number(one.change.u), number(one.lack_of_fit.p));
  text += fmt::format("  rejected_points: {}\n  outlying_runs: {}  # kept\n", analysis.rejected.size(),
                      analysis.outlying.size());
  if (analysis.torque.empty()) return text;
  text += "torque:  # N m/(rad/s)^2, by the estimators of the thrust\n";
  for (const TorqueCoefficient& one : analysis.torque)
    text += fmt::format("  - {{phi_deg: {}, k_q: {}, u: {}, drag_per_thrust_m: {}}}\n", number(one.phi_deg),
                        number(one.k_q.value), number(one.k_q.u), number(one.drag_per_thrust_m.value));
  return text;
}

}  // namespace kphi::fit
