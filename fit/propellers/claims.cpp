#include "fit/propellers/claims.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <set>

#include "base/csv.hpp"
#include "base/error.hpp"
#include "compensation/units.hpp"

namespace kphi::fit {
namespace {

using Family = std::span<const Fitted>;

const Fitted* find(Family family, double diameter_in, int blades) {
  for (const Fitted& member : family) {
    const Identification& one = member.identification;
    if (std::abs(one.diameter_in - diameter_in) < 0.01 && one.blades == blades) return &member;
  }
  return nullptr;
}

std::optional<Estimate> k_of(const Fitted* member, double phi_deg, Air air) {
  if (member == nullptr) return std::nullopt;
  const auto& table = member->identification.table;
  const auto& budgets = air == Air::standard ? member->analysis.standard : member->analysis.coefficients;
  for (std::size_t i = 0; i < table.size(); ++i)
    if (std::abs(table[i].phi_deg - phi_deg) < 1e-6) return budgets[i].estimate();
  return std::nullopt;
}

std::optional<Estimate> slope_of(const Fitted* member, Air air) {
  if (member == nullptr) return std::nullopt;
  Estimate slope = member->analysis.line.slope.estimate();
  if (air == Air::measured) return slope;
  const Budget& standard = member->analysis.standard.front();
  const double scale = standard.value / member->analysis.coefficients.front().value;
  const double u_scale = standard.rows.back().contribution() / std::abs(standard.value);  // of the density
  slope.u = scale * std::hypot(slope.u, slope.value * u_scale);
  slope.value *= scale;
  return slope;
}

std::optional<Estimate> ratio(const std::optional<Estimate>& a, const std::optional<Estimate>& b) {
  if (!a || !b || a->value == 0 || b->value == 0) return std::nullopt;
  const Estimate relative =
      difference({0, a->u / std::abs(a->value), a->freedom}, {0, b->u / std::abs(b->value), b->freedom});
  const double value = a->value / b->value;
  return Estimate{value, std::abs(value) * relative.u, relative.freedom};
}

std::optional<Estimate> in_rpm(std::optional<Estimate> k) {
  if (!k) return k;
  k->value = to_newtons_per_rpm2(ThrustCoefficient(k->value));
  k->u = to_newtons_per_rpm2(ThrustCoefficient(k->u));
  return k;
}

std::optional<Estimate> minus(const std::optional<Estimate>& a, const std::optional<Estimate>& b) {
  if (!a || !b) return std::nullopt;
  return difference(*a, *b);
}

Claim judged(std::string id, std::string statement, std::string unit, const std::optional<Estimate>& found,
             double allowed_lower, double allowed_upper) {
  Claim claim{.id = std::move(id),
              .statement = std::move(statement),
              .unit = std::move(unit),
              .allowed_lower = allowed_lower,
              .allowed_upper = allowed_upper};
  if (!found) return claim;
  const double half = coverage_factor(found->freedom) * found->u;
  claim.value = found->value;
  claim.lower = found->value - half;
  claim.upper = found->value + half;
  if (!std::isfinite(half) || !std::isfinite(found->value)) return claim;
  const bool inside = claim.lower >= allowed_lower && claim.upper <= allowed_upper;
  const bool outside = claim.upper < allowed_lower || claim.lower > allowed_upper;
  claim.verdict = inside ? Verdict::holds : outside ? Verdict::fails : Verdict::undecided;
  return claim;
}

/// A test that does not reject is no proof: the claim then holds as far as these data show.
Claim linear(const Fitted& member) {
  const HypothesisTest& test = member.analysis.line.test.lack_of_fit;
  const std::string& propeller = member.identification.propeller;
  Claim claim = judged(fmt::format("linear_{}", propeller),
                       fmt::format("thrust falls linearly with the occlusion ({})", propeller), "1", {}, kTestLevel, 1);
  claim.is_p = true;
  if (!test.tested()) return claim;
  claim.value = test.p;  // without an interval
  claim.verdict = test.rejected() ? Verdict::fails : Verdict::holds;
  return claim;
}

/// The errors that all k of a campaign share cancel in it.
std::optional<Estimate> share_of_thrust(const Fitted* member, double phi_deg) {
  const auto own = [&](double phi) -> std::optional<Estimate> {
    const auto whole = k_of(member, phi, Air::measured);
    if (!whole) return whole;
    const auto row = std::ranges::find(member->identification.table, phi, &OcclusionCoefficient::phi_deg);
    Budget budget = member->analysis.coefficients[static_cast<std::size_t>(row - member->identification.table.begin())];
    std::erase_if(budget.rows, &BudgetRow::common);
    return budget.estimate();
  };
  return ratio(own(phi_deg), own(0));
}

/// The smallest lead over the φ in the share of thrust that three blades keep more than two.
std::optional<Estimate> least_lead(const Fitted* three, const Fitted* two) {
  std::optional<Estimate> least;
  for (const double phi : {90.0, 180.0, 270.0}) {
    const auto lead = minus(share_of_thrust(three, phi), share_of_thrust(two, phi));
    if (lead && (!least || lead->value < least->value)) least = lead;
  }
  return least;
}

void claims_of_diameter(Family family, Air air, double diameter, double offset, std::vector<Claim>& claims) {
  const Fitted* two = find(family, diameter, 2);
  const Fitted* three = find(family, diameter, 3);
  claims.push_back(
      judged(fmt::format("slopes_{}in", diameter),
             fmt::format("{}-inch propellers of 2 and 3 blades have the same slope: ratio, 15 % allowed", diameter),
             "1", ratio(slope_of(three, air), slope_of(two, air)), 0.85, 1.15));
  claims.push_back(
      judged(fmt::format("offset_{}in", diameter),
             fmt::format("3 blades of {} inch have {:.1e} N/RPM^2 more k than 2: 25 % allowed", diameter, offset),
             "N/RPM^2", in_rpm(minus(k_of(three, 0, air), k_of(two, 0, air))), 0.75 * offset, 1.25 * offset));
  claims.push_back(judged(
      fmt::format("order_{}in", diameter),
      fmt::format("beyond 45 deg 3 blades of {} inch keep more of their thrust than 2: least lead of shares", diameter),
      "1", least_lead(three, two), 0, 1));
}

/// Mean over the φ at which k is far from 0.
std::optional<Estimate> growth_per_inch(Family family, Air air, int blades) {
  const Fitted* five = find(family, 5, blades);
  const Fitted* six = find(family, 6, blades);
  std::optional<Estimate> mean;
  double n = 0;
  for (const double phi : {0.0, 45.0, 90.0, 180.0}) {
    const auto one = ratio(k_of(six, phi, air), k_of(five, phi, air));
    if (!one) continue;
    ++n;
    if (!mean) mean = Estimate{0, 0, one->freedom};
    mean->value += one->value;
    mean->u += one->u;  // the bench's errors are common and do not average out
    mean->freedom = std::min(mean->freedom, one->freedom);
  }
  if (mean) mean = Estimate{mean->value / n, mean->u / n, mean->freedom};
  return mean;
}

std::string between(double lower, double upper) {
  return std::isfinite(lower) || std::isfinite(upper) ? fmt::format("{:.4g} to {:.4g}", lower, upper) : "-";
}

std::string test_line(const Claim& claim) {
  const bool tested = claim.verdict != Verdict::not_tested;
  return fmt::format("{:<11} {:>14}  {}\n", name_of(claim.verdict), tested ? fmt::format("{:.4f}", claim.value) : "-",
                     claim.statement);
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

}  // namespace

const char* name_of(Verdict verdict) {
  constexpr std::array<const char*, 4> names{"holds", "fails", "undecided", "not tested"};
  return names[static_cast<std::size_t>(verdict)];
}

std::span<const PaperShare> paper_shares_of(const Identification& propeller) {
  if (propeller.blades != 3 || std::abs(propeller.diameter_in - 5) >= 0.01) return {};
  return kPaperShares;
}

std::vector<Claim> test_claims(std::span<const Fitted> family) {
  std::vector<Claim> claims;
  for (const Fitted& member : family) claims.push_back(linear(member));
  const Air air = common_air(family);
  const Fitted* drone = find(family, 5, 3);
  for (const auto& [phi, share, lower, upper, words] : kPaperShares)
    claims.push_back(
        judged(fmt::format("share_{}", phi),
               fmt::format("5-inch 3-blade at {} deg: {} of its thrust, {} to {}", phi, words, lower, upper), "1",
               share_of_thrust(drone, phi), lower, upper));
  claims_of_diameter(family, air, 5, 0.4e-8, claims);
  claims_of_diameter(family, air, 6, 0.5e-8, claims);
  const double power = std::pow(6.0 / 5.0, 4);
  for (const int blades : {2, 3}) {
    const auto growth = growth_per_inch(family, air, blades);
    claims.push_back(judged(fmt::format("inch_{}b", blades),
                            fmt::format("one inch more doubles k, {} blades: ratio, 1.7 to 2.2", blades), "1", growth,
                            1.7, 2.2));
    claims.push_back(judged(fmt::format("d4_{}b", blades),
                            fmt::format("k goes with D^4, {} blades: ratio, {:.3f} within 15 %", blades, power), "1",
                            growth, 0.85 * power, 1.15 * power));
  }
  return claims;
}

PropellerSize parse_propeller_size(const std::string& text) {
  const std::size_t cross = text.find('x');
  const auto diameter = parse_number(text.substr(0, cross));
  const auto blades = cross == std::string::npos ? std::nullopt : parse_number(text.substr(cross + 1));
  if (!diameter || !blades || !(*diameter > 0) || *blades < 1 || *blades > 12 || *blades != std::floor(*blades))
    throw ConfigurationError("--predict " + text + ": expected DIAMETERxBLADES, in inches, such as 7x3");
  return {*diameter, static_cast<int>(*blades)};
}

FamilyFindings findings_of(std::span<const Fitted> family, std::span<const PropellerSize> sizes) {
  FamilyFindings findings{common_air(family), test_claims(family), shared_slopes(family), {}};
  std::set<double> phis;
  for (const Fitted& member : family)
    for (const OcclusionCoefficient& row : member.identification.table) phis.insert(row.phi_deg);
  for (const Fitted& member : family)
    if (!sizes.empty() && !(member.identification.diameter_in > 0))
      throw ConfigurationError("--predict: the diameter of " + member.identification.propeller +
                               " is unknown; `kphi fit --diameter-in` writes it into the file");
  for (const PropellerSize& size : sizes) {
    for (const double phi : phis) {
      const auto prediction = predict(family, size.diameter_in, size.blades, phi);
      if (!prediction)
        throw ConfigurationError(
            "--predict: the rule k = D^4 (a + b blades + c phi) needs at least three propellers, with two blade "
            "numbers among them");
      findings.predictions.push_back(*prediction);
    }
  }
  return findings;
}

namespace {

std::string claims_text(std::span<const Claim> claims) {
  std::string text = fmt::format("{:<11} {:>14}  the paper's statement; a test rejects it where p is below {}\n",
                                 "verdict", "p, lack of fit", kTestLevel);
  for (const Claim& claim : claims)
    if (claim.is_p) text += test_line(claim);
  text += fmt::format("\n{:<11} {:>12} {:>24} {:>24}  {:<9} {}\n", "verdict", "found", "95 %", "allowed", "unit",
                      "the paper's statement");
  for (const Claim& claim : claims)
    if (!claim.is_p) text += claim_line(claim);
  return text + "\n";
}

}  // namespace

std::string family_text(const FamilyFindings& findings) {
  std::string text = findings.claims.empty() ? "" : claims_text(findings.claims);
  text += findings.air == Air::standard
              ? "Propellers are compared in standard air, 1.225 kg/m3.\n"
              : "Propellers are compared in the air of their days: some densities are unknown.\n";
  if (!findings.slopes.empty()) text += "\nOne slope for each diameter\n";
  for (const SharedSlope& one : findings.slopes) text += slope_line(one);
  if (!findings.predictions.empty()) text += "\nPrediction for propellers that were not measured\n";
  for (const FamilyPrediction& one : findings.predictions)
    text += fmt::format("{:g}x{} at {:g} deg: k = {:.4e} N/(rad/s)^2, 95 %: {:.3e} to {:.3e}\n", one.diameter_in,
                        one.blades, one.phi_deg, one.k.value, one.lower, one.upper);
  return text;
}

}  // namespace kphi::fit
