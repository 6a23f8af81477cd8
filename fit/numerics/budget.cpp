#include "fit/numerics/budget.hpp"

#include <cmath>

namespace kphi::fit {

double BudgetRow::contribution() const { return known() ? std::abs(sensitivity) * u : 0; }

double Budget::combined() const {
  double squares = 0;
  for (const BudgetRow& row : rows) squares += std::pow(row.contribution(), 2);
  return std::sqrt(squares);
}

double Budget::freedom() const {
  double spread = 0;
  for (const BudgetRow& row : rows) spread += std::pow(row.contribution(), 4) / row.freedom;
  return spread > 0 ? std::pow(combined(), 4) / spread : std::numeric_limits<double>::infinity();
}

double Budget::coverage(double level) const { return coverage_factor(freedom(), level); }

double Budget::expanded(double level) const { return coverage(level) * combined(); }

double Budget::share(const BudgetRow& row) const {
  const double whole = combined();
  return whole > 0 ? std::pow(row.contribution() / whole, 2) : 0;
}

}  // namespace kphi::fit
