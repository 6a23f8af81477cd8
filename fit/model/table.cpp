// The table k(φ): K_T, and one k for each occlusion, straight between them; for a propeller whose k(φ) is not a line.
// k falls or stays: where noise makes it rise, neighbours share their weighted mean (isotonic regression: Barlow et
// al., Statistical Inference under Order Restrictions, 1972), and none is above K_T. Between them: science.md, eq. 22.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "base/number.hpp"
#include "compensation/occlusion_table.hpp"
#include "fit/model/curve_fit.hpp"

namespace kphi::fit {
namespace {

/// Neighbours that share one k.
struct Pool {
  std::size_t first = 0, last = 0;  ///< of the points that carry the fit
  double weight = 0, k = 0;
};

double weight_of(const CurveFit& fit, std::size_t i) { return 1 / (fit.sigmas[i] * fit.sigmas[i]); }

/// With a k that falls from each to the next.
std::vector<Pool> pools_of(const CurveFit& fit) {
  std::vector<Pool> pools;
  for (std::size_t i = 0; i < fit.points.size(); ++i) {
    if (fit.points[i].phi_deg < kSameAngleDeg) continue;  // K_T is given
    pools.push_back({i, i, weight_of(fit, i), fit.points[i].k});
    while (pools.size() > 1 && pools.back().k >= pools[pools.size() - 2].k) {
      const Pool right = pools.back();
      pools.pop_back();
      Pool& left = pools.back();
      const double weight = left.weight + right.weight;
      left = {left.first, right.last, weight, (left.k * left.weight + right.k * right.weight) / weight};
    }
  }
  return pools;
}

/// Of the k that the pool has, over `all` points; the first of these is K_T.
std::vector<double> weights_of(const Pool& pool, const CurveFit& fit, std::span<const CurvePoint> all) {
  std::vector<double> weights(all.size());
  if (pool.k >= fit.K_T) {
    weights.front() = 1;
    return weights;
  }
  for (std::size_t i = pool.first; i <= pool.last; ++i) {
    for (std::size_t j = 0; j < all.size(); ++j)
      if (std::abs(all[j].phi_deg - fit.points[i].phi_deg) < kSameAngleDeg)
        weights[j] = weight_of(fit, i) / pool.weight;
  }
  return weights;
}

CurveParameter knot(double phi_deg, double k, std::vector<double> weights) {
  CurveParameter parameter{fmt::format("k({})", yaml_number(phi_deg)), fmt::format("k({} deg)", shortest(phi_deg)), "",
                           k, std::move(weights)};
  parameter.at_deg = phi_deg;
  return parameter;
}

class TableModel final : public CurveModel {
 public:
  const char* name() const override { return "table"; }
  const char* denial() const override { return "k(φ) rises"; }
  bool anchored(bool) const override { return true; }
  std::size_t least_points(bool) const override { return 1; }
  std::size_t most_points() const override { return compensation::kMostKnots - 1; }
  std::size_t terms(const CurveFit& table) const override {
    return pools_of(table).size() + (table.points.front().phi_deg < kSameAngleDeg ? 1 : 0);
  }
  bool may_miss(const CurveFit& table, double) const override { return table.spare_points() > 0; }
  std::string words(const CurveFit& table) const override {
    return fmt::format("table of {} angles, from K_T", table.parameters.size());
  }

  std::vector<CurveParameter> parameters(const CurveFit& fit, std::span<const CurvePoint> all) const override {
    std::vector<double> of_K_T(all.size());
    of_K_T.front() = 1;
    std::vector<CurveParameter> knots{knot(0, fit.K_T, of_K_T)};
    for (const Pool& pool : pools_of(fit)) {
      for (std::size_t i = pool.first; i <= pool.last; ++i)
        knots.push_back(knot(fit.points[i].phi_deg, std::min(pool.k, fit.K_T), weights_of(pool, fit, all)));
    }
    return knots;
  }

  std::vector<double> basis(const CurveFit& table, double phi_deg) const override {
    const auto& knots = table.parameters;
    std::size_t i = 0;
    while (i + 2 < knots.size() && phi_deg >= *knots[i + 1].at_deg) ++i;
    const double share = (phi_deg - *knots[i].at_deg) / (*knots[i + 1].at_deg - *knots[i].at_deg);
    std::vector<double> basis(knots.size());
    basis[i] = 1 - share;
    basis[i + 1] = share;
    return basis;
  }

  double first_fitted_deg(const CurveFit&) const override { return 0; }

  std::optional<double> falls_to(const CurveFit& table, double k) const override {
    const auto& knots = table.parameters;
    for (std::size_t i = 1; i < knots.size(); ++i) {
      const double from = knots[i - 1].value, to = knots[i].value;
      const bool last = i + 1 == knots.size();
      if (!(to < from) || (k < to && !last)) continue;
      return *knots[i - 1].at_deg + (from - k) / (from - to) * (*knots[i].at_deg - *knots[i - 1].at_deg);
    }
    return std::nullopt;
  }

  Curvature tested(const CurveFit& table, double freedom) const override {
    Curvature result;
    double squares = 0, spare = table.spare_points();
    bool known = spare > 0;
    for (std::size_t i = 0; i < table.points.size(); ++i) {
      known = known && table.points[i].standard_error > 0;
      squares += std::pow(table.residuals[i] / table.points[i].standard_error, 2);
    }
    if (known) result.lack_of_fit = f_test(squares / spare, spare, freedom);
    result.lack_of_fit.name = "rise of k(phi)";
    result.lack_of_fit.hypothesis = "k(phi) does not rise";
    result.lack_of_fit.statistic = "F";
    return result;
  }

  std::vector<std::string> remarks(const CurveFit& table, const Estimate&, double largest_deg) const override {
    std::vector<std::string> remarks;
    const double last = *table.parameters.back().at_deg;
    if (const auto shared = static_cast<int>(table.spare_points()); shared > 0)
      remarks.push_back(fmt::format("k rises between neighbours: {} of {} angles share a k with theirs", shared + 1,
                                    table.parameters.size()));
    if (!table.zero_crossing_deg())
      remarks.push_back(
          "the table does not fall with phi: either the occlusion costs no thrust or the runs were "
          "mixed up");
    if (largest_deg > last + kSameAngleDeg)
      remarks.push_back(fmt::format("beyond {}° the table goes on as before it", shortest(last)));
    return remarks;
  }

  std::optional<compensation::ThrustCurve> flown(const CurveFit& table, Radians largest,
                                                 compensation::OverlapMeasure overlap) const override {
    std::vector<compensation::Knot> knots;
    for (const CurveParameter& one : table.parameters) knots.push_back({from_degrees(*one.at_deg), one.value});
    const auto k = compensation::OcclusionTable::from(knots.data(), knots.size());
    return k ? compensation::ThrustCurve::from_table(*k, largest, overlap) : std::nullopt;
  }
};

}  // namespace

const CurveModel& table_model() {
  static const TableModel model;
  return model;
}

}  // namespace kphi::fit
