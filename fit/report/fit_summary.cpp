#include "fit/report/fit_summary.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "compensation/units.hpp"

namespace kphi::fit {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

std::string number_line(const char* name, double value, double error, const char* per) {
  const auto rpm = [](double k) { return to_newtons_per_rpm2(ThrustCoefficient(k)); };
  return fmt::format("{:<10} {} N/(rad/s)^2{}  =  {} N/RPM^2{}\n", name, with_error(value, error), per,
                     with_error(rpm(value), rpm(error)), per);
}

}  // namespace

// Numbers that are not finite become null: JSON has neither NaN nor infinity.

static void to_json(Json& json, const Estimate& one) {
  json = {{"value", one.value}, {"u", one.u}, {"freedom", one.freedom}};
}

void to_json(Json& json, const HypothesisTest& test) {
  json = {{"name", test.name},   {"hypothesis", test.hypothesis}, {"statistic", test.statistic},
          {"value", test.value}, {"freedom", test.freedom},       {"error_freedom", test.error_freedom},
          {"p", test.p},         {"rejected", test.rejected()}};
}

static void to_json(Json& json, const Budget& budget) {
  Json rows = Json::array();
  for (const BudgetRow& row : budget.rows) {
    rows.push_back({{"source", row.source},
                    {"type", row.evaluation == Evaluation::type_a ? "A" : "B"},
                    {"u", row.u},
                    {"unit", row.unit},
                    {"sensitivity", row.sensitivity},
                    {"contribution", row.known() ? row.contribution() : kUnknown},
                    {"freedom", row.freedom},
                    {"share", budget.share(row)},
                    {"common", row.common},
                    {"note", row.note}});
  }
  json = {{"quantity", budget.quantity},
          {"unit", budget.unit},
          {"value", budget.value},
          {"u", budget.combined()},
          {"freedom", budget.freedom()},
          {"coverage_factor_95", budget.coverage()},
          {"expanded_95", budget.expanded()},
          {"rows", rows}};
}

static void to_json(Json& json, const OcclusionCoefficient& row) {
  json = {{"phi_deg", row.phi_deg}, {"k", row.k}, {"standard_error", row.standard_error}};
}

static void to_json(Json& json, const SpeedCoefficient& level) {
  json = {{"speed_rpm", to_rpm(RadPerSec(level.speed_rad_s))},
          {"k", level.k},
          {"standard_error", level.standard_error},
          {"repetitions", level.repetitions}};
}

static void to_json(Json& json, const SpeedDependence& one) {
  json = {{"phi_deg", one.phi_deg},         {"change_share", one.change}, {"inadequacy", one.inadequacy},
          {"lack_of_fit", one.lack_of_fit}, {"trend", one.trend},         {"levels", one.levels}};
}

static void to_json(Json& json, const LinePrediction& one) {
  json = {{"phi_deg", one.phi_deg},
          {"k", one.k.value},
          {"u_k", one.k.combined()},
          {"expanded_95_k", one.k.expanded()},
          {"k_i", one.scaling_factor.value},
          {"u_k_i", one.scaling_factor.combined()},
          {"speed_u_share", one.speed_u_share},
          {"clipped", one.clipped},
          {"extrapolated", one.extrapolated}};
}

static void to_json(Json& json, const BootstrapInterval& one) {
  json = {{"quantity", one.quantity},
          {"value", one.value},
          {"standard_error", one.standard_error},
          {"lower", one.lower},
          {"upper", one.upper}};
}

static void to_json(Json& json, const TorqueCoefficient& one) {
  json = {{"phi_deg", one.phi_deg},
          {"k_q_nm_per_rad2_s2", one.k_q},
          {"share", one.share},
          {"u_share", one.share_u},
          {"drag_per_thrust_m", one.drag_per_thrust_m}};
}

static void to_json(Json& json, const OutlyingRun& run) {
  json = {{"phi_deg", run.phi_deg}, {"repetition", run.repetition}, {"share", run.share}, {"p", run.p}};
}

static void to_json(Json& json, const RejectedPoint& one) {
  json = {{"phi_deg", one.phi_deg},
          {"repetition", one.repetition},
          {"step", one.step + 1},
          {"speed_rpm", to_rpm(RadPerSec(one.speed_rad_s))},
          {"thrust_n", one.thrust_n},
          {"residual_n", one.residual_n},
          {"robust_weight", one.robust_weight}};
}

static void to_json(Json& json, const Claim& claim) {
  json = {{"id", claim.id},
          {"statement", claim.statement},
          {"unit", claim.unit},
          {"value", claim.value},
          {"lower", claim.lower},
          {"upper", claim.upper},
          {"allowed_lower", claim.allowed_lower},
          {"allowed_upper", claim.allowed_upper},
          {"verdict", name_of(claim.verdict)}};
}

static void to_json(Json& json, const SharedSlope& one) {
  json = {{"diameter_in", one.diameter_in}, {"slope_per_deg", one.slope.value}, {"u", one.slope.u},
          {"u_common", one.common_u},       {"propellers", one.propellers},     {"equal_slopes", one.equal_slopes}};
}

static void to_json(Json& json, const FamilyPrediction& one) {
  json = {{"diameter_in", one.diameter_in},
          {"blades", one.blades},
          {"phi_deg", one.phi_deg},
          {"k", one.k.value},
          {"u", one.k.u},
          {"lower", one.lower},
          {"upper", one.upper}};
}

void to_json(Json& json, const Analysis& analysis) {
  const Curvature& curvature = analysis.curvature;
  json = {{"coefficients", analysis.coefficients},
          {"intercept", analysis.intercept},
          {"slope", analysis.slope},
          {"covariance_K_T_intercept_slope", analysis.covariance},
          {"standard_air", analysis.standard},
          {"speed", analysis.speed},
          {"line_lack_of_fit", curvature.lack_of_fit},
          {"line_quadratic",
           {{"test", curvature.quadratic},
            {"second_order", curvature.second_order},
            {"u", curvature.second_order_u},
            {"linear_aicc", curvature.linear_aic},
            {"quadratic_aicc", curvature.quadratic_aic}}},
          {"line_shape",
           {{"clipping_deg", analysis.shape.clipping_deg.value_or(kUnknown)},
            {"zero_deg", analysis.shape.zero_deg.value_or(kUnknown)},
            {"intercept_minus_K_T", analysis.shape.mismatch}}},
          {"remarks", analysis.remarks},
          {"differences", analysis.differences},
          {"predictions", analysis.predictions},
          {"bootstrap", analysis.bootstrap},
          {"torque", analysis.torque},
          {"between_runs_share", analysis.between_runs.u},
          {"outlying_runs", analysis.outlying},
          {"rejected", analysis.rejected}};
}

void to_json(Json& json, const Dynamics& dynamics) {
  json = {{"steps", dynamics.steps},
          {"motor_time_constant_s", dynamics.motor_time_constant_s},
          {"motor_delay_s", dynamics.motor_delay_s},
          {"thrust_lag_s", dynamics.thrust_lag_s}};
}

void to_json(Json& json, const BladePassCheck& check) {
  json = {{"lines", check.lines.size()}, {"clock_gain", check.gain}, {"lower", check.lower}, {"upper", check.upper}};
}

void to_json(Json& json, const FamilyFindings& findings) {
  json = {{"k_unit", "N/(rad/s)^2"},
          {"air", findings.air == Air::standard ? "standard" : "measured"},
          {"claims", findings.claims},
          {"shared_slopes", findings.slopes},
          {"predictions", findings.predictions}};
}

Json fit_json(const Identification& identification, const Analysis& analysis,
              const std::filesystem::path& coefficients) {
  const LineFit& line = identification.line;
  const Estimate K_T = identification.thrust_coefficient();
  const auto& standard = identification.table.front().standard;
  return {{"coefficients", coefficients.string()},
          {"k_unit", "N/(rad/s)^2"},
          {"K_T", K_T.value},
          {"K_T_standard_error", K_T.u},
          {"k_standard", standard ? standard->value : kUnknown},
          {"air_density_kg_m3", identification.air ? identification.air->value : kUnknown},
          {"anchored", line.anchored},
          {"intercept", line.intercept},
          {"slope_per_deg", line.slope_per_deg},
          {"covariance", line.covariance},
          {"overlap", compensation::name_of(identification.options.overlap)},
          {"table", identification.table},
          {"steps_used", identification.selection.used.size()},
          {"steps_flagged", identification.selection.flagged.size()},
          {"estimator", name_of(identification.options.estimator)},
          {"weights", name_of(identification.options.weighting)},
          {"loss", name_of(identification.options.loss)},
          {"analysis", analysis}};
}

std::string with_error(double value, double standard_error) {
  if (!(standard_error > 0) || !std::isfinite(standard_error) || !(std::abs(value) > 0))
    return fmt::format("{:.5e}", value);
  const double digits = std::floor(std::log10(std::abs(value))) - std::floor(std::log10(standard_error)) + 1;
  return fmt::format("{:.{}e} ± {:.1e}", value, static_cast<int>(std::clamp(digits, 1.0, 12.0)), standard_error);
}

std::string headline_text(const Identification& identification) {
  const LineFit& line = identification.line;
  const Estimate K_T = identification.thrust_coefficient();
  std::string text = number_line("K_T", K_T.value, K_T.u, "") +
                     number_line("intercept", line.intercept, std::sqrt(line.covariance[0][0]), "") +
                     number_line("slope", line.slope_per_deg, std::sqrt(line.covariance[1][1]), " per degree");
  if (const auto& standard = identification.table.front().standard)
    text += number_line("k_standard", standard->value, standard->u, "");
  return text;
}

std::string caution_text(const Identification& identification, const Analysis& analysis) {
  std::string text;
  for (const FlaggedStep& flagged : identification.selection.flagged) {
    text += fmt::format("{:<13} phi {}°, repetition {}, step {}: {}\n", flagged.left_out ? "left out" : "kept",
                        flagged.step.occlusion_deg, flagged.step.repetition, flagged.step.step + 1, flagged.reason);
  }
  for (const RejectedPoint& point : analysis.rejected) {
    text += fmt::format("rejected      phi {}°, repetition {}, step {}: {:+.3f} N off, robust weight {:.2f}\n",
                        point.phi_deg, point.repetition, point.step + 1, point.residual_n, point.robust_weight);
  }
  for (const std::string& remark : analysis.remarks) text += fmt::format("remark        {}\n", remark);
  if (!identification.air)
    text += "air density   unknown: k holds for the air of that day only; add `ambient:` to the bench file\n";
  return text;
}

}  // namespace kphi::fit
