#include "fit/report/analysis_sections.hpp"

#include <fmt/format.h>

#include <cmath>

#include "compensation/units.hpp"
#include "fit/model/torque_power.hpp"
#include "fit/report/fit_summary.hpp"
#include "fit/report/html.hpp"

namespace kphi::fit {
namespace {

using Cells = std::vector<std::string>;

/// N/(rad/s)² → N/RPM², for numbers on the page.
double per_rpm2(double k) { return to_newtons_per_rpm2(ThrustCoefficient(k)); }

std::string percent(double share) { return fmt::format("{:.3f}", 100 * share); }

constexpr double kNoError = 0;  // the number then shows six digits

/// N/(rad/s)², and below it N/RPM².
std::string both_units(double k, double error) {
  return with_power_of_ten(k, error) + "<br/><span class=\"soft\">" + with_power_of_ten(per_rpm2(k), per_rpm2(error)) +
         "</span>";
}

/// Two decimals with a true minus, and no sign before zero.
std::string signed_percent(double percent) {
  const std::string digits = fmt::format("{:.2f}", std::abs(percent));
  if (digits == "0.00") return "0.00 %";
  return (percent < 0 ? "−" : "+") + digits + " %";
}

/// Above some hundreds the number does not matter.
std::string freedom_words(double freedom) {
  if (!std::isfinite(freedom)) return "∞";
  return freedom > 999 ? "&gt; 999" : fmt::format("{:.0f}", freedom);
}

/// The contribution of one source to one budget, as a share of the value.
std::string budget_cell(const Budget& budget, const std::string& source) {
  for (const BudgetRow& row : budget.rows) {
    if (row.source != source) continue;
    return row.known() ? percent(row.contribution() / std::abs(budget.value)) : "?";
  }
  return "–";
}

template <class Cell>
void sum_row(HtmlTable& table, const std::vector<Budget>& budgets, const char* name, const Cell& cell) {
  Cells cells{fmt::format("<b>{}</b>", name), "", ""};
  for (const Budget& budget : budgets) cells.push_back("<b>" + cell(budget) + "</b>");
  cells.emplace_back();
  table.row(cells);
}

/// `standard`: of the same coefficients in standard air; may be empty.
std::string budget_section(const std::vector<Budget>& budgets, const std::vector<Budget>& standard) {
  if (budgets.empty() || budgets.front().rows.empty()) return {};
  std::vector<HtmlTable::Heading> headings{HtmlTable::text("source"), "type", "shared by"};
  for (const Budget& budget : budgets) headings.emplace_back(typeset(budget.quantity) + ", %");
  headings.push_back(HtmlTable::text("from"));
  HtmlTable table(headings);
  for (const BudgetRow& row : budgets.front().rows) {
    Cells cells{typeset(row.source), row.evaluation == Evaluation::type_a ? "A" : "B", row.common ? "all φ" : "one φ"};
    for (const Budget& budget : budgets) cells.push_back(budget_cell(budget, row.source));
    cells.push_back(typeset(row.note));
    table.row(cells);
  }
  const auto expanded = [](const Budget& b) { return percent(b.expanded() / std::abs(b.value)); };
  sum_row(table, budgets, "combined u", [](const Budget& b) { return percent(b.combined() / std::abs(b.value)); });
  sum_row(table, budgets, "degrees of freedom", [](const Budget& b) { return freedom_words(b.freedom()); });
  sum_row(table, budgets, "95 %: ±", expanded);
  if (standard.size() == budgets.size()) sum_row(table, standard, "in standard air, 95 %: ±", expanded);
  return html_section(
      "Uncertainty budget", table,
      "By the GUM (JCGM 100): standard uncertainties in percent of each k. Type A comes from the scatter of "
      "these measurements, type B from elsewhere. An error that all coefficients share cancels in their "
      "ratios. An unknown source (?) is missing in the sum.");
}

std::string probability(const HypothesisTest& test) {
  if (!test.tested()) return "–";
  return test.p < 0.0001 ? "&lt; 0.0001" : fmt::format("{:.4f}", test.p);
}

/// The verdict at the top of the page is the one judge of the model; k of neighbouring occlusions should differ.
std::string test_section(const Analysis& analysis) {
  HtmlTable table({HtmlTable::text("test"), HtmlTable::text("hypothesis"), "statistic", "degrees of freedom", "p"});
  const auto add = [&table](const HypothesisTest& test) {
    if (test.name.empty()) return;
    const bool f = test.error_freedom > 0;
    table.row({typeset(test.name), typeset(test.hypothesis),
               html_escaped(test.statistic) + " = " +
                   html_number(test.value, std::abs(test.value) < 1000 ? "{:.3g}" : "{:.0f}"),
               (f ? fmt::format("{:.0f}, ", test.freedom) : "") + freedom_words(f ? test.error_freedom : test.freedom),
               probability(test)});
  };
  for (const SpeedDependence& one : analysis.speed) {
    add(one.lack_of_fit);
    add(one.trend);
  }
  add(analysis.curvature.lack_of_fit);
  add(analysis.curvature.quadratic);
  for (const HypothesisTest& test : analysis.differences) add(test);
  return html_section(
      "Tests", table,
      "p is the probability of at least this statistic if the hypothesis is true; – : too few data. Among "
      "so many tests a single p below 0.05 is expected. The verdict at the top of the page judges all of the "
      "model together (Holm, 5 %). What all runs share no test finds: a gain of the load cell is in ± as its "
      "calibration; a wrong number of poles, a wrong torque arm and plates that are all off alike are in no part of "
      "it.");
}

std::string speed_section(const std::vector<SpeedDependence>& speed) {
  HtmlTable table({"φ", "change of k over the range, %", "u, %", "u of k at any speed, %"});
  for (const SpeedDependence& one : speed) {
    const double k = one.levels.empty() ? 0 : one.levels.back().k;
    table.row({html_angle(one.phi_deg), html_number(100 * one.change.value, "{:+.3f}"),
               html_number(100 * one.change.u, "{:.3f}"),
               k > 0 ? html_number(100 * one.inadequacy / k, "{:.3f}") : "–"});
  }
  return html_section("k against speed", table);
}

std::string torque_section(const std::vector<TorqueCoefficient>& torque) {
  HtmlTable table({"φ", "k<sub>Q</sub>, N m/(rad/s)²", "share of k<sub>Q</sub>(0)", "95 %: ±",
                   "κ = k<sub>Q</sub>/k, mm", "95 %: ±"});
  for (const TorqueCoefficient& one : torque)
    table.row({html_angle(one.phi_deg), with_power_of_ten(one.k_q.value, one.k_q.expanded()),
               html_number(one.share.value, "{:.4f}"),
               one.phi_deg == 0 ? "–" : html_number(expanded(one.share), "{:.4f}"),
               html_number(1e3 * one.drag_per_thrust_m.value, "{:.4f}"),
               html_number(1e3 * expanded(one.drag_per_thrust_m), "{:.4f}")});
  return html_section("Torque", table,
                      torque.empty()
                          ? ""
                          : typeset(plus_minus_words(torque.front().k_q)) +
                                ". The load cell's "
                                "calibration and mountings count as for the thrust; the motor's clock cancels in κ.");
}

std::string prediction_section(const std::vector<CurvePrediction>& predictions) {
  HtmlTable table({"φ", "k(φ), 10⁻⁶ N/(rad/s)²", "95 %: ±", "k<sub>i</sub>", "95 %: ±", "u of the speed ω̂, %",
                   HtmlTable::text("remark")});
  for (const CurvePrediction& one : predictions)
    table.row({html_angle(one.phi_deg), html_number(1e6 * one.k.value, "{:.5f}"),
               html_number(1e6 * one.k.expanded(), "{:.5f}"), html_number(one.scaling_factor.value, "{:.4f}"),
               html_number(one.scaling_factor.expanded(), "{:.4f}"), html_number(100 * one.speed_u_share, "{:.3f}"),
               one.clipped        ? "above K<sub>T</sub>, held at 1"
               : one.extrapolated ? "extrapolated"
                                  : ""});
  return html_section("k(φ) in flight", table);
}

std::string rejected_section(const std::vector<RejectedPoint>& rejected) {
  HtmlTable table({"φ", "repetition", "step", "speed, RPM", "thrust, N", "residual, N", "robust weight"});
  for (const RejectedPoint& point : rejected)
    table.row({html_angle(point.phi_deg), fmt::format("{}", point.repetition), fmt::format("{}", point.step + 1),
               html_rpm(point.speed_rad_s), fmt::format("{:.4f}", point.thrust_n),
               html_number(point.residual_n, "{:+.4f}"), html_number(point.robust_weight, "{:.3f}")});
  return html_section("Points rejected by the robust fit", table);
}

}  // namespace

double share_of_thrust(const Identification& identification, const OcclusionCoefficient& row) {
  const auto& nominal = identification.table.front().at_speed;
  return row.at_speed && nominal ? row.at_speed->k / nominal->k : row.k / identification.thrust_coefficient().value;
}

std::string coefficient_section(const Fitted& fitted) {
  const auto& [identification, analysis] = fitted;
  const std::string at =
      identification.at_speed_rad_s > 0 ? " at " + html_rpm(identification.at_speed_rad_s) + " RPM" : "";
  const std::string units = ", N/(rad/s)²<br/><span class=\"soft\">N/RPM²</span>";
  HtmlTable table({"φ", "k" + units, "k" + at + units, "thrust share<br/>" + at, "k(φ) − k", "residual<br/>rms, mN",
                   "R²", "steps"});
  for (std::size_t i = 0; i < identification.table.size(); ++i) {
    const OcclusionCoefficient& row = identification.table[i];
    const double miss =
        identification.alone() ? 0 : identification.curve().at(from_degrees(row.phi_deg)).value() - row.k;
    table.row({html_angle(row.phi_deg), both_units(row.k, analysis.coefficients[i].expanded()),
               row.at_speed ? both_units(row.at_speed->k, kNoError) : "–",
               fmt::format("{:.1f} %", 100 * share_of_thrust(identification, row)),
               identification.alone() ? "–" : signed_percent(100 * miss / identification.thrust_coefficient().value),
               row.fit ? fmt::format("{:.2f}", 1e3 * row.fit->rms_n) : "–",
               row.fit ? fmt::format("{:.5f}", row.fit->r_squared) : "–",
               row.fit ? fmt::format("{}", row.fit->n) : "–"});
  }
  return html_section(
      "Coefficients", table,
      typeset(plus_minus_words(analysis.coefficients.front())) +
          ". The budget below lists its sources. k(φ) − k is in percent of K<sub>T</sub>; the thrust share "
          "is k over k(0) at the same speed.");
}

std::string standard_section(const Fitted& fitted) {
  const auto& [identification, analysis] = fitted;
  const char* const title = "In standard air, 1.225 kg/m³";
  if (analysis.standard.empty()) {
    return html_heading(title) +
           "<p class=\"warning\">Air density unknown: k holds for the air of that day only, and k at standard density "
           "is not given. 10 K or 30 hPa change the density by 3 %. A bench measures it with `ambient:`, "
           "<code>kphi import</code> takes --air-density-kg-m3.</p>\n";
  }
  HtmlTable table({"φ", "k · 1.225/ρ, N/(rad/s)²", "N/RPM²"});
  for (std::size_t i = 0; i < analysis.standard.size(); ++i) {
    const Budget& k = analysis.standard[i];
    table.row({html_angle(identification.table[i].phi_deg), with_power_of_ten(k.value, k.expanded()),
               with_power_of_ten(per_rpm2(k.value), per_rpm2(k.expanded()))});
  }
  return html_heading(title) +
         fmt::format("<p>Measured in air of {:.4f} kg/m³, standard uncertainty {:.4f}.</p>\n",
                     identification.air->value, identification.air->u) +
         table.html() + html_note(typeset(plus_minus_words(analysis.standard.front())) + ".");
}

std::string analysis_sections(const Analysis& analysis) {
  return rejected_section(analysis.rejected) + budget_section(analysis.coefficients, analysis.standard) +
         prediction_section(analysis.predictions) + speed_section(analysis.speed);
}

std::string analysis_appendix(const Analysis& analysis) {
  return test_section(analysis) + torque_section(analysis.torque);
}

}  // namespace kphi::fit
