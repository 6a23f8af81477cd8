// The line k(φ) = intercept + slope φ.
//
// By default it goes freely through the occluded points, φ > 0, and K_T = k(0) is separate. φ = 0 is not collinear with
// them: the paper's own numbers (1, 0.90 at 45°, 0.25 at 270°) have slope −0.22 %/° up to 45° and −0.29 %/° beyond, so
// a line pulled to K_T would miss every occluded point. Anchored, the line starts at K_T: k does not jump at first
// contact, but the residual is larger. science.md, eq. 19 and 20.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "base/error.hpp"
#include "fit/model/curve_fit.hpp"
#include "fit/numerics/least_squares.hpp"
#include "fit/numerics/linear_regression.hpp"

namespace kphi::fit {
namespace {

/// One point over its error: residual = k − intercept − slope φ.
struct LineEquation {
  double one = 0, phi = 0, k = 0;

  template <class Scalar>
  bool operator()(const Scalar* intercept, const Scalar* slope, Scalar* residual) const {
    residual[0] = k - one * *intercept - phi * *slope;
    return true;
  }
};

/// Fits by Ceres. φ and k are divided by the largest of the points: k of about 1e-6 becomes about 1, so that tolerances
/// mean digits. Residuals are in σ, which a loss is scaled by.
class LineFitter {
 public:
  explicit LineFitter(const CurveFit& fit) : fit_(fit), k_unit_(std::abs(fit.K_T)) {
    for (const CurvePoint& point : fit.points) {
      phi_unit_ = std::max(phi_unit_, std::abs(point.phi_deg));
      k_unit_ = std::max(k_unit_, std::abs(point.k));
    }
    for (std::size_t i = 0; i < fit.points.size(); ++i) {
      const double one = k_unit_ / fit.sigmas[i];
      equations_.push_back({one, one * fit.points[i].phi_deg / phi_unit_, fit.points[i].k / fit.sigmas[i]});
    }
    if (fit.anchored) intercept_ = fit.K_T / k_unit_;
    solve_least_squares();
    if (fit.loss != Loss::none) solve_under_loss();
  }

  [[nodiscard]] double intercept() const { return fit_.anchored ? fit_.K_T : intercept_ * k_unit_; }
  [[nodiscard]] double slope_per_deg() const { return slope_ * k_unit_ / phi_unit_; }

  /// Of intercept and slope over `all`: covariance · Jᵀ · W, from Ceres' covariance.
  [[nodiscard]] std::array<std::vector<double>, 2> weights(std::span<const CurvePoint> all) const {
    std::array<std::vector<double>, 2> result{std::vector<double>(all.size()), std::vector<double>(all.size())};
    auto& [intercept, slope] = result;
    const auto place = [&](double phi_deg) {
      return static_cast<std::size_t>(
          std::ranges::find_if(
              all, [&](const CurvePoint& point) { return std::abs(point.phi_deg - phi_deg) < kSameAngleDeg; }) -
          all.begin());
    };
    for (std::size_t i = 0; i < equations_.size(); ++i) {
      const LineEquation& point = equations_[i];
      const std::size_t j = place(fit_.points[i].phi_deg);
      if (!fit_.anchored) intercept[j] = (covariance_[0] * point.one + covariance_[1] * point.phi) * point.one;
      const double of_slope = (covariance_[2] * point.one + covariance_[3] * point.phi) * point.one / phi_unit_;
      slope[j] += of_slope;
      if (fit_.anchored) slope[place(0)] -= of_slope;  // each k counts by its distance from K_T
    }
    if (fit_.anchored) intercept[place(0)] = 1;
    return result;
  }

 private:
  [[nodiscard]] ceres::Problem problem_under(ceres::LossFunction* loss) {
    ceres::Problem problem(problem_options());
    for (const LineEquation& equation : equations_) {
      problem.AddResidualBlock(new ceres::AutoDiffCostFunction<LineEquation, 1, 1, 1>(new LineEquation(equation)), loss,
                               &intercept_, &slope_);
    }
    if (fit_.anchored) problem.SetParameterBlockConstant(&intercept_);
    return problem;
  }

  void solve_least_squares() {
    // From far off: where a start is almost right, the cost cannot tell the last five digits apart.
    if (!fit_.anchored) intercept_ = 0;
    slope_ = 0;
    ceres::Problem squares = problem_under(nullptr);
    solve_exactly(squares, "line fit");
    // Row by row; an intercept that is given has no error.
    if (fit_.anchored)
      covariance_ = {0, 0, 0, unit_covariance(squares, {&slope_}, "line fit").front()};
    else
      std::ranges::copy(unit_covariance(squares, {&intercept_, &slope_}, "line fit"), covariance_.begin());
  }

  /// From the least squares by Huber's convex loss to the one asked for; at last the least squares with the weights
  /// that it gave the points, so that the line is a linear function of their k and has its covariance.
  void solve_under_loss() {
    for (const Loss loss : {Loss::huber, fit_.loss}) {
      const auto function = loss_function(loss, 1);
      ceres::Problem robust = problem_under(function.get());
      solve_robustly(robust, "line fit");
    }
    const std::vector<LineEquation> plain = equations_;
    // What Ceres' tolerance of the cost leaves open; each round takes some of it.
    constexpr int kMostRounds = 100;
    constexpr double kSameWeight = 1e-12;
    std::vector<double> weights(plain.size());
    double change = 1;
    for (int round = 0; round < kMostRounds && change > kSameWeight; ++round) {
      std::size_t left = 0;
      change = 0;
      for (std::size_t i = 0; i < plain.size(); ++i) {
        const auto& [one, phi, k] = plain[i];
        const double weight = robust_weight(fit_.loss, k - one * intercept_ - phi * slope_);
        change = std::max(change, std::abs(weight - std::exchange(weights[i], weight)));
        if (weight > kIgnoredWeight) ++left;
        const double root = std::sqrt(weight);
        equations_[i] = {root * one, root * phi, root * k};
      }
      if (left < plain.size() && left <= (fit_.anchored ? 1 : 2))
        throw FitError(
            fmt::format("line fit: the {} loss rejects all but {} of {} points: k(phi) is not a line within the "
                        "errors of k; fit a table, or with --curve-loss huber",
                        name_of(fit_.loss), left, plain.size()));
      solve_least_squares();
    }
  }

  static constexpr double kIgnoredWeight = 1e-3;

  const CurveFit& fit_;
  double phi_unit_ = 0, k_unit_ = 0;
  std::vector<LineEquation> equations_;
  double intercept_ = 0, slope_ = 0;
  std::array<double, 4> covariance_{};
};

class LineModel final : public CurveModel {
 public:
  const char* name() const override { return "line"; }
  const char* denial() const override { return "k(φ) is not a line"; }
  const char* remedy() const override { return "; if they are right, fit a table (--form table)"; }
  std::size_t least_points(bool anchored) const override { return anchored ? 1 : 2; }
  bool can_have_loss() const override { return true; }
  std::size_t terms(const CurveFit& line) const override { return line.anchored ? 1 : 2; }
  bool may_miss(const CurveFit& line, double phi_deg) const override { return phi_deg > 0 || !line.anchored; }
  std::vector<double> basis(const CurveFit&, double phi_deg) const override { return {1, phi_deg}; }
  std::string words(const CurveFit& line) const override {
    return fmt::format("line, {}{}", line.anchored ? "anchored at K_T" : "free",
                       line.loss == Loss::none ? "" : fmt::format(", {} loss", name_of(line.loss)));
  }

  std::vector<CurveParameter> parameters(const CurveFit& fit, std::span<const CurvePoint> all) const override {
    const LineFitter fitter(fit);
    auto [intercept, slope] = fitter.weights(all);
    return {{"intercept", "intercept", "", fitter.intercept(), std::move(intercept)},
            {"slope_per_deg", "slope", "/deg", fitter.slope_per_deg(), std::move(slope)}};
  }

  double first_fitted_deg(const CurveFit& line) const override {
    return line.anchored ? 0 : line.points.front().phi_deg;
  }

  std::optional<double> falls_to(const CurveFit& line, double k) const override {
    const double slope = line.value("slope_per_deg");
    return slope < 0 ? std::optional((k - line.k_at(0)) / slope) : std::nullopt;
  }

  Curvature tested(const CurveFit& line, double freedom) const override {
    std::vector<CurvePoint> points = line.points;
    if (line.anchored && points.front().phi_deg != 0)
      points.insert(points.begin(), {0, line.K_T, line.K_T_standard_error});
    return curvature(points, freedom);
  }

  std::vector<std::string> remarks(const CurveFit& line, const Estimate& mismatch, double largest_deg) const override {
    std::vector<std::string> remarks;
    const double share = 100 * line.mismatch() / line.K_T;
    if (!line.anchored) {
      const HypothesisTest none = student_test(mismatch, 0);
      remarks.push_back(fmt::format("the line's intercept is {:+.2f} % from K_T{}", share,
                                    !none.tested()    ? ""
                                    : none.rejected() ? ", beyond its error"
                                                      : ", within its error"));
    }
    for (std::size_t i = 0; i < line.points.size(); ++i) {
      if (line.robust_weights[i] < kRejectedWeight)
        remarks.push_back(fmt::format("the {} loss rejects k at {}°, {:.1f} times its error from the line",
                                      name_of(line.loss), line.points[i].phi_deg,
                                      std::abs(line.residuals[i]) / line.sigmas[i]));
    }
    if (!line.zero_crossing_deg()) {
      remarks.push_back(
          "the line does not fall with phi: either the occlusion costs no thrust or the runs were mixed up");
      return remarks;
    }
    const double clipping = *line.clipping_deg(), zero = *line.zero_crossing_deg();
    if (clipping > 0)
      remarks.push_back(fmt::format(
          "up to {:.1f}° the line is above K_T, so k_i is held at 1: no occlusion gives more thrust", clipping));
    if (clipping < 0)
      remarks.push_back(
          fmt::format("at first contact the line is already {:.2f} % below K_T, so k_i steps there", -share));
    if (zero < 360)
      remarks.push_back(fmt::format("the line reaches 0 at {:.1f}°; it was measured up to {}°", zero, largest_deg));
    return remarks;
  }

  std::optional<compensation::ThrustCurve> flown(const CurveFit& line, Radians largest,
                                                 compensation::OverlapMeasure overlap) const override {
    constexpr double kPerRad = 180 / kPi;
    return compensation::ThrustCurve::from_line(ThrustCoefficient(line.K_T), ThrustCoefficient(line.value("intercept")),
                                                line.value("slope_per_deg") * kPerRad, largest, overlap);
  }
};

}  // namespace

const CurveModel& line_model() {
  static const LineModel model;
  return model;
}

Curvature curvature(std::span<const CurvePoint> points, double freedom) {
  Curvature result;
  const double m = static_cast<double>(points.size());
  if (m >= 3 && std::ranges::all_of(points, [](const auto& point) { return point.standard_error > 0; })) {
    std::vector<double> phi, k, weights;
    double scale = 0;
    for (const CurvePoint& point : points) scale = std::max(scale, point.phi_deg);
    for (const CurvePoint& point : points) {
      phi.push_back(point.phi_deg / scale);
      k.push_back(point.k);
      weights.push_back(1 / (point.standard_error * point.standard_error));
    }
    const double straight = regress_polynomial(phi, k, 0, 1, weights).weighted_squares;
    const Regression parabola = regress_polynomial(phi, k, 0, 2, weights);
    result.lack_of_fit = f_test(straight / (m - 2), m - 2, freedom);
    result.quadratic = f_test(straight - parabola.weighted_squares, 1, freedom);
    result.second_order = parabola.estimates[2] / (scale * scale);
    result.second_order_u = std::sqrt(parabola.covariance[2][2]) / (scale * scale);
  }
  result.lack_of_fit.name = "lack of fit of the line k(phi)";
  result.quadratic.name = "third term of a parabola k(phi)";
  result.lack_of_fit.hypothesis = result.quadratic.hypothesis = "k(phi) is a line";
  result.lack_of_fit.statistic = result.quadratic.statistic = "F";
  return result;
}

}  // namespace kphi::fit
