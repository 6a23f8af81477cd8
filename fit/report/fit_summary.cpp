#include "fit/report/fit_summary.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "compensation/units.hpp"

namespace kphi::fit {
namespace {

using Json = nlohmann::ordered_json;

/// JSON has neither NaN nor infinity.
Json number(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

Json number(const std::optional<double>& value) { return value ? number(*value) : Json(nullptr); }

template <class Range, class Write>
Json list(const Range& range, Write write) {
  Json array = Json::array();
  for (const auto& one : range) array.push_back(write(one));
  return array;
}

Json estimate(const Estimate& one) {
  return {{"value", number(one.value)}, {"u", number(one.u)}, {"freedom", number(one.freedom)}};
}

Json speed_json(const SpeedDependence& one) {
  return {{"phi_deg", one.phi_deg},
          {"change_share", estimate(one.change)},
          {"inadequacy", number(one.inadequacy)},
          {"lack_of_fit", to_json(one.lack_of_fit)},
          {"trend", to_json(one.trend)},
          {"levels", list(one.levels, [](const LevelCoefficient& level) {
             return Json{{"speed_rpm", to_rpm(RadPerSec(level.speed_rad_s))},
                         {"k", number(level.k)},
                         {"standard_error", number(level.standard_error)},
                         {"repetitions", level.repetitions}};
           })}};
}

Json prediction(const LinePrediction& one) {
  return {{"phi_deg", one.phi_deg},
          {"k", number(one.k.value)},
          {"u_k", number(one.k.combined())},
          {"expanded_95_k", number(one.k.expanded())},
          {"k_i", number(one.scaling_factor.value)},
          {"u_k_i", number(one.scaling_factor.combined())},
          {"speed_u_share", number(one.speed_u_share)},
          {"clipped", one.clipped},
          {"extrapolated", one.extrapolated}};
}

Json torque(const TorqueCoefficient& one) {
  return {{"phi_deg", one.phi_deg},
          {"k_q_nm_per_rad2_s2", estimate(one.k_q)},
          {"share", number(one.share)},
          {"u_share", number(one.share_u)},
          {"drag_per_thrust_m", estimate(one.drag_per_thrust_m)}};
}

Json rejected(const RejectedPoint& one) {
  return {{"phi_deg", one.phi_deg},
          {"repetition", one.repetition},
          {"step", one.step + 1},
          {"speed_rpm", to_rpm(RadPerSec(one.speed_rad_s))},
          {"thrust_n", number(one.thrust_n)},
          {"residual_n", number(one.residual_n)},
          {"robust_weight", number(one.robust_weight)}};
}

Json shape(const LineShape& one) {
  return {{"clipping_deg", number(one.clipping_deg)},
          {"zero_deg", number(one.zero_deg)},
          {"intercept_minus_K_T", estimate(one.mismatch)}};
}

Json claim_json(const Claim& claim) {
  return {{"id", claim.id},
          {"statement", claim.statement},
          {"unit", claim.unit},
          {"value", number(claim.value)},
          {"lower", number(claim.lower)},
          {"upper", number(claim.upper)},
          {"allowed_lower", number(claim.allowed_lower)},
          {"allowed_upper", number(claim.allowed_upper)},
          {"verdict", name_of(claim.verdict)}};
}

std::string number_line(const char* name, double value, double error, const char* per) {
  const auto rpm = [](double k) { return to_newtons_per_rpm2(ThrustCoefficient(k)); };
  return fmt::format("{:<10} {} N/(rad/s)^2{}  =  {} N/RPM^2{}\n", name, with_error(value, error), per,
                     with_error(rpm(value), rpm(error)), per);
}

}  // namespace

std::string with_error(double value, double standard_error) {
  if (!(standard_error > 0) || !std::isfinite(standard_error) || !(std::abs(value) > 0))
    return fmt::format("{:.5e}", value);
  const double digits = std::floor(std::log10(std::abs(value))) - std::floor(std::log10(standard_error)) + 1;
  return fmt::format("{:.{}e} ± {:.1e}", value, static_cast<int>(std::clamp(digits, 1.0, 12.0)), standard_error);
}

Json to_json(const HypothesisTest& test) {
  return {
      {"name", test.name},           {"hypothesis", test.hypothesis},   {"statistic", test.statistic},
      {"value", number(test.value)}, {"freedom", number(test.freedom)}, {"error_freedom", number(test.error_freedom)},
      {"p", number(test.p)},         {"rejected", test.rejected()}};
}

Json to_json(const Budget& budget) {
  return {{"quantity", budget.quantity},
          {"unit", budget.unit},
          {"value", number(budget.value)},
          {"u", number(budget.combined())},
          {"freedom", number(budget.freedom())},
          {"coverage_factor_95", number(budget.coverage())},
          {"expanded_95", number(budget.expanded())},
          {"rows", list(budget.rows, [&](const BudgetRow& row) {
             return Json{{"source", row.source},
                         {"type", row.evaluation == Evaluation::type_a ? "A" : "B"},
                         {"u", number(row.u)},
                         {"unit", row.unit},
                         {"sensitivity", number(row.sensitivity)},
                         {"contribution", row.known() ? number(row.contribution()) : Json(nullptr)},
                         {"freedom", number(row.freedom)},
                         {"share", number(budget.share(row))},
                         {"common", row.common},
                         {"note", row.note}};
           })}};
}

Json to_json(const Analysis& analysis) {
  const auto budget = [](const Budget& one) { return to_json(one); };
  const auto test = [](const HypothesisTest& one) { return to_json(one); };
  return {{"coefficients", list(analysis.coefficients, budget)},
          {"intercept", to_json(analysis.intercept)},
          {"slope", to_json(analysis.slope)},
          {"covariance_K_T_intercept_slope", analysis.covariance},
          {"standard_air", list(analysis.standard, budget)},
          {"speed", list(analysis.speed, speed_json)},
          {"line_lack_of_fit", to_json(analysis.curvature.lack_of_fit)},
          {"line_quadratic",
           {{"test", to_json(analysis.curvature.quadratic)},
            {"second_order", number(analysis.curvature.second_order)},
            {"u", number(analysis.curvature.second_order_u)},
            {"linear_aicc", number(analysis.curvature.linear_aic)},
            {"quadratic_aicc", number(analysis.curvature.quadratic_aic)}}},
          {"line_shape", shape(analysis.shape)},
          {"remarks", analysis.remarks},
          {"differences", list(analysis.differences, test)},
          {"predictions", list(analysis.predictions, prediction)},
          {"bootstrap", list(analysis.bootstrap,
                             [](const BootstrapInterval& one) {
                               return Json{{"quantity", one.quantity},
                                           {"value", number(one.value)},
                                           {"standard_error", number(one.standard_error)},
                                           {"lower", number(one.lower)},
                                           {"upper", number(one.upper)}};
                             })},
          {"torque", list(analysis.torque, torque)},
          {"between_runs_share", number(analysis.between_runs.u)},
          {"outlying_runs", list(analysis.outlying,
                                 [](const OutlyingRun& run) {
                                   return Json{{"phi_deg", run.phi_deg},
                                               {"repetition", run.repetition},
                                               {"share", number(run.share)},
                                               {"p", number(run.p)}};
                                 })},
          {"rejected", list(analysis.rejected, rejected)}};
}

Json raw_to_json(const std::optional<Dynamics>& dynamics, const std::optional<BladePassCheck>& blade_pass) {
  Json json{{"dynamics", nullptr}, {"blade_pass", nullptr}};
  if (dynamics) {
    json["dynamics"] = {{"steps", dynamics->steps},
                        {"motor_time_constant_s", estimate(dynamics->motor_time_constant_s)},
                        {"motor_delay_s", estimate(dynamics->motor_delay_s)},
                        {"thrust_lag_s", estimate(dynamics->thrust_lag_s)}};
  }
  if (blade_pass) {
    json["blade_pass"] = {{"lines", blade_pass->lines.size()},
                          {"clock_gain", estimate(blade_pass->gain)},
                          {"lower", number(blade_pass->lower)},
                          {"upper", number(blade_pass->upper)}};
  }
  return json;
}

Json to_json(const FamilyFindings& findings) {
  return {{"k_unit", "N/(rad/s)^2"},
          {"air", findings.air == Air::standard ? "standard" : "measured"},
          {"claims", list(findings.claims, claim_json)},
          {"shared_slopes", list(findings.slopes,
                                 [](const SharedSlope& one) {
                                   return Json{{"diameter_in", one.diameter_in},
                                               {"slope_per_deg", one.slope.value},
                                               {"u", one.slope.u},
                                               {"u_common", one.common_u},
                                               {"propellers", one.propellers},
                                               {"equal_slopes", to_json(one.equal_slopes)}};
                                 })},
          {"predictions", list(findings.predictions, [](const FamilyPrediction& one) {
             return Json{{"diameter_in", one.diameter_in},
                         {"blades", one.blades},
                         {"phi_deg", one.phi_deg},
                         {"k", one.k.value},
                         {"u", one.k.u},
                         {"lower", one.lower},
                         {"upper", one.upper}};
           })}};
}

std::string headline_text(const Identification& identification) {
  const LineFit& line = identification.line;
  std::string text = number_line("K_T", line.K_T, line.K_T_standard_error, "") +
                     number_line("intercept", line.intercept, std::sqrt(line.covariance[0][0]), "") +
                     number_line("slope", line.slope_per_deg, std::sqrt(line.covariance[1][1]), " per degree");
  if (const auto& standard = identification.table.front().standard)
    text += number_line("k_standard", standard->k, standard->standard_error, "");
  return text;
}

Json to_json(const Identification& identification, const Analysis& analysis,
             const std::filesystem::path& coefficients) {
  const LineFit& line = identification.line;
  const auto& standard = identification.table.front().standard;
  Json table = Json::array();
  for (const OcclusionCoefficient& row : identification.table)
    table.push_back({{"phi_deg", row.phi_deg}, {"k", row.k}, {"standard_error", row.standard_error}});
  return {{"coefficients", coefficients.string()},
          {"k_unit", "N/(rad/s)^2"},
          {"K_T", line.K_T},
          {"K_T_standard_error", line.K_T_standard_error},
          {"k_standard", standard ? Json(standard->k) : Json(nullptr)},
          {"air_density_kg_m3", identification.air ? Json(identification.air->kg_m3) : Json(nullptr)},
          {"anchored", line.anchored},
          {"intercept", line.intercept},
          {"slope_per_deg", line.slope_per_deg},
          {"covariance", line.covariance},
          {"overlap", compensation::name_of(identification.overlap)},
          {"table", table},
          {"steps_used", identification.selection.used.size()},
          {"steps_flagged", identification.selection.flagged.size()},
          {"estimator", name_of(identification.estimator)},
          {"weights", name_of(identification.weighting)},
          {"loss", name_of(identification.loss)},
          {"analysis", to_json(analysis)}};
}

std::string caution_text(const Identification& identification, const Analysis& analysis) {
  std::string text;
  for (const FlaggedStep& flagged : identification.selection.flagged) {
    text += fmt::format("{:<13} phi {} deg, repetition {}, step {}: {}\n", flagged.left_out ? "left out" : "kept",
                        flagged.step.occlusion_deg, flagged.step.repetition, flagged.step.step + 1, flagged.reason);
  }
  for (const RejectedPoint& point : analysis.rejected) {
    text += fmt::format("rejected      phi {} deg, repetition {}, step {}: {:+.3f} N off, robust weight {:.2f}\n",
                        point.phi_deg, point.repetition, point.step + 1, point.residual_n, point.robust_weight);
  }
  for (const std::string& remark : analysis.remarks) text += fmt::format("remark        {}\n", remark);
  if (!identification.air)
    text += "air density   unknown: k holds for the air of that day only; add `ambient:` to the bench file\n";
  return text;
}

}  // namespace kphi::fit
