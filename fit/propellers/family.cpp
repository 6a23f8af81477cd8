#include "fit/propellers/family.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "fit/numerics/linear_regression.hpp"

namespace kphi::fit {
namespace {

struct Row {
  std::size_t member = 0;
  double phi_deg = 0;
  Estimate k;
};

/// From the air of its day to the common air.
double scale_of(const Identification& one, Air air) {
  return air == Air::standard && one.air ? kStandardDensity / one.air->value : 1;
}

std::vector<Row> occluded_rows(std::span<const Fitted* const> members, Air air) {
  std::vector<Row> rows;
  for (std::size_t j = 0; j < members.size(); ++j) {
    const Identification& one = members[j]->identification;
    const double scale = scale_of(one, air);
    for (const OcclusionCoefficient& row : one.table) {
      if (row.phi_deg > 0 && row.standard_error > 0)
        rows.push_back({j, row.phi_deg, {scale * row.k, scale * row.standard_error}});
    }
  }
  return rows;
}

double freedom_of(std::span<const Fitted* const> members) {
  double sum = 0;
  for (const Fitted* member : members) sum += member->identification.repeatability.freedom();
  return sum;
}

/// From the errors common to all coefficients of a campaign; the largest of the members.
double common_u_of_slope(std::span<const Fitted* const> members) {
  double largest = 0;
  for (const Fitted* member : members) {
    double squares = 0;
    for (const BudgetRow& row : member->analysis.line.slope.rows)
      squares += row.common ? row.contribution() * row.contribution() : 0;
    largest = std::max(largest, std::sqrt(squares));
  }
  return largest;
}

Regression fit_lines(const std::vector<Row>& rows, std::size_t members, bool shared) {
  std::vector<std::vector<double>> design;
  std::vector<double> k, weights;
  for (const Row& row : rows) {
    std::vector<double> terms(shared ? members + 1 : 2 * members);
    terms[row.member] = 1;
    terms[shared ? members : members + row.member] = row.phi_deg;
    design.push_back(std::move(terms));
    k.push_back(row.k.value);
    weights.push_back(1 / (row.k.u * row.k.u));
  }
  return regress(design, k, weights);
}

}  // namespace

double SharedSlope::expanded() const { return coverage_factor(slope.freedom) * std::hypot(slope.u, common_u); }

Air common_air(std::span<const Fitted> family) {
  const bool known = std::ranges::all_of(
      family, [](const Fitted& member) { return member.identification.air && !member.analysis.standard.empty(); });
  return known ? Air::standard : Air::measured;
}

std::vector<SharedSlope> shared_slopes(std::span<const Fitted> family) {
  const Air air = common_air(family);
  std::map<double, std::vector<const Fitted*>> by_diameter;
  for (const Fitted& member : family) by_diameter[member.identification.diameter_in].push_back(&member);
  std::vector<SharedSlope> result;
  for (const auto& [diameter, members] : by_diameter) {
    const std::vector<Row> rows = occluded_rows(members, air);
    const std::size_t n = members.size();
    if (n < 2 || rows.size() < 2 * n) continue;
    const Regression shared = fit_lines(rows, n, true), own = fit_lines(rows, n, false);
    const double freedom = freedom_of(members);
    SharedSlope one;
    one.diameter_in = diameter;
    for (const Fitted* member : members) one.propellers.push_back(member->identification.propeller);
    one.slope = {shared.estimates[n], std::sqrt(shared.covariance[n][n]), freedom};
    one.common_u = common_u_of_slope(members);
    const double extra = static_cast<double>(n - 1);
    one.equal_slopes = f_test(std::max(0.0, shared.weighted_squares - own.weighted_squares) / extra, extra, freedom);
    one.equal_slopes.name = "slopes of one diameter";
    one.equal_slopes.hypothesis = "all are the same";
    result.push_back(std::move(one));
  }
  return result;
}

std::optional<FamilyPrediction> predict(std::span<const Fitted> family, double diameter_in, int blades,
                                        double phi_deg) {
  std::set<int> blade_numbers;
  for (const Fitted& member : family) blade_numbers.insert(member.identification.blades);
  const bool by_blades = blade_numbers.size() > 1;
  const Air air = common_air(family);
  const auto terms_at = [&](int b, double phi) {
    std::vector<double> terms{1};
    if (by_blades) terms.push_back(b);
    if (phi_deg > 0) terms.push_back(phi / 360);
    return terms;
  };
  std::vector<std::vector<double>> design;
  std::vector<double> reduced;  // k/D⁴
  std::vector<std::size_t> owner;
  for (std::size_t j = 0; j < family.size(); ++j) {
    const Identification& one = family[j].identification;
    for (const OcclusionCoefficient& row : one.table) {
      if ((row.phi_deg > 0) != (phi_deg > 0)) continue;
      design.push_back(terms_at(one.blades, row.phi_deg));
      reduced.push_back(scale_of(one, air) * row.k / std::pow(one.diameter_in, 4));
      owner.push_back(j);
    }
  }
  const double freedom = static_cast<double>(family.size()) - (by_blades ? 2 : 1);
  if (freedom < 1 || family.size() < 3) return std::nullopt;
  const Regression fit = regress(design, reduced);
  // Points of one propeller deviate from the rule together, so each propeller counts once.
  std::vector<double> squares(family.size()), counts(family.size());
  for (std::size_t i = 0; i < owner.size(); ++i) {
    squares[owner[i]] += fit.residuals[i] * fit.residuals[i];
    ++counts[owner[i]];
  }
  double variance = 0;
  for (std::size_t j = 0; j < family.size(); ++j) variance += counts[j] > 0 ? squares[j] / counts[j] / freedom : 0;
  const std::vector<double> at = terms_at(blades, phi_deg);
  double value = 0, leverage = 0;
  const double points_each = static_cast<double>(owner.size()) / static_cast<double>(family.size());
  for (std::size_t i = 0; i < at.size(); ++i) {
    value += at[i] * fit.estimates[i];
    for (std::size_t j = 0; j < at.size(); ++j) leverage += at[i] * at[j] * fit.covariance[i][j] * points_each;
  }
  const double scale = std::pow(diameter_in, 4);
  const Estimate k{value * scale, scale * std::sqrt(variance * (1 + leverage)), freedom};
  const double half = coverage_factor(freedom) * k.u;
  return FamilyPrediction{diameter_in, blades, phi_deg, k, k.value - half, k.value + half};
}

}  // namespace kphi::fit
