#include "fit/model/table_line.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "base/error.hpp"
#include "fit/numerics/linear_regression.hpp"

namespace kphi::fit {
namespace {

bool is_zero(const CurvePoint& point) { return point.phi_deg < kSameAngleDeg; }

double anchor_of(std::span<const CurvePoint> table) {
  const auto zeros = std::ranges::count_if(table, is_zero);
  if (zeros != 1)
    throw FitError(fmt::format("line fit: {} rows at phi = 0; an anchored line starts at one k(0)", zeros));
  return std::ranges::find_if(table, is_zero)->k;
}

}  // namespace

RepeatedAngles average_repeated(std::span<const CurvePoint> table) {
  RepeatedAngles result;
  std::vector<CurvePoint> rows(table.begin(), table.end());
  std::ranges::stable_sort(rows, {}, &CurvePoint::phi_deg);
  result.weighted = std::ranges::all_of(rows, [](const auto& row) { return row.standard_error > 0; });
  std::vector<std::size_t> counts;
  double squares = 0;
  for (auto begin = rows.cbegin(), end = begin; begin != rows.cend(); begin = end) {
    while (end != rows.cend() && end->phi_deg - begin->phi_deg < kSameAngleDeg) ++end;
    const std::span<const CurvePoint> same(begin, end);
    double weights = 0, k = 0;
    for (const CurvePoint& row : same) {
      const double weight = result.weighted ? 1 / (row.standard_error * row.standard_error) : 1;
      weights += weight;
      k += weight * row.k;
    }
    k /= weights;
    for (const CurvePoint& row : same)
      if (row.k != k) squares += std::pow((row.k - k) / (result.weighted ? row.standard_error : k), 2);
    result.points.push_back({begin->phi_deg, k, result.weighted ? 1 / std::sqrt(weights) : 0});
    counts.push_back(same.size());
    if (same.size() == 1) continue;
    ++result.angles;
    result.rows += same.size();
    result.freedom += static_cast<double>(same.size() - 1);
  }
  if (result.angles == 0) return result;
  result.scatter = std::sqrt(squares / result.freedom);
  const double student = coverage_factor(result.freedom) / coverage_factor(std::numeric_limits<double>::infinity());
  for (std::size_t i = 0; i < result.points.size(); ++i) {
    CurvePoint& point = result.points[i];
    if (result.weighted)
      point.standard_error *= std::max(1.0, result.scatter);
    else
      point.standard_error = student * result.scatter * std::abs(point.k) / std::sqrt(static_cast<double>(counts[i]));
  }
  return result;
}

std::string RepeatedAngles::words() const {
  const std::string what =
      fmt::format("{} of {} angles are listed more than once, in {} rows: averaged", angles, points.size(), rows);
  if (weighted)
    return fmt::format("{}, weighted by their u, from which they scatter {:.2g} times as much", what, scatter);
  return fmt::format("{}; their scatter, {:.2g} % of k by {:g} degrees of freedom, is the error of every k", what,
                     100 * scatter, freedom);
}

std::string obstacle_to_flight(std::span<const CurvePoint> table) {
  std::vector<double> angles;
  for (const CurvePoint& point : table) angles.push_back(point.phi_deg);
  std::ranges::sort(angles);
  if (angles.empty() || angles.front() >= kSameAngleDeg) return "it has no k at phi_deg 0, which is K_T";
  if (angles.back() >= 360) return fmt::format("phi_deg {} is not below 360", angles.back());
  return std::ranges::find_if(table, is_zero)->k > 0 ? "" : "K_T, the k at phi_deg 0, is 0";
}

TableLine fit_table_line(std::span<const CurvePoint> table, bool anchored) {
  TableLine line;
  line.anchored = anchored;
  line.weighted = std::ranges::all_of(table, [](const auto& point) { return point.standard_error > 0; });
  const double start = anchored ? anchor_of(table) : 0;
  std::vector<double> phi, k, weights;
  for (const CurvePoint& point : table) {
    if (anchored && is_zero(point)) continue;
    phi.push_back(point.phi_deg);
    k.push_back(point.k - start);
    weights.push_back(line.weighted ? 1 / (point.standard_error * point.standard_error) : 1);
  }
  const Regression found = regress_polynomial(phi, k, anchored ? 1 : 0, 1, weights);
  const double freedom = static_cast<double>(found.freedom);
  const auto estimate = [&](std::size_t term) {
    return Estimate{found.estimates[term],
                    freedom > 0 ? found.standard_errors[term] : std::numeric_limits<double>::quiet_NaN(), freedom};
  };
  line.intercept = anchored ? Estimate{start, 0} : estimate(0);
  line.slope_per_deg = estimate(found.estimates.size() - 1);
  line.scatter = found.residual_deviation;
  line.points = phi.size();
  return line;
}

}  // namespace kphi::fit
