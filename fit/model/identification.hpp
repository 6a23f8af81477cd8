// Steps of one propeller → one k per occlusion → the curve k(φ). Read this first.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "compensation/convex_polygon.hpp"
#include "fit/model/curve_fit.hpp"
#include "fit/model/repeatability.hpp"
#include "fit/model/step_selection.hpp"
#include "fit/model/thrust_fit.hpp"

namespace kphi::fit {

inline constexpr double kStandardDensity = 1.225;  ///< kg/m³: ISA at sea level

/// Air density, kg/m³: mean over the steps with the standard uncertainty that they share; nullopt if one of them lacks
/// its density: kphi never assumes standard air.
[[nodiscard]] std::optional<Estimate> air_of(std::span<const results::StepMean> steps);

/// Which k of an occlusion the curve is drawn through.
enum class Estimator : std::uint8_t {
  through_origin,  ///< k of T = k ω² over the speed range
  with_offset,     ///< k of T = k ω² + offset
  polynomial,      ///< T/ω² of the map k ω² + linear ω + offset at the reference speed
  at_speed,        ///< mean T/ω² of the steps at the reference speed
};

struct IdentificationOptions {
  Estimator estimator = Estimator::through_origin;
  Weighting weighting = Weighting::equal;
  Loss loss = Loss::none;
  SpeedRange speed_range{.min_rad_s = kSpeedMinRpm * 3.14159265358979323846 / 30};
  std::vector<LeftOutRun> left_out{};
  std::optional<double> mounting{};  ///< relative, of k from mounting to mounting, where repetitions do not tell it
  bool mounted_once = false;         ///< one mounting for all repetitions of a φ: their scatter does not hold it
  std::optional<double> at_speed_rad_s{};  ///< for "k at speed"; default: the highest level measured at every φ
  CurveOptions curve{};
  std::string propeller{};  ///< empty: as the steps say
  double diameter_in = 0;   ///< 0: as the steps say
  int blades = 0;
  /// How φ is measured in flight. On the bench's sector plates all measures are the same angle.
  compensation::OverlapMeasure overlap = compensation::OverlapMeasure::rim_arc;
};

/// One row of the table: the measurement at one φ.
struct OcclusionCoefficient {
  double phi_deg = 0;
  double k = 0;  ///< N/(rad/s)², by the estimator
  /// N/(rad/s)², for weights and tests; Analysis has the whole uncertainty. Of several repetitions: noise, zero and
  /// scatter between runs (Repeatability), without the errors common to all k; of a single one: of the fit.
  double standard_error = 0;
  std::optional<Estimate> air{};  ///< kg/m³, of its steps; nullopt: unknown
  std::size_t steps = 0;          ///< distinct levels
  std::size_t repetitions = 0;
  std::optional<ThrustFit> fit{};              ///< nullopt in a table without steps
  std::vector<results::StepMean> measured{};   ///< behind `fit`, one per point of it
  std::optional<SpeedCoefficient> at_speed{};  ///< nullopt without a good step at that speed
};

struct Identification {
  std::string propeller;
  double diameter_in = 0;                   ///< 0: unknown
  int blades = 0;                           ///< 0: unknown
  IdentificationOptions options;            ///< by which it was fitted
  std::vector<OcclusionCoefficient> table;  ///< ascending φ, the first is φ = 0
  CurveFit curve_fit;                       ///< without points if no occlusion was measured
  Repeatability repeatability;              ///< one angle per row of the table; empty in a table without steps
  StepSelection selection;
  std::optional<Estimate> air;  ///< kg/m³, of the steps used; nullopt: unknown, and so is every k at standard density
  double at_speed_rad_s = 0;    ///< commanded level of "k at speed"; 0: none
  SpeedRange fitted{0, 0};      ///< lowest and highest level used at any φ
  double speed_min_rad_s = 0;   ///< speeds measured at every φ: the valid range of the curve
  double speed_max_rad_s = 0;

  /// No occlusion was measured: K_T alone, as an imported log has it. Then there is no curve.
  [[nodiscard]] bool alone() const { return curve_fit.points.empty(); }
  /// Thrust coefficient measured at φ = 0, N/(rad/s)².
  [[nodiscard]] Estimate thrust_coefficient() const { return {curve_fit.K_T, curve_fit.K_T_standard_error}; }
  /// From this φ on the curve that flies lies between points that carry it.
  [[nodiscard]] double first_fitted_deg() const { return curve_fit.model().first_fitted_deg(curve_fit); }
  /// The curve that flies, valid up to the widest occlusion measured.
  [[nodiscard]] compensation::ThrustCurve curve() const {
    return curve_fit.curve(table.back().phi_deg, options.overlap);
  }
};

/// Whether the range of speeds is known (a table of k may lack it).
[[nodiscard]] bool speeds_known(const Identification& identification);

/// Whether two speeds are the same level of a profile: they agree to 0.5 %.
[[nodiscard]] bool same_level(double a_rad_s, double b_rad_s);

/// Names for options and files: "origin", "offset", "polynomial", "speed"; "equal", "thrust", "effective-variance".
[[nodiscard]] const char* name_of(Estimator estimator);
[[nodiscard]] const char* name_of(Weighting weighting);

/// One row per φ of `steps`, ascending, and how they repeat. `at_speed_rad_s` is the reference speed, 0: none. Throws
/// FitError, naming φ.
[[nodiscard]] std::vector<OcclusionCoefficient> coefficients_of(std::span<const results::StepMean> steps,
                                                                const IdentificationOptions& options,
                                                                double at_speed_rad_s, Repeatability& repeatability);

/// Throws FitError when the steps are of several propellers, φ = 0 is missing, or a fit cannot be made (the message
/// names φ).
[[nodiscard]] Identification identify(std::span<const results::StepMean> steps,
                                      const IdentificationOptions& options = {});

/// The points of the curve.
[[nodiscard]] std::vector<CurvePoint> points_of(std::span<const OcclusionCoefficient> table);

/// The same from given coefficients: the curve alone. The range of speeds in the options is their valid range.
[[nodiscard]] Identification identify_table(std::span<const CurvePoint> points, const IdentificationOptions& options);

}  // namespace kphi::fit
