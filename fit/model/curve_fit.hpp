// The curve k(φ) through the coefficients of the occlusions (paper, "Results of the Identification": the orange line).
// Its forms have files of their own (line.cpp, table.cpp). What comes after the fit asks for k, weights and parameters
// and does not know the form.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "compensation/thrust_curve.hpp"
#include "fit/numerics/hypothesis_test.hpp"
#include "fit/numerics/loss.hpp"

namespace kphi::fit {

struct CurvePoint {
  double phi_deg = 0;
  double k = 0;               ///< N/(rad/s)²
  double standard_error = 0;  ///< of k; 0 or NaN: unknown
};

/// Forms of k(φ). Each has its CurveModel in a file of its own; model_of() in curve_fit.cpp does not compile without
/// it.
enum class CurveForm : std::uint8_t { line, table };
inline constexpr std::array kCurveForms{CurveForm::line, CurveForm::table};

/// In coefficients.yaml and for people: "line", "table".
[[nodiscard]] const char* name_of(CurveForm form);

struct Curvature {
  static constexpr double kNotComputed = std::numeric_limits<double>::quiet_NaN();
  HypothesisTest lack_of_fit;  ///< of the form: χ² per degree of freedom against the variance of the coefficients
  HypothesisTest quadratic;    ///< F test of the third term of a parabola; without a name: not of this form
  double second_order = kNotComputed;  ///< N/(rad/s)²/deg², of the parabola
  double second_order_u = kNotComputed;
  [[nodiscard]] bool bends() const { return lack_of_fit.rejected() || quadratic.rejected(); }
};

/// Tests whether k(φ) is a line, by the `points` that carry it (with φ = 0 if anchored) and their standard errors;
/// `freedom` of the variance behind those errors. Needs 3 points; with 3 the two tests are the same. science.md,
/// eq. 21.
[[nodiscard]] Curvature curvature(std::span<const CurvePoint> points, double freedom);

struct CurveOptions {
  CurveForm form = CurveForm::line;
  bool anchored = false;             ///< k(0) of the curve is K_T
  std::vector<double> points_deg{};  ///< which points carry the curve; empty: all with φ > 0
  Loss loss = Loss::none;            ///< of a line; σ of each point is its error
};

/// One parameter of the curve.
struct CurveParameter {
  std::string key;   ///< in coefficients.yaml
  std::string name;  ///< for people
  std::string per;   ///< what follows the unit of k: "", "/deg"
  double value = 0;
  /// The value is Σ weight · k over all the points given to the fit, ascending φ, with the weights of the fit, those of
  /// its loss included.
  std::vector<double> weights{};
  std::optional<double> at_deg{};  ///< of a k in a table: its φ
};

class CurveModel;

/// k(φ) as fitted: a linear function of its parameters.
struct CurveFit {
  CurveForm form = CurveForm::line;
  bool anchored = false;  ///< k(0) of the curve is K_T
  Loss loss = Loss::none;
  std::vector<CurveParameter> parameters{};
  std::vector<CurvePoint> points{};      ///< used, ascending φ
  std::vector<double> residuals{};       ///< k − curve, N/(rad/s)², one per point used
  std::vector<double> sigmas{};          ///< the errors by which the points were weighted
  std::vector<double> robust_weights{};  ///< 1: full weight, 0: ignored; one per point used
  double K_T = 0;                        ///< N/(rad/s)², measured at φ = 0
  double K_T_standard_error = 0;

  /// The curve that flies up to `largest_deg` (default: the last point), without its uncertainty, which Analysis has.
  /// Throws FitError if K_T or k(0) of the curve is not positive, or a number not finite.
  [[nodiscard]] compensation::ThrustCurve curve(
      std::optional<double> largest_deg = {},
      compensation::OverlapMeasure overlap = compensation::OverlapMeasure::rim_arc) const;
  [[nodiscard]] double k_at(double phi_deg) const;
  /// k(φ) = Σ weight · k over all the points given to the fit.
  [[nodiscard]] std::vector<double> weights_at(double phi_deg) const;
  /// nullptr if the curve has no such parameter.
  [[nodiscard]] const CurveParameter* find(const std::string& key) const;
  /// Throws std::out_of_range if the curve has no such parameter.
  [[nodiscard]] double value(const std::string& key) const;
  /// k(0) − K_T: by how much the curve misses the measured k(0).
  [[nodiscard]] double mismatch() const { return k_at(0) - K_T; }
  /// φ where the curve meets K_T; below it the curve is above K_T and compensation clips. nullopt unless it falls.
  [[nodiscard]] std::optional<double> clipping_deg() const { return falls_to(K_T); }
  /// φ where the curve predicts no thrust at all. nullopt unless it falls.
  [[nodiscard]] std::optional<double> zero_crossing_deg() const { return falls_to(0); }

  [[nodiscard]] const CurveModel& model() const;
  // Of the model; see there.
  [[nodiscard]] std::optional<double> falls_to(double k) const;
  [[nodiscard]] Curvature tested(double freedom) const;
  [[nodiscard]] double spare_points() const;
  [[nodiscard]] std::vector<std::string> remarks(const Estimate& mismatch, double largest_deg) const;
};

/// What one form of k(φ) knows of itself. It computes nothing else: points, weights by their errors, residuals and
/// uncertainty are the same for all.
class CurveModel {
 public:
  virtual ~CurveModel() = default;
  [[nodiscard]] virtual const char* name() const = 0;
  /// Whether k(0) is K_T, which was `asked` for.
  [[nodiscard]] virtual bool anchored(bool asked) const { return asked; }
  /// How many points it needs; with fewer the fit is refused.
  [[nodiscard]] virtual std::size_t least_points(bool anchored) const = 0;
  /// How many it can hold.
  [[nodiscard]] virtual std::size_t most_points() const { return std::numeric_limits<std::size_t>::max(); }
  /// Whether it can be fitted under a robust loss.
  [[nodiscard]] virtual bool can_have_loss() const { return false; }
  /// Of a fit with points, sigmas and loss; `all` are those given to the fit, ascending φ.
  [[nodiscard]] virtual std::vector<CurveParameter> parameters(const CurveFit& fit,
                                                               std::span<const CurvePoint> all) const = 0;
  /// k(φ) = Σ basis · value over the parameters.
  [[nodiscard]] virtual std::vector<double> basis(const CurveFit& fit, double phi_deg) const = 0;
  /// From this φ on the curve lies between what carries it; below it is extrapolated.
  [[nodiscard]] virtual double first_fitted_deg(const CurveFit& fit) const = 0;
  /// The smallest φ where the curve falls to `k`; nullopt if it does not.
  [[nodiscard]] virtual std::optional<double> falls_to(const CurveFit& fit, double k) const = 0;
  /// Whether the form describes the points that carry it; `freedom` of the variance behind their errors.
  [[nodiscard]] virtual Curvature tested(const CurveFit& fit, double freedom) const = 0;
  /// Numbers that the fit was free to choose: fewer than parameters where k(0) is given.
  [[nodiscard]] virtual std::size_t terms(const CurveFit& fit) const = 0;
  /// Whether the true k(φ) may lie beside the curve: not where the form follows whatever k is.
  [[nodiscard]] virtual bool may_miss(const CurveFit& fit, double phi_deg) const = 0;
  /// What a pilot reads when the test falls: "k(φ) is not a line".
  [[nodiscard]] virtual const char* denial() const = 0;
  /// What else may be done about it: "; if they are right, fit a table (--form table)"; or nothing.
  [[nodiscard]] virtual const char* remedy() const { return ""; }
  /// "line, free": for people.
  [[nodiscard]] virtual std::string words(const CurveFit& fit) const = 0;
  /// What a pilot should know of the form: k(0) beside K_T, clipping, zero. `mismatch` is that of k(0) with its error,
  /// `largest_deg` the widest occlusion measured.
  [[nodiscard]] virtual std::vector<std::string> remarks(const CurveFit& fit, const Estimate& mismatch,
                                                         double largest_deg) const = 0;
  /// nullopt if it cannot fly: k(0) or K_T is not positive, or a number not finite.
  [[nodiscard]] virtual std::optional<compensation::ThrustCurve> flown(const CurveFit& fit, Radians largest,
                                                                       compensation::OverlapMeasure overlap) const = 0;
};

/// Angles travel through files and options as decimal degrees; two of them closer than this are the same.
inline constexpr double kSameAngleDeg = 1e-6;

[[nodiscard]] const CurveModel& line_model();
[[nodiscard]] const CurveModel& table_model();

/// `points` hold exactly one φ = 0 (K_T) and the occluded ones, each φ once. Throws FitError when K_T is missing, a φ
/// is listed twice or not measured, or too few points remain for the form; with a loss when the form has none or the
/// error of a point is unknown.
[[nodiscard]] CurveFit fit_curve(std::span<const CurvePoint> points, const CurveOptions& options = {});

}  // namespace kphi::fit
