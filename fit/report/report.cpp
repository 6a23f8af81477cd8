#include "fit/report/report.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <map>

#include "compensation/units.hpp"
#include "fit/model/torque_power.hpp"
#include "fit/report/fit_summary.hpp"
#include "fit/report/html.hpp"
#include "fit/report/raw_samples.hpp"

namespace kphi::fit {
namespace {

using Cells = std::vector<std::string>;

/// Heading of a column of text.
HtmlTable::Heading text(const char* html) { return {html, HtmlTable::Column::text}; }

/// N/(rad/s)² → N/RPM², for numbers on the page.
double per_rpm2(double k) { return to_newtons_per_rpm2(ThrustCoefficient(k)); }

/// "19100"
std::string rpm_text(double speed_rad_s) { return fmt::format("{:.0f}", to_rpm(RadPerSec(speed_rad_s))); }

/// Thrust at the φ of `row` over the thrust at φ = 0, at the reference speed if there is one.
double share_of_thrust(const Identification& identification, const OcclusionCoefficient& row) {
  const auto& nominal = identification.table.front().at_speed;
  return row.at_speed && nominal ? row.at_speed->k / nominal->k : row.k / identification.thrust_coefficient().value;
}

/// Empty if the table is.
std::string section(std::string_view title, const HtmlTable& table, std::string_view note = {}) {
  const std::string html = table.html();
  return html.empty() ? html : html_heading(title) + html + (note.empty() ? "" : html_note(note));
}

std::string percent(double share) { return fmt::format("{:.3f}", 100 * share); }

std::string whole(std::size_t n) { return fmt::format("{}", n); }

constexpr double kNoError = 0;  // the number then shows six digits

/// N/(rad/s)², and below it N/RPM².
std::string both_units(double k, double error) {
  return with_power_of_ten(k, error) + "<br/><span class=\"soft\">" + with_power_of_ten(per_rpm2(k), per_rpm2(error)) +
         "</span>";
}

// ---- analysis ----------------------------------------------------------------------------------------------

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
  std::vector<HtmlTable::Heading> headings{text("source"), "type", "shared by"};
  for (const Budget& budget : budgets) headings.emplace_back(typeset(budget.quantity) + ", %");
  headings.push_back(text("from"));
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
  return section("Uncertainty budget", table,
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
  HtmlTable table({text("test"), text("hypothesis"), "statistic", "degrees of freedom", "p"});
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
  return section(
      "Tests", table,
      "p is the probability of at least this statistic if the hypothesis is true; – : too few data. Among "
      "so many tests a single p below 0.05 is expected. The verdict at the top of the page judges all of the "
      "model together (Holm, 5 %).");
}

std::string speed_section(const std::vector<SpeedDependence>& speed) {
  HtmlTable table({"φ", "change of k over the range, %", "±, %", "beyond noise, %"});
  for (const SpeedDependence& one : speed) {
    const double k = one.levels.empty() ? 0 : one.levels.back().k;
    table.row({html_angle(one.phi_deg), html_number(100 * one.change.value, "{:+.3f}"),
               html_number(100 * one.change.u, "{:.3f}"),
               k > 0 ? html_number(100 * one.inadequacy / k, "{:.3f}") : "–"});
  }
  return section("k against speed", table);
}

std::string torque_section(const std::vector<TorqueCoefficient>& torque) {
  HtmlTable table(
      {"φ", "k<sub>Q</sub>, N m/(rad/s)²", "share of k<sub>Q</sub>(0)", "±", "κ = k<sub>Q</sub>/k, mm", "±"});
  for (const TorqueCoefficient& one : torque)
    table.row({html_angle(one.phi_deg), with_power_of_ten(one.k_q.value, one.k_q.u), html_number(one.share, "{:.4f}"),
               one.phi_deg == 0 ? "–" : html_number(one.share_u, "{:.4f}"),
               html_number(1e3 * one.drag_per_thrust_m.value, "{:.4f}"),
               html_number(1e3 * one.drag_per_thrust_m.u, "{:.4f}")});
  return section("Torque", table);
}

std::string prediction_section(const std::vector<CurvePrediction>& predictions) {
  HtmlTable table(
      {"φ", "k(φ), 10⁻⁶ N/(rad/s)²", "95 %: ±", "k<sub>i</sub>", "95 %: ±", "u of the speed ω̂, %", text("remark")});
  for (const CurvePrediction& one : predictions)
    table.row({html_angle(one.phi_deg), html_number(1e6 * one.k.value, "{:.5f}"),
               html_number(1e6 * one.k.expanded(), "{:.5f}"), html_number(one.scaling_factor.value, "{:.4f}"),
               html_number(one.scaling_factor.expanded(), "{:.4f}"), html_number(100 * one.speed_u_share, "{:.3f}"),
               one.clipped        ? "above K<sub>T</sub>, held at 1"
               : one.extrapolated ? "extrapolated"
                                  : ""});
  return section("k(φ) in flight", table);
}

std::string rejected_section(const std::vector<RejectedPoint>& rejected) {
  HtmlTable table({"φ", "repetition", "step", "speed, RPM", "thrust, N", "residual, N", "robust weight"});
  for (const RejectedPoint& point : rejected)
    table.row({html_angle(point.phi_deg), fmt::format("{}", point.repetition), fmt::format("{}", point.step + 1),
               rpm_text(point.speed_rad_s), fmt::format("{:.4f}", point.thrust_n),
               html_number(point.residual_n, "{:+.4f}"), html_number(point.robust_weight, "{:.3f}")});
  return section("Points rejected by the robust fit", table);
}

// ---- runs --------------------------------------------------------------------------------------------------

Cells run_row(const RunProvenance& run, const StepSelection& selection) {
  std::size_t used = 0, left_out = 0;
  std::string flags;  // each once, in the order of their first step
  for (const results::StepMean& step : selection.used) used += is_run_of(run, step) ? 1 : 0;
  for (const FlaggedStep& flagged : selection.flagged) {
    if (!is_run_of(run, flagged.step)) continue;
    left_out += flagged.left_out ? 1 : 0;
    if (flags.find(flagged.reason) == std::string::npos) flags += (flags.empty() ? "" : "; ") + flagged.reason;
  }
  flags = html_escaped(flags);
  for (const std::string& event : run.events) flags += (flags.empty() ? "" : "<br/>") + html_escaped(event);
  Cells cells{html_escaped(run.file), run.outcome.empty() ? "–" : html_escaped(run.outcome), whole(used),
              whole(left_out)};
  if (const auto& account = run.account) {
    cells.insert(cells.end(), {whole(account->expected), whole(account->received),
                               whole(account->lost_network + account->lost_host)});
  } else {
    cells.insert(cells.end(), 3, "–");
  }
  cells.push_back(flags.empty() ? "none" : flags);
  return cells;
}

std::string entry(const char* term, const std::string& description) {
  return fmt::format("<dt>{}</dt><dd>{}</dd>\n", term, html_escaped(description));
}

std::string clock_words(const MotorClock& clock) {
  if (!clock.u_gain)
    return "unchecked: all speeds may be off together by a few tenths of a percent, and k by twice that; measure it "
           "with `kphi devices --bench FILE --clock-gain`";
  return fmt::format("gain {:.7g} ± {:.1e}, speeds are corrected; shared by all steps: {:.1e} of k", clock.gain,
                     *clock.u_gain, 2 * *clock.u_gain / clock.gain);
}

std::string hash_section(const std::vector<RunProvenance>& runs) {
  HtmlTable table({text("file"), {"SHA-256", HtmlTable::Column::hash}}, true);
  for (const RunProvenance& run : runs) table.row({html_escaped(run.file), html_escaped(run.sha256)});
  return section("Hashes of the runs", table);
}

std::string interval(double lower, double upper) {
  if (!std::isfinite(lower) && !std::isfinite(upper)) return "–";
  return html_number(lower, "{:.4g}") + " to " + html_number(upper, "{:.4g}");
}

/// Two decimals with a true minus, and no sign before zero.
std::string signed_percent(double percent) {
  const std::string digits = fmt::format("{:.2f}", std::abs(percent));
  if (digits == "0.00") return "0.00 %";
  return (percent < 0 ? "−" : "+") + digits + " %";
}

/// At the top of the page.
std::string verdict_box(const FlightReadiness& flight) {
  std::string html = fmt::format("<div class=\"verdict {}\"><h3>{}</h3>\n", name_of(flight.readiness()),
                                 flight.doubts.empty()                      ? "Fit to fly: no test of the model falls"
                                 : flight.readiness() == Readiness::not_yet ? "Do not fly yet"
                                                                            : "Fly with care");
  for (const Doubt& doubt : flight.doubts) html += "<p>" + typeset(doubt.text) + "</p>\n";
  return html + "</div>\n";
}

std::string remark_section(std::span<const std::string> remarks) {
  if (remarks.empty()) return {};
  std::string html = "<div class=\"remarks\"><h3>Before you fly this</h3>\n<ul>\n";
  for (const std::string& remark : remarks) html += "<li>" + typeset(remark) + "</li>\n";
  return html + "</ul></div>\n";
}

std::string coefficient_section(const Fitted& fitted) {
  const auto& [identification, analysis] = fitted;
  const std::string at =
      identification.at_speed_rad_s > 0 ? " at " + rpm_text(identification.at_speed_rad_s) + " RPM" : "";
  const std::string units = ", N/(rad/s)²<br/><span class=\"soft\">N/RPM²</span>";
  HtmlTable table({"φ", "k" + units, "k" + at + units, "thrust share<br/>" + at, "k(φ) − k", "residual<br/>rms, mN",
                   "R²", "steps"});
  for (std::size_t i = 0; i < identification.table.size(); ++i) {
    const OcclusionCoefficient& row = identification.table[i];
    const double miss = identification.curve().at(from_degrees(row.phi_deg)).value() - row.k;
    table.row({html_angle(row.phi_deg), both_units(row.k, analysis.coefficients[i].expanded()),
               row.at_speed ? both_units(row.at_speed->k, kNoError) : "–",
               fmt::format("{:.1f} %", 100 * share_of_thrust(identification, row)),
               signed_percent(100 * miss / identification.thrust_coefficient().value),
               row.fit ? fmt::format("{:.2f}", 1e3 * row.fit->rms_n) : "–",
               row.fit ? fmt::format("{:.5f}", row.fit->r_squared) : "–", row.fit ? whole(row.fit->n) : "–"});
  }
  return section("Coefficients", table,
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
           "is not given. 10 K or 30 hPa change the density by 3 %. Add `ambient:` to the bench file.</p>\n";
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

std::string power_section(const Identification& identification) {
  constexpr std::size_t kRows = 5;
  std::map<double, std::vector<StepPower>> by_angle;
  for (const StepPower& row : power_of(identification.selection.used)) by_angle[row.phi_deg].push_back(row);
  HtmlTable table({"φ", "step", "speed, RPM", "thrust, N", "power, W", "g/W", "N/W", text("measured by")});
  for (const auto& [phi, rows] : by_angle) {
    const std::size_t n = std::min(kRows, rows.size());
    for (std::size_t i = 1; i <= n; ++i) {
      const StepPower& row = rows[i * rows.size() / n - 1];
      table.row({html_angle(phi), fmt::format("{}", row.step + 1), rpm_text(row.speed_rad_s),
                 fmt::format("{:.4f}", row.thrust_n), fmt::format("{:.2f}", row.power_w),
                 fmt::format("{:.3f}", row.gram_per_watt()), fmt::format("{:.5f}", row.newton_per_watt()),
                 row.by_supply ? "supply" : "module"});
    }
  }
  return section("Power", table);
}

std::string step_section(const StepSelection& selection) {
  const auto left_out = std::ranges::count(selection.flagged, true, &FlaggedStep::left_out);
  const std::string html =
      html_heading("Steps left out") +
      fmt::format("<p>{} steps were fitted; {} left out for a quality flag, {} outside the speed range.</p>\n",
                  selection.used.size(), left_out, selection.outside_range) +
      html_note(
          "A step is left out for a quality flag or by hand, both with a stated cause, never for being far from "
          "the others: the scatter of the repetitions is part of their uncertainty (JCGM 100, 3.4.7 and 4.2) and "
          "of the budget.");
  HtmlTable table(
      {"φ", "repetition", "step", "commanded, RPM", "measured, RPM", "thrust, N", text("flag"), text("verdict")}, true);
  for (const FlaggedStep& flagged : selection.flagged) {
    const results::StepMean& step = flagged.step;
    table.row({html_angle(step.occlusion_deg), fmt::format("{}", step.repetition), fmt::format("{}", step.step + 1),
               rpm_text(step.commanded_speed_rad_s), rpm_text(step.speed_rad_s), fmt::format("{:.4f}", step.thrust_n),
               html_escaped(flagged.reason), flagged.left_out ? "left out" : "kept"});
  }
  return html + table.html();
}

std::string run_section(const Provenance& provenance, const StepSelection& selection) {
  HtmlTable table({text("file"), text("outcome"), "steps fitted", "left out", "samples expected", "received", "lost",
                   text("flags and events")},
                  true);
  const auto bad = [](bool is_bad) { return is_bad ? std::optional<std::size_t>(1) : std::nullopt; };
  for (const RunProvenance& run : provenance.runs)
    table.row(run_row(run, selection), bad(!run.outcome.empty() && run.outcome != "complete"));
  for (const RejectedRun& run : provenance.rejected) {
    table.row({html_escaped(run.file), "not accepted", "0", "–", "–", "–", "–",
               html_escaped(run.utc) + ": " + html_escaped(run.reason)},
              bad(true));
  }
  return section("Runs", table);
}

std::string provenance_section(const Identification& identification, const Provenance& provenance) {
  const auto known = [](const std::string& words) { return words.empty() ? "unknown" : words; };
  const CurveFit& curve = identification.curve_fit;
  const auto& air = identification.air;
  std::string points;
  for (const CurvePoint& point : curve.points) points += (points.empty() ? "" : ", ") + html_angle(point.phi_deg);
  std::string html = html_heading("Provenance") + "<dl>\n";
  html += entry("Campaign", known(provenance.campaign));
  html += entry("Fitted from", provenance.source);
  html += entry("Model", "T = k ω²: " + estimator_words(identification));
  html += entry("k(φ)", curve.model().words(curve) + ", points " + points);
  if (speeds_known(identification))
    html += entry("Speeds", rpm_text(identification.speed_min_rad_s) + " to " +
                                rpm_text(identification.speed_max_rad_s) + " RPM");
  html += entry("Overlap", std::string(compensation::name_of(identification.options.overlap)) +
                               ": measure φ in this way in flight; on the bench's sector plates all measures are the "
                               "same angle");
  html += entry("Air density", air ? fmt::format("{:.4f} ± {:.4f} kg/m³", air->value, air->u) : "unknown");
  const auto& supply = provenance.supply_v;
  html += entry("Supply", supply && std::isfinite(*supply) ? fmt::format("{:g} V", *supply) : "unknown");
  if (provenance.clock) html += entry("Motor's clock", clock_words(*provenance.clock));
  html += entry("Measured", known(provenance.measured_utc));
  html += entry("Fitted by", "kphi " + provenance.tool_version);
  return html + "</dl>\n" + hash_section(provenance.runs);
}

std::string family_section(std::span<const Fitted> family) {
  HtmlTable table({text("propeller"), "diameter, in", "blades", "K<sub>T</sub>, N/(rad/s)²",
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
  return section("The propellers side by side", table, "± is 95 % by the GUM; what each lacks stands in its chapter.");
}

std::string slopes_section(std::span<const SharedSlope> slopes) {
  HtmlTable table({"diameter, in", text("propellers"), "slope, N/(rad/s)² per degree", "95 %, ±", "equal slopes, p"});
  for (const SharedSlope& one : slopes)
    table.row({fmt::format("{:g}", one.diameter_in), html_escaped(fmt::format("{}", fmt::join(one.propellers, ", "))),
               with_power_of_ten(one.slope.value, std::hypot(one.slope.u, one.common_u)),
               fmt::format("{:.1e}", one.expanded()), fmt::format("{:.4f}", one.equal_slopes.p)});
  return section("One slope for each diameter", table,
                 "± comes from the scatter of runs and steps, the zero, and the errors that all share. The line of a "
                 "single propeller never takes a point as known better than 0.1 % of K<sub>T</sub>.");
}

// ---- the page ----------------------------------------------------------------------------------------------

std::string card(const std::string& title, const Budget& budget, const std::string& per) {
  const double value = budget.value, error = budget.expanded();
  return fmt::format(
      "<div class=\"card\"><h3>{0}</h3><div class=\"value\">{1} <span class=\"unit\">N/(rad/s)²{3}</span></div>"
      "<p>{2} N/RPM²{3}</p></div>\n",
      title, with_power_of_ten(value, error), with_power_of_ten(per_rpm2(value), per_rpm2(error)), per);
}

std::string headline(const Fitted& fitted) {
  const CurveFit& curve = fitted.identification.curve_fit;
  const Analysis& analysis = fitted.analysis;
  const Budget& K_T = analysis.coefficients.front();
  std::string cards = card("Thrust coefficient K<sub>T</sub> = k(0), measured without occlusion", K_T, "");
  for (std::size_t i = 0; i < analysis.parameters.size(); ++i)
    cards += card(fmt::format("k(φ), {}: {}", name_of(curve.form), analysis.parameters[i].quantity),
                  analysis.parameters[i], curve.parameters[i].per);
  return "<div class=\"cards\">\n" + cards + "</div>\n" + html_note(typeset(plus_minus_words(K_T)) + ".");
}

/// The result in one sentence.
std::string lead(const Identification& identification) {
  const OcclusionCoefficient& widest = identification.table.back();
  const bool at = identification.at_speed_rad_s > 0 && widest.at_speed;
  const CurveParameter* slope = identification.curve_fit.find("slope_per_deg");
  return fmt::format("<p class=\"lead\">{} occlusion of {} leaves {:.1f} % of the thrust{}.</p>\n",
                     at ? "At " + rpm_text(identification.at_speed_rad_s) + " RPM an" : "An",
                     html_angle(widest.phi_deg), 100 * share_of_thrust(identification, widest),
                     slope == nullptr ? ""
                                      : fmt::format("; each further degree costs {:.3f} % of K<sub>T</sub>",
                                                    -100 * slope->value / identification.thrust_coefficient().value));
}

/// Figures `begin` to `end`. Their numbers run through the page and keep the ids of their drawings apart.
std::string figure_blocks(const Figures& figures, std::size_t begin, std::size_t end, int& number) {
  std::string html;
  for (std::size_t i = begin; i < std::min(end, figures.drawn.size()); ++i) {
    std::ifstream file(figures.drawn[i].svg, std::ios::binary);
    const std::string svg((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
    ++number;
    html += fmt::format("<figure>\n{}\n<figcaption><b>Figure {}.</b> {}</figcaption>\n</figure>\n",
                        inline_svg(svg, fmt::format("figure{}-", number)), number, typeset(figures.drawn[i].caption));
  }
  return html;
}

std::string skipped_note(const Figures& figures) {
  if (figures.skipped.empty()) return {};
  return fmt::format("<p class=\"warning\">Figures skipped: {}.</p>\n", html_escaped(figures.skipped));
}

std::string propeller_line(const Identification& identification, const Provenance& provenance) {
  std::string text = identification.propeller;
  if (!provenance.propeller_name.empty() && provenance.propeller_name != text)
    text += " · " + provenance.propeller_name;
  if (identification.diameter_in > 0) text += fmt::format(" · {:g} inch", identification.diameter_in);
  if (identification.blades > 0) text += fmt::format(" · {} blades", identification.blades);
  return html_escaped(text);
}

constexpr const char* kPageEnd = "</body>\n</html>\n";

std::string page_head(const std::string& title, const std::string& heading, const std::string& sub) {
  return fmt::format(
      "<!DOCTYPE html>\n<html xmlns=\"http://www.w3.org/1999/xhtml\" lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n<title>{}</title>\n"
      "<style>{}</style>\n</head>\n<body>\n<header><h1>{}</h1>\n<p class=\"sub\">{}</p></header>\n",
      title, report_style(), heading, sub);
}

/// The first figure belongs to the headline, the others follow the table.
std::string body(const Fitted& fitted, const Chapter& chapter, int& number) {
  const auto& [identification, analysis] = fitted;
  const auto& [provenance, figures] = chapter;
  const std::string first = figure_blocks(figures, 0, 1, number);
  const std::string details = figure_blocks(figures, 1, figures.drawn.size(), number);
  return verdict_box(analysis.flight) + lead(identification) + headline(fitted) + first + skipped_note(figures) +
         remark_section(analysis.remarks) + coefficient_section(fitted) + standard_section(fitted) +
         (details.empty() ? "" : html_heading("How well the model holds") + details) + analysis_sections(analysis) +
         power_section(identification) + step_section(identification.selection) +
         run_section(provenance, identification.selection) + provenance_section(identification, provenance);
}

}  // namespace

std::string analysis_sections(const Analysis& analysis) {
  return rejected_section(analysis.rejected) + budget_section(analysis.coefficients, analysis.standard) +
         prediction_section(analysis.predictions) + speed_section(analysis.speed) + test_section(analysis) +
         torque_section(analysis.torque);
}

std::string claims_section(std::span<const Claim> claims) {
  HtmlTable table({text("statement"), "found", "95 %", "allowed", text("unit"), text("verdict")});
  for (const Claim& claim : claims)
    table.row({typeset(claim.statement), html_number(claim.value, "{:.4g}"), interval(claim.lower, claim.upper),
               interval(claim.allowed_lower, claim.allowed_upper), typeset(claim.unit), name_of(claim.verdict)},
              claim.verdict == Verdict::fails ? std::optional<std::size_t>(5) : std::nullopt);
  return section("The paper's statements", table);
}

std::string format_report(const Fitted& fitted, const Chapter& chapter) {
  int number = 0;
  return page_head("k(φ) of " + html_escaped(fitted.identification.propeller), "How an occlusion costs thrust: k(φ)",
                   propeller_line(fitted.identification, chapter.provenance)) +
         body(fitted, chapter, number) + kPageEnd;
}

std::string format_reports(std::span<const Fitted> family, std::span<const Chapter> chapters, const Figures& together) {
  std::string names, contents, bodies;
  int number = 0;
  const std::string figure = figure_blocks(together, 0, together.drawn.size(), number) + skipped_note(together);
  for (std::size_t i = 0; i < family.size(); ++i) {
    const Identification& one = family[i].identification;
    const std::string name = html_escaped(one.propeller);
    names += (names.empty() ? "" : ", ") + name;
    contents += fmt::format("<a href=\"#chapter{}\">{}</a>", i + 1, name);
    bodies += fmt::format("<h2 class=\"chapter\" id=\"chapter{}\">{}</h2>\n", i + 1,
                          propeller_line(one, chapters[i].provenance)) +
              body(family[i], chapters[i], number);
  }
  return page_head("k(φ) of " + names, "How an occlusion costs thrust: k(φ) of several propellers", names) + "<nav>" +
         contents + "</nav>\n" + family_section(family) + figure + slopes_section(shared_slopes(family)) +
         claims_section(test_claims(family)) + bodies + kPageEnd;
}

}  // namespace kphi::fit
