#include "fit/report/family_sections.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>

#include "fit/propellers/compare.hpp"
#include "fit/report/html.hpp"

namespace kphi::fit {
namespace {

std::string interval(double lower, double upper) {
  if (!std::isfinite(lower) && !std::isfinite(upper)) return "–";
  return html_number(lower, "{:.4g}") + " to " + html_number(upper, "{:.4g}");
}

}  // namespace

std::string family_section(std::span<const Fitted> family) {
  HtmlTable table({HtmlTable::text("propeller"), "diameter, in", "blades", "K<sub>T</sub>, N/(rad/s)²",
                   "K<sub>T</sub>/D⁴, N/((rad/s)² m⁴)", "slope of a line, N/(rad/s)² per degree",
                   "slope of a line, % of K<sub>T</sub> per degree"});
  for (const Fitted& fitted : family) {
    const Identification& one = fitted.identification;
    const Budget& K_T = fitted.analysis.coefficients.front();
    const Budget& slope = fitted.analysis.line.slope;
    const double diameter_m = 0.0254 * one.diameter_in;
    table.row({html_escaped(one.propeller), one.diameter_in > 0 ? fmt::format("{:g}", one.diameter_in) : "–",
               one.blades > 0 ? fmt::format("{}", one.blades) : "–", with_power_of_ten(K_T.value, K_T.expanded()),
               diameter_m > 0 ? fmt::format("{:.5f}", K_T.value / std::pow(diameter_m, 4)) : "–",
               with_power_of_ten(slope.value, slope.expanded()),
               html_number(100 * slope.value / K_T.value, "{:+.4f}")});
  }
  return html_section("The propellers side by side", table,
                      "± is 95 % by the GUM; what each lacks stands in its chapter.");
}

std::string logs_section(std::span<const Fitted> logs) {
  std::vector<ComparedResult> results;
  for (const Fitted& log : logs) results.push_back(result_of_log(log, Origin::unknown, log.identification.propeller));
  const SideBySide found = side_by_side(std::move(results), "");
  HtmlTable table({HtmlTable::text("log"), "K<sub>T</sub>, N/(rad/s)²", "from the median, %", "speeds, RPM",
                   HtmlTable::text("chance explains it")});
  for (std::size_t i = 0; i < found.results.size(); ++i) {
    const ComparedResult& one = found.results[i];
    const ComparedValue& K_T = one.estimates.front();
    table.row({html_escaped(one.name),
               with_power_of_ten(K_T.value, coverage_factor(K_T.freedom, 1 - kTestLevel) * K_T.standard_error),
               fmt::format("{:+.2f}", 100 * (K_T.value / found.median - 1)),
               html_rpm(one.speed_min_rad_s) + " to " + html_rpm(one.speed_max_rad_s), found.unlike[i] ? "no" : "yes"},
              found.unlike[i] ? std::optional<std::size_t>(4) : std::nullopt);
  }
  return html_section(
      "The logs side by side", table,
      fmt::format(
          "± is 95 %. The logs scatter by {:.1f} % (robust standard deviation); {}. Each is fitted over its own "
          "speeds; <code>kphi compare</code> takes those that all reached.",
          100 * found.spread, html_escaped(found.remarks.front())));
}

std::string slopes_section(std::span<const SharedSlope> slopes) {
  HtmlTable table(
      {"diameter, in", HtmlTable::text("propellers"), "slope, N/(rad/s)² per degree", "95 %, ±", "equal slopes, p"});
  for (const SharedSlope& one : slopes)
    table.row({fmt::format("{:g}", one.diameter_in), html_escaped(fmt::format("{}", fmt::join(one.propellers, ", "))),
               with_power_of_ten(one.slope.value, std::hypot(one.slope.u, one.common_u)),
               fmt::format("{:.1e}", one.expanded()), fmt::format("{:.4f}", one.equal_slopes.p)});
  return html_section(
      "One slope for each diameter", table,
      "± comes from the scatter of runs and steps, the zero, and the errors that all share. The line of a "
      "single propeller never takes a point as known better than 0.1 % of K<sub>T</sub>.");
}

std::string claims_section(std::span<const Claim> claims) {
  HtmlTable tests({HtmlTable::text("statement"), "p, lack of fit", HtmlTable::text("verdict")});
  HtmlTable table(
      {HtmlTable::text("statement"), "found", "95 %", "allowed", HtmlTable::text("unit"), HtmlTable::text("verdict")});
  for (const Claim& claim : claims) {
    const bool fails = claim.verdict == Verdict::fails;
    if (claim.is_p)
      tests.row({typeset(claim.statement), html_number(claim.value, "{:.4f}"), name_of(claim.verdict)},
                fails ? std::optional<std::size_t>(2) : std::nullopt);
    else
      table.row({typeset(claim.statement), html_number(claim.value, "{:.4g}"), interval(claim.lower, claim.upper),
                 interval(claim.allowed_lower, claim.allowed_upper), typeset(claim.unit), name_of(claim.verdict)},
                fails ? std::optional<std::size_t>(5) : std::nullopt);
  }
  return html_section("The paper's statements", tests,
                      fmt::format("The line fails where its test finds p below {}.", kTestLevel)) +
         html_section("The paper's numbers", table);
}

}  // namespace kphi::fit
