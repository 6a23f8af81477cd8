#include "fit/report/family_table.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <set>

#include "base/csv.hpp"
#include "base/error.hpp"
#include "fit/report/analysis_json.hpp"

namespace kphi::fit {
namespace {

using Json = nlohmann::ordered_json;

std::string between(double lower, double upper) {
  return std::isfinite(lower) || std::isfinite(upper) ? fmt::format("{:.4g} to {:.4g}", lower, upper) : "-";
}

std::string claim_line(const Claim& claim) {
  const bool tested = claim.verdict != Verdict::not_tested;
  return fmt::format("{:<11} {:>12} {:>24} {:>24}  {:<9} {}\n", name_of(claim.verdict),
                     tested ? fmt::format("{:.4g}", claim.value) : "-",
                     tested ? between(claim.lower, claim.upper) : "-",
                     between(claim.allowed_lower, claim.allowed_upper), claim.unit, claim.statement);
}

std::string slope_line(const SharedSlope& one) {
  return fmt::format(
      "{:g} inch: {:.5e} ± {:.1e} N/(rad/s)^2 per degree (95 %), shared by {}; equal slopes: p = {:.4f}\n",
      one.diameter_in, one.slope.value, one.expanded(), fmt::join(one.propellers, ", "), one.equal_slopes.p);
}

std::string prediction_line(const FamilyPrediction& one) {
  return fmt::format("{:g}x{} at {:g} deg: k = {:.4e} N/(rad/s)^2, 95 %: {:.3e} to {:.3e}\n", one.diameter_in,
                     one.blades, one.phi_deg, one.k.value, one.lower, one.upper);
}

}  // namespace

PropellerSize parse_propeller_size(const std::string& text) {
  const std::size_t cross = text.find('x');
  const auto diameter = parse_number(text.substr(0, cross));
  const auto blades = cross == std::string::npos ? std::nullopt : parse_number(text.substr(cross + 1));
  if (!diameter || !blades || !(*diameter > 0) || *blades < 1 || *blades > 12 || *blades != std::floor(*blades))
    throw ConfigurationError("--predict " + text + ": expected DIAMETERxBLADES, in inches, such as 7x3");
  return {*diameter, static_cast<int>(*blades)};
}

FamilyFindings findings_of(std::span<const FamilyMember> family, std::span<const PropellerSize> sizes) {
  FamilyFindings findings{common_air(family), test_claims(family), shared_slopes(family), {}};
  std::set<double> phis;
  for (const FamilyMember& member : family)
    for (const OcclusionCoefficient& row : member.identification.table) phis.insert(row.phi_deg);
  for (const FamilyMember& member : family)
    if (!sizes.empty() && !(member.identification.diameter_in > 0))
      throw ConfigurationError("--predict: the diameter of " + member.identification.propeller +
                               " is not known; `kphi fit --diameter-in` writes it into the file");
  for (const PropellerSize& size : sizes) {
    for (const double phi : phis) {
      const auto prediction = predict(family, size.diameter_in, size.blades, phi);
      if (!prediction)
        throw ConfigurationError(
            "--predict: the rule k = D^4 (a + b blades + c phi) uses up as many propellers as there are; it needs at "
            "least three, with two blade numbers among them");
      findings.predictions.push_back(*prediction);
    }
  }
  return findings;
}

std::string family_text(const FamilyFindings& findings) {
  std::string text = fmt::format("{:<11} {:>12} {:>24} {:>24}  {:<9} {}\n", "verdict", "found", "95 %", "allowed",
                                 "unit", "the paper's statement");
  for (const Claim& claim : findings.claims) text += claim_line(claim);
  text += findings.air == Air::standard
              ? "\nPropellers are compared in standard air, 1.225 kg/m3.\n"
              : "\nPropellers are compared in the air of their days: not all densities are known.\n";
  if (!findings.slopes.empty()) text += "\nOne slope for each diameter\n";
  for (const SharedSlope& one : findings.slopes) text += slope_line(one);
  if (!findings.predictions.empty()) text += "\nExpected of propellers that were not measured\n";
  for (const FamilyPrediction& one : findings.predictions) text += prediction_line(one);
  return text;
}

Json to_json(const FamilyFindings& findings) {
  Json slopes = Json::array(), predictions = Json::array();
  for (const SharedSlope& one : findings.slopes) {
    slopes.push_back({{"diameter_in", one.diameter_in},
                      {"slope_per_deg", one.slope.value},
                      {"u", one.slope.u},
                      {"u_common", one.common_u},
                      {"propellers", one.propellers},
                      {"equal_slopes", to_json(one.equal_slopes)}});
  }
  for (const FamilyPrediction& one : findings.predictions) {
    predictions.push_back({{"diameter_in", one.diameter_in},
                           {"blades", one.blades},
                           {"phi_deg", one.phi_deg},
                           {"k", one.k.value},
                           {"u", one.k.u},
                           {"lower", one.lower},
                           {"upper", one.upper}});
  }
  return {{"k_unit", "N/(rad/s)^2"},
          {"air", findings.air == Air::standard ? "standard" : "measured"},
          {"claims", to_json(findings.claims)},
          {"shared_slopes", slopes},
          {"predictions", predictions}};
}

}  // namespace kphi::fit
