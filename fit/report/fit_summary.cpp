#include "fit/report/fit_summary.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <limits>

#include "base/json.hpp"
#include "base/number.hpp"
#include "compensation/units.hpp"

namespace kphi::fit {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

std::string number_line(const std::string& name, const Budget& budget, const std::string& per = {}) {
  const auto rpm = [](double k) { return to_newtons_per_rpm2(ThrustCoefficient(k)); };
  return fmt::format("{:<10} {} N/(rad/s)^2{}  =  {} N/RPM^2{}\n", name, with_error(budget.value, budget.expanded()),
                     per, with_error(rpm(budget.value), rpm(budget.expanded())), per);
}

/// "step 23" of neighbours, in one run.
std::string place_of(const FlaggedStep& first, const FlaggedStep& last) {
  const std::string steps = first.step.step == last.step.step
                                ? fmt::format("step {}", first.step.step + 1)
                                : fmt::format("steps {} to {}", first.step.step + 1, last.step.step + 1);
  return fmt::format("phi {}°, repetition {}, {}", first.step.occlusion_deg, first.step.repetition, steps);
}

/// One line for all steps with one cause.
std::string flagged_text(const std::vector<FlaggedStep>& all) {
  constexpr std::size_t kNamed = 3;
  struct Cause {
    bool left_out = false;
    std::string reason;
    std::vector<std::string> places;
    std::size_t steps = 0;
  };
  std::vector<Cause> causes;
  for (auto first = all.begin(); first != all.end();) {
    const auto follows = [&](const FlaggedStep& a, const FlaggedStep& b) {
      return a.left_out == b.left_out && a.reason == b.reason && a.step.occlusion_deg == b.step.occlusion_deg &&
             a.step.repetition == b.step.repetition && b.step.step == a.step.step + 1;
    };
    auto last = first;
    while (last + 1 != all.end() && follows(*last, *(last + 1))) ++last;
    auto cause = std::ranges::find_if(
        causes, [&](const Cause& one) { return one.left_out == first->left_out && one.reason == first->reason; });
    if (cause == causes.end()) cause = causes.insert(causes.end(), {first->left_out, first->reason, {}, 0});
    cause->places.push_back(place_of(*first, *last));
    cause->steps += static_cast<std::size_t>(last - first) + 1;
    first = last + 1;
  }
  std::string text;
  for (const Cause& cause : causes) {
    const std::size_t named = std::min(cause.places.size(), kNamed);
    const std::string more = named == cause.places.size() ? "" : fmt::format("; {} in all", cause.steps);
    text +=
        fmt::format("{:<13} {}{}: {}\n", cause.left_out ? "left out" : "kept",
                    fmt::join(cause.places.begin(), cause.places.begin() + static_cast<std::ptrdiff_t>(named), "; "),
                    more, cause.reason);
  }
  return text;
}

}  // namespace

// Numbers that are not finite become null: JSON has neither NaN nor infinity.

static void to_json(Json& json, const Estimate& one) {
  KPHI_JSON_MEMBERS(json, one, value, u, freedom);
  json["expanded_95"] = expanded(one);
}

void to_json(Json& json, const HypothesisTest& test) {
  KPHI_JSON_MEMBERS(json, test, name, hypothesis, statistic, value, freedom, error_freedom, p);
}

static void to_json(Json& json, const Budget& budget) {
  Json rows = Json::array();
  for (const BudgetRow& row : budget.rows) {
    Json& one = rows.emplace_back(Json{{"type", row.evaluation == Evaluation::type_a ? "A" : "B"},
                                       {"contribution", row.known() ? row.contribution() : kUnknown},
                                       {"share", budget.share(row)}});
    KPHI_JSON_MEMBERS(one, row, source, u, unit, sensitivity, freedom, common, assumed, note);
  }
  KPHI_JSON_MEMBERS(json, budget, quantity, unit, value);
  json.update({{"u", budget.combined()},
               {"freedom", budget.freedom()},
               {"coverage_factor_95", budget.coverage()},
               {"expanded_95", budget.expanded()},
               {"rows", rows}});
}

static void to_json(Json& json, const SpeedCoefficient& level) {
  json["speed_rpm"] = to_rpm(RadPerSec(level.speed_rad_s));
  KPHI_JSON_MEMBERS(json, level, k, standard_error, repetitions);
}

static void to_json(Json& json, const SpeedDependence& one) {
  KPHI_JSON_MEMBERS(json, one, phi_deg, inadequacy, lack_of_fit, trend, levels);
  json["change_share"] = one.change;
}

static void to_json(Json& json, const CurvePrediction& one) {
  json = {{"phi_deg", one.phi_deg},          {"k", one.k.value},
          {"u_k", one.k.combined()},         {"expanded_95_k", one.k.expanded()},
          {"k_i", one.scaling_factor.value}, {"u_k_i", one.scaling_factor.combined()}};
  KPHI_JSON_MEMBERS(json, one, speed_u_share, clipped, extrapolated);
}

static void to_json(Json& json, const TorqueCoefficient& one) {
  json["k_q_nm_per_rad2_s2"] = one.k_q;
  KPHI_JSON_MEMBERS(json, one, phi_deg, share, drag_per_thrust_m);
}

static void to_json(Json& json, const ThrustErrorPart& part) { KPHI_JSON_MEMBERS(json, part, name, share, remedy); }

static void to_json(Json& json, const ThrustError& error) {
  json["share_95"] = error.share;
  KPHI_JSON_MEMBERS(json, error, phi_deg, parts);
}

static void to_json(Json& json, const OutlyingRun& run) { KPHI_JSON_MEMBERS(json, run, phi_deg, repetition, share, p); }

static void to_json(Json& json, const RejectedPoint& one) {
  json = {{"step", one.step + 1}, {"speed_rpm", to_rpm(RadPerSec(one.speed_rad_s))}};
  KPHI_JSON_MEMBERS(json, one, phi_deg, repetition, thrust_n, residual_n, robust_weight);
}

static void to_json(Json& json, const Claim& claim) {
  KPHI_JSON_MEMBERS(json, claim, id, statement, unit, value, lower, upper, allowed_lower, allowed_upper);
  json["verdict"] = name_of(claim.verdict);
}

static void to_json(Json& json, const SharedSlope& one) {
  json = {{"diameter_in", one.diameter_in}, {"slope_per_deg", one.slope.value}, {"u", one.slope.u},
          {"u_common", one.common_u},       {"propellers", one.propellers},     {"equal_slopes", one.equal_slopes}};
}

static void to_json(Json& json, const FamilyPrediction& one) {
  json = {{"k", one.k.value}, {"u", one.k.u}};
  KPHI_JSON_MEMBERS(json, one, diameter_in, blades, phi_deg, lower, upper);
}

void to_json(Json& json, const Analysis& analysis) {
  const Curvature& curvature = analysis.curvature;
  json = {{"covariance_K_T_parameters", analysis.covariance},
          {"standard_air", analysis.standard},
          {"curve_lack_of_fit", curvature.lack_of_fit},
          {"curve_quadratic",
           {{"test", curvature.quadratic}, {"second_order", curvature.second_order}, {"u", curvature.second_order_u}}},
          {"curve_shape",
           {{"clipping_deg", analysis.shape.clipping_deg.value_or(kUnknown)},
            {"zero_deg", analysis.shape.zero_deg.value_or(kUnknown)},
            {"k0_minus_K_T", analysis.shape.mismatch}}},
          {"between_runs_share", analysis.between_runs.u},
          {"outlying_runs", analysis.outlying}};
  KPHI_JSON_MEMBERS(json, analysis, coefficients, parameters, speed, remarks, differences, predictions, torque,
                    rejected);
}

void to_json(Json& json, const Dynamics& dynamics) {
  KPHI_JSON_MEMBERS(json, dynamics, steps, motor_time_constant_s, motor_delay_s, thrust_lag_s);
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
  const Budget& K_T = analysis.coefficients.front();
  const CurveFit& fit = identification.curve_fit;
  Json curve, table = Json::array();
  if (!identification.alone()) curve = {{"form", name_of(fit.form)}, {"anchored", fit.anchored}};
  for (std::size_t i = 0; i < identification.table.size(); ++i) {
    const Budget& budget = analysis.coefficients[i];
    table.push_back({{"phi_deg", identification.table[i].phi_deg},
                     {"k", budget.value},
                     {"u", budget.combined()},
                     {"expanded_95", budget.expanded()}});
  }
  for (std::size_t i = 0; i < analysis.parameters.size(); ++i) {
    const CurveParameter& one = fit.parameters[i];
    Json number{{"value", analysis.parameters[i].value},
                {"u", analysis.parameters[i].combined()},
                {"expanded_95", analysis.parameters[i].expanded()}};
    if (one.at_deg) number["phi_deg"] = *one.at_deg;
    if (one.at_deg)
      curve["knots"].push_back(std::move(number));
    else
      curve[one.key] = std::move(number);
  }
  Json doubts = Json::array();
  for (const Doubt& doubt : analysis.flight.doubts) doubts.push_back(doubt.text);
  return {{"coefficients", coefficients.empty() ? Json() : Json(coefficients.string())},
          {"verdict", name_of(analysis.flight.readiness())},
          {"thrust_error", analysis.flight.error},
          {"doubts", doubts},
          {"k_unit", "N/(rad/s)^2"},
          {"K_T", K_T.value},
          {"K_T_u", K_T.combined()},
          {"K_T_expanded_95", K_T.expanded()},
          {"not_known", K_T.not_known()},
          {"assumed", K_T.assumed()},
          {"k_standard", analysis.standard.empty() ? kUnknown : analysis.standard.front().value},
          {"air_density_kg_m3", identification.air ? identification.air->value : kUnknown},
          {"curve", curve},
          {"overlap", compensation::name_of(identification.options.overlap)},
          {"table", table},
          {"steps_used", identification.selection.used.size()},
          {"steps_flagged", identification.selection.flagged.size()},
          {"estimator", name_of(identification.options.estimator)},
          {"weights", name_of(identification.options.weighting)},
          {"loss", name_of(identification.options.loss)},
          {"curve_loss", name_of(identification.options.curve.loss)},
          {"analysis", analysis}};
}

std::string plus_minus_words(const Budget& budget) {
  const std::vector<std::string> missing = budget.not_known();
  if (!(budget.combined() > 0))
    return "no u of k was given: that of each k is unknown; ± of the curve, if any, is 95 % by the scatter of its "
           "points";
  const std::vector<std::string> assumed = budget.assumed();
  std::string text = "± is 95 % by the GUM";
  if (!assumed.empty()) text += fmt::format("; assumed in it, since not measured: {}", fmt::join(assumed, ", "));
  if (!missing.empty()) text += fmt::format("; unknown and not in it: {}", fmt::join(missing, ", "));
  return text + (assumed.empty() && missing.empty() ? "" : " (see `--u`)");
}

std::string headline_text(const Fitted& fitted) {
  const auto& [identification, analysis] = fitted;
  const Budget& K_T = analysis.coefficients.front();
  std::string text = fmt::format("{:<10} {}\n", "verdict", verdict_line(analysis.flight));
  for (const Doubt& doubt : analysis.flight.doubts) text += fmt::format("{:<10} {}\n", "", doubt.text);
  text += number_line("K_T", K_T);
  for (std::size_t i = 0; i < analysis.parameters.size(); ++i)
    if (identification.curve_fit.parameters[i].at_deg != 0.0)  // K_T once more
      text += number_line(analysis.parameters[i].quantity, analysis.parameters[i],
                          identification.curve_fit.parameters[i].per);
  if (!analysis.standard.empty()) text += number_line("k_standard", analysis.standard.front());
  text += torque_line(analysis.torque);
  return text + plus_minus_words(analysis.standard.empty() ? K_T : analysis.standard.front()) + "\n";
}

std::string caution_text(const Identification& identification, const Analysis& analysis) {
  std::string text = flagged_text(identification.selection.flagged);
  for (const RejectedPoint& point : analysis.rejected) {
    text += fmt::format("rejected      phi {}°, repetition {}, step {}: {:+.3f} N off, robust weight {:.2f}\n",
                        point.phi_deg, point.repetition, point.step + 1, point.residual_n, point.robust_weight);
  }
  for (const std::string& remark : analysis.remarks) text += fmt::format("remark        {}\n", remark);
  if (!identification.air)
    text +=
        "air density   unknown: k holds for the air of that day only; a bench measures it with `ambient:`, "
        "`kphi import` takes --air-density-kg-m3\n";
  return text;
}

}  // namespace kphi::fit
