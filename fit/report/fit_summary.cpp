#include "fit/report/fit_summary.hpp"

#include <fmt/format.h>

#include <cmath>

#include "compensation/units.hpp"
#include "fit/report/analysis_json.hpp"
#include "fit/report/report.hpp"

namespace kphi::fit {
namespace {

using Json = nlohmann::ordered_json;

std::string number_line(const char* name, double value, double error, const char* per) {
  const auto rpm = [](double k) { return to_newtons_per_rpm2(ThrustCoefficient(k)); };
  return fmt::format("{:<10} {} N/(rad/s)^2{}  =  {} N/RPM^2{}\n", name, with_error(value, error), per,
                     with_error(rpm(value), rpm(error)), per);
}

}  // namespace

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
    text += "air density   unknown: k holds for the air of that day; write ambient: into the bench file\n";
  return text;
}

}  // namespace kphi::fit
