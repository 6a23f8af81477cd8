#include "fit/report/analysis_section.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "compensation/units.hpp"
#include "fit/report/html.hpp"

namespace kphi::fit {
namespace {

std::string table(const std::string& heads) {
  return "<div class=\"scroll\"><table><thead><tr>" + heads + "</tr></thead><tbody>\n";
}

constexpr const char* kTableEnd = "</tbody></table></div>\n";

std::string percent(double share) { return fmt::format("{:.3f}", 100 * share); }

/// A true minus in front; the one of an exponent stays as it is.
std::string with_minus(const std::string& text) { return text.starts_with('-') ? "−" + text.substr(1) : text; }

std::string number(double value, const char* format = "{:.3g}") {
  return std::isfinite(value) ? with_minus(fmt::format(fmt::runtime(format), value)) : std::string("–");
}

/// Beyond some hundreds their number is no longer of interest.
std::string freedom_words(double freedom) {
  if (!std::isfinite(freedom)) return "∞";
  return freedom > 999 ? "&gt; 999" : fmt::format("{:.0f}", freedom);
}

/// The cell of one source in one budget, as a share of the value.
std::string budget_cell(const Budget& budget, const std::string& source) {
  for (const BudgetRow& row : budget.rows) {
    if (row.source != source) continue;
    return row.known() ? percent(row.contribution() / std::abs(budget.value)) : "?";
  }
  return "–";
}

std::string budget_rows(const std::vector<Budget>& budgets) {
  std::string html;
  for (const BudgetRow& row : budgets.front().rows) {
    html += fmt::format("<tr><td class=\"text\">{}</td><td>{}</td><td>{}</td>", typeset(row.source),
                        row.evaluation == Evaluation::type_a ? "A" : "B", row.common ? "all φ" : "one φ");
    for (const Budget& budget : budgets) html += "<td>" + budget_cell(budget, row.source) + "</td>";
    html += fmt::format("<td class=\"text\">{}</td></tr>\n", typeset(row.note));
  }
  return html;
}

template <class Cell>
std::string sum_row(const std::vector<Budget>& budgets, const char* name, const Cell& cell) {
  std::string html = fmt::format("<tr><td class=\"text\"><b>{}</b></td><td></td><td></td>", name);
  for (const Budget& budget : budgets) html += "<td><b>" + cell(budget) + "</b></td>";
  return html + "<td></td></tr>\n";
}

/// `standard`: of the same coefficients in standard air; may be empty.
std::string budget_section(const std::vector<Budget>& budgets, const std::vector<Budget>& standard) {
  if (budgets.empty() || budgets.front().rows.empty()) return {};
  std::string heads = "<th class=\"text\">source</th><th>type</th><th>shared by</th>";
  for (const Budget& budget : budgets) heads += "<th>" + typeset(budget.quantity) + ", %</th>";
  std::string html =
      "<h2>Uncertainty budget</h2>\n" + table(heads + "<th class=\"text\">from</th>") + budget_rows(budgets);
  html += sum_row(budgets, "combined u", [](const Budget& b) { return percent(b.combined() / std::abs(b.value)); });
  html += sum_row(budgets, "degrees of freedom", [](const Budget& b) { return freedom_words(b.freedom()); });
  html += sum_row(budgets, "95 %: ±", [](const Budget& b) { return percent(b.expanded() / std::abs(b.value)); });
  if (standard.size() == budgets.size()) {
    html += sum_row(standard, "in standard air, 95 %: ±",
                    [](const Budget& b) { return percent(b.expanded() / std::abs(b.value)); });
  }
  return html + kTableEnd +
         "<p class=\"note\">By the GUM (JCGM 100): standard uncertainties in percent of each k. Type A comes from the "
         "scatter here, type B from elsewhere; what all coefficients share cancels in their ratios. A source that "
         "nobody knows is not in the sum.</p>\n";
}

std::string test_row(const HypothesisTest& test) {
  if (test.name.empty()) return {};
  const std::string freedom = (test.error_freedom > 0 ? fmt::format("{:.0f}, ", test.freedom) : "") +
                              freedom_words(test.error_freedom > 0 ? test.error_freedom : test.freedom);
  return fmt::format(
      "<tr><td class=\"text\">{}</td><td class=\"text\">{}</td><td>{} = {}</td><td>{}</td><td>{}</td><td "
      "class=\"text{}\">{}</td></tr>\n",
      typeset(test.name), typeset(test.hypothesis), html_escaped(test.statistic),
      number(test.value, std::abs(test.value) < 1000 ? "{:.3g}" : "{:.0f}"), freedom,
      !test.tested()    ? "–"
      : test.p < 0.0001 ? "&lt; 0.0001"
                        : fmt::format("{:.4f}", test.p),
      test.rejected() ? " bad" : "",
      !test.tested()    ? "not tested"
      : test.rejected() ? "rejected"
                        : "stands");
}

std::string test_section(const Analysis& analysis) {
  std::string rows;
  for (const SpeedDependence& one : analysis.speed) rows += test_row(one.lack_of_fit) + test_row(one.trend);
  rows += test_row(analysis.curvature.lack_of_fit) + test_row(analysis.curvature.quadratic);
  for (const HypothesisTest& test : analysis.differences) rows += test_row(test);
  if (rows.empty()) return {};
  return "<h2>Tests</h2>\n" +
         table(
             "<th class=\"text\">test</th><th class=\"text\">hypothesis</th><th>statistic</th><th>degrees of "
             "freedom</th><th>p</th><th class=\"text\">verdict (5 %)</th>") +
         rows + kTableEnd;
}

std::string speed_section(const std::vector<SpeedDependence>& speed) {
  if (speed.empty()) return {};
  std::string html = "<h2>k against speed</h2>\n" +
                     table("<th>φ</th><th>change of k over the range, %</th><th>±, %</th><th>beyond noise, %</th>");
  for (const SpeedDependence& one : speed) {
    const double k = one.levels.empty() ? 0 : one.levels.back().k;
    html += fmt::format("<tr><td>{:g}°</td><td>{}</td><td>{}</td><td>{}</td></tr>\n", one.phi_deg,
                        number(100 * one.change.value, "{:+.3f}"), number(100 * one.change.u, "{:.3f}"),
                        k > 0 ? number(100 * one.inadequacy / k, "{:.3f}") : "–");
  }
  return html + kTableEnd;
}

std::string torque_section(const std::vector<TorqueCoefficient>& torque) {
  if (torque.empty()) return {};
  std::string html =
      "<h2>Torque</h2>\n" + table(
                                "<th>φ</th><th>k<sub>Q</sub>, N m/(rad/s)²</th><th>share of k<sub>Q</sub>(0)</th>"
                                "<th>±</th><th>κ = k<sub>Q</sub>/k, mm</th><th>±</th>");
  for (const TorqueCoefficient& one : torque) {
    html += fmt::format("<tr><td>{:g}°</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>\n", one.phi_deg,
                        with_power_of_ten(one.k_q.value, one.k_q.u), number(one.share, "{:.4f}"),
                        one.phi_deg == 0 ? "–" : number(one.share_u, "{:.4f}"),
                        number(1e3 * one.drag_per_thrust_m.value, "{:.4f}"),
                        number(1e3 * one.drag_per_thrust_m.u, "{:.4f}"));
  }
  return html + kTableEnd;
}

std::string prediction_section(const std::vector<LinePrediction>& predictions) {
  if (predictions.empty()) return {};
  std::string html =
      "<h2>What the line says in flight</h2>\n" +
      table(
          "<th>φ</th><th>k on the line, 10⁻⁶ N/(rad/s)²</th><th>95 %: ±</th><th>k<sub>i</sub></th><th>95 "
          "%: ±</th><th>u of the speed ω̂, %</th><th class=\"text\">remark</th>");
  for (const LinePrediction& one : predictions) {
    html += fmt::format(
        "<tr><td>{:g}°</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td class=\"text\">{}</td></tr>\n",
        one.phi_deg, number(1e6 * one.k.value, "{:.5f}"), number(1e6 * one.k.expanded(), "{:.5f}"),
        number(one.scaling_factor.value, "{:.4f}"), number(one.scaling_factor.expanded(), "{:.4f}"),
        number(100 * one.speed_u_share, "{:.3f}"),
        one.clipped        ? "above K<sub>T</sub>, held at 1"
        : one.extrapolated ? "not measured here"
                           : "");
  }
  return html + kTableEnd;
}

std::string rejected_section(const Analysis& analysis) {
  std::string html;
  if (analysis.rejected.empty()) return html;
  html += "<h2>Points that the robust loss gave up</h2>\n" +
          table(
              "<th>φ</th><th>repetition</th><th>step</th><th>speed, RPM</th><th>thrust, N</th><th>residual, "
              "N</th><th>weight</th>");
  for (const RejectedPoint& point : analysis.rejected) {
    html += fmt::format(
        "<tr><td>{:g}°</td><td>{}</td><td>{}</td><td>{:.0f}</td><td>{:.4f}</td><td>{}</td><td>{}</td></tr>\n",
        point.phi_deg, point.repetition, point.step + 1, to_rpm(RadPerSec(point.speed_rad_s)), point.thrust_n,
        number(point.residual_n, "{:+.4f}"), number(point.robust_weight, "{:.3f}"));
  }
  return html + kTableEnd;
}

const char* words(Verdict verdict) {
  switch (verdict) {
    case Verdict::holds:
      return "holds";
    case Verdict::fails:
      return "fails";
    case Verdict::undecided:
      return "undecided";
    case Verdict::not_tested:
      return "not tested";
  }
  return "not tested";
}

std::string interval(double lower, double upper) {
  if (!std::isfinite(lower) && !std::isfinite(upper)) return "–";
  return number(lower, "{:.4g}") + " to " + number(upper, "{:.4g}");
}

}  // namespace

std::string remark_section(std::span<const std::string> remarks) {
  if (remarks.empty()) return {};
  std::string html = "<div class=\"remarks\"><h3>To be known before this is flown</h3>\n<ul>\n";
  for (const std::string& remark : remarks) html += "<li>" + typeset(remark) + "</li>\n";
  return html + "</ul></div>\n";
}

std::string analysis_sections(const Analysis& analysis) {
  return rejected_section(analysis) + budget_section(analysis.coefficients, analysis.standard) +
         prediction_section(analysis.predictions) + speed_section(analysis.speed) + test_section(analysis) +
         torque_section(analysis.torque);
}

std::string claims_section(std::span<const Claim> claims) {
  if (claims.empty()) return {};
  std::string html = "<h2>The paper's statements</h2>\n" +
                     table(
                         "<th class=\"text\">statement</th><th>found</th><th>95 %</th><th>allowed</th><th "
                         "class=\"text\">unit</th><th class=\"text\">verdict</th>");
  for (const Claim& claim : claims) {
    html += fmt::format(
        "<tr><td class=\"text\">{}</td><td>{}</td><td>{}</td><td>{}</td><td class=\"text\">{}</td><td "
        "class=\"text{}\">{}</td></tr>\n",
        typeset(claim.statement), number(claim.value, "{:.4g}"), interval(claim.lower, claim.upper),
        interval(claim.allowed_lower, claim.allowed_upper), typeset(claim.unit),
        claim.verdict == Verdict::fails ? " bad" : "", words(claim.verdict));
  }
  return html + kTableEnd;
}

std::string slopes_section(std::span<const SharedSlope> slopes) {
  if (slopes.empty()) return {};
  std::string html =
      "<h2>One slope for each diameter</h2>\n" +
      table(
          "<th>diameter, in</th><th class=\"text\">propellers</th><th>slope, N/(rad/s)² per degree</th><th>95 %, "
          "±</th><th>equal slopes, p</th>");
  for (const SharedSlope& one : slopes) {
    html += fmt::format("<tr><td>{:g}</td><td class=\"text\">{}</td><td>{}</td><td>{:.1e}</td><td>{:.4f}</td></tr>\n",
                        one.diameter_in, html_escaped(fmt::format("{}", fmt::join(one.propellers, ", "))),
                        with_power_of_ten(one.slope.value, std::hypot(one.slope.u, one.common_u)), one.expanded(),
                        one.equal_slopes.p);
  }
  return html + kTableEnd +
         "<p class=\"note\">From the scatter of runs and steps, the zero, and what all share. The line of a single "
         "propeller takes "
         "none of its points for more certain than 0.1 % of K<sub>T</sub>.</p>\n";
}

}  // namespace kphi::fit
