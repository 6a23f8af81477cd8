#include "fit/model/table_line.hpp"

#include <fmt/format.h>

#include <algorithm>
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

std::string obstacle_to_flight(std::span<const CurvePoint> table) {
  std::vector<double> angles;
  for (const CurvePoint& point : table) angles.push_back(point.phi_deg);
  std::ranges::sort(angles);
  if (angles.empty() || angles.front() >= kSameAngleDeg) return "it has no k at phi_deg 0, which is K_T";
  if (angles.back() >= 360) return fmt::format("phi_deg {} is not below 360", angles.back());
  const auto twice = std::ranges::adjacent_find(angles, [](double a, double b) { return b - a < kSameAngleDeg; });
  if (twice != angles.end()) return fmt::format("phi_deg {} is listed twice", *twice);
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
