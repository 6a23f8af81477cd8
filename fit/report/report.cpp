#include "fit/report/report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>

#include "compensation/units.hpp"
#include "fit/model/power.hpp"
#include "fit/propellers/claims.hpp"
#include "fit/report/analysis_section.hpp"
#include "fit/report/html.hpp"
#include "results/campaign_folder.hpp"

namespace kphi::fit {
namespace {

std::string rpm(double speed_rad_s) { return fmt::format("{:.0f}", to_rpm(RadPerSec(speed_rad_s))); }
double per_rpm2(double k) { return to_newtons_per_rpm2(ThrustCoefficient(k)); }
std::string angle(double phi_deg) { return fmt::format("{:g}°", phi_deg); }

/// Two decimals with a true minus, and no minus before nothing.
std::string signed_percent(double percent) {
  const std::string digits = fmt::format("{:.2f}", std::abs(percent));
  if (digits == "0.00") return "0.00 %";
  return (percent < 0 ? "−" : "+") + digits + " %";
}

std::string card(const std::string& title, double value, double error, const char* si, const char* rpm_unit,
                 const std::string& more) {
  return fmt::format(
      "<div class=\"card\"><h3>{}</h3><div class=\"value\">{} <span class=\"unit\">{}</span></div>"
      "<p>{} {}</p>{}</div>\n",
      title, with_power_of_ten(value, error), si, with_power_of_ten(per_rpm2(value), per_rpm2(error)), rpm_unit, more);
}

std::string headline(const Identification& identification) {
  const LineFit& line = identification.line;
  std::string crossings;
  if (line.clipping_deg() && !line.anchored)
    crossings +=
        fmt::format("<p>meets K<sub>T</sub> at {:.1f}°; below, compensation clips to 1</p>", *line.clipping_deg());
  if (line.zero_crossing_deg()) crossings += fmt::format("<p>reaches zero at {:.1f}°</p>", *line.zero_crossing_deg());
  const std::string mismatch =
      line.anchored ? "<p>anchored at K<sub>T</sub></p>"
                    : fmt::format("<p>{:.2f} % {} the measured K<sub>T</sub></p>",
                                  100 * std::abs(line.mismatch()) / line.K_T, line.mismatch() < 0 ? "below" : "above");
  return "<div class=\"cards\">\n" +
         card("Thrust coefficient K<sub>T</sub> = k(0)", line.K_T, line.K_T_standard_error, "N/(rad/s)²", "N/RPM²",
              "<p>measured without occlusion</p>") +
         card("Line k(φ): intercept", line.intercept, std::sqrt(line.covariance[0][0]), "N/(rad/s)²", "N/RPM²",
              mismatch) +
         card("Line k(φ): slope", line.slope_per_deg, std::sqrt(line.covariance[1][1]), "N/(rad/s)² per degree",
              "N/RPM² per degree", crossings) +
         "</div>\n";
}

double share_of(const Identification& identification, const OcclusionCoefficient& row) {
  const auto& nominal = identification.table.front().at_speed;
  return row.at_speed && nominal ? row.at_speed->k / nominal->k : row.k / identification.line.K_T;
}

std::string standard_section(const Identification& identification) {
  const std::string title = "<h2>In standard air, 1.225 kg/m³</h2>\n";
  if (!identification.air) {
    return title +
           "<p class=\"warning\">Air density unknown: k holds for the air of that day only, and no k at standard "
           "density "
           "is given. Days differ by 3 % for 10 K or 30 hPa. Next time write ambient: into the bench file.</p>\n";
  }
  std::string html =
      title +
      fmt::format(
          "<p>Measured in air of {:.4f} ± {:.4f} kg/m³.</p>\n<div class=\"scroll\"><table><thead><tr><th>φ</th><th>k · "
          "1.225/ρ, N/(rad/s)²</th><th>N/RPM²</th></tr></thead><tbody>\n",
          identification.air->kg_m3, identification.air->u_kg_m3);
  for (const OcclusionCoefficient& row : identification.table) {
    if (!row.standard) continue;
    html += fmt::format("<tr><td>{}</td><td>{}</td><td>{}</td></tr>\n", angle(row.phi_deg),
                        with_power_of_ten(row.standard->k, row.standard->standard_error),
                        with_power_of_ten(per_rpm2(row.standard->k), per_rpm2(row.standard->standard_error)));
  }
  return html + "</tbody></table></div>\n<p class=\"note\">± includes the standard uncertainty of the density.</p>\n";
}

std::string power_row(const StepPower& row) {
  return fmt::format(
      "<tr><td>{}</td><td>{}</td><td>{}</td><td>{:.4f}</td><td>{:.2f}</td><td>{:.3f}</td><td>{:.5f}</td><td "
      "class=\"text\">{}</td></tr>\n",
      angle(row.phi_deg), row.step + 1, rpm(row.speed_rad_s), row.thrust_n, row.power_w, row.gram_per_watt(),
      row.newton_per_watt(), row.by_supply ? "supply" : "module");
}

/// A few steps of each φ, the fastest among them: the figure has all.
std::string power_section(const Identification& identification) {
  constexpr std::size_t kRows = 5;
  std::map<double, std::vector<StepPower>> by_angle;
  for (const StepPower& row : power_of(identification.selection.used)) by_angle[row.phi_deg].push_back(row);
  if (by_angle.empty()) return {};
  std::string html =
      "<h2>Power</h2>\n<div class=\"scroll\"><table><thead><tr><th>φ</th><th>step</th><th>speed, RPM</th><th>thrust, "
      "N</th><th>power, W</th><th>g/W</th><th>N/W</th><th class=\"text\">measured by</th></tr></thead><tbody>\n";
  for (const auto& [phi, rows] : by_angle) {
    const std::size_t n = std::min(kRows, rows.size());
    for (std::size_t i = 1; i <= n; ++i) html += power_row(rows[i * rows.size() / n - 1]);
  }
  return html + "</tbody></table></div>\n";
}

/// The result in one sentence.
std::string lead(const Identification& identification) {
  const OcclusionCoefficient& widest = identification.table.back();
  const bool at = identification.at_speed_rad_s > 0 && widest.at_speed;
  std::string text = fmt::format(
      "{}an occlusion of {} leaves {:.1f} % of the thrust; each degree more costs {:.3f} % of K<sub>T</sub>.",
      at ? "At " + rpm(identification.at_speed_rad_s) + " RPM " : "", angle(widest.phi_deg),
      100 * share_of(identification, widest), -100 * identification.line.slope_per_deg / identification.line.K_T);
  if (!at) text.front() = 'A';
  return "<p class=\"lead\">" + text + "</p>\n";
}

/// N/(rad/s)², and below it N/RPM².
std::string both_units(double k, double error) {
  return with_power_of_ten(k, error) + "<br/><span class=\"soft\">" + with_power_of_ten(per_rpm2(k), per_rpm2(error)) +
         "</span>";
}

std::string coefficient_row(const OcclusionCoefficient& row, const Identification& identification) {
  const LineFit& line = identification.line;
  return fmt::format(
      "<tr><td>{}</td><td>{}</td><td>{}</td><td>{:.1f} %</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>\n",
      angle(row.phi_deg), both_units(row.k, row.standard_error),
      row.at_speed ? both_units(row.at_speed->k, row.at_speed->standard_error) : "–",
      100 * share_of(identification, row),
      signed_percent(100 * (identification.curve().at(from_degrees(row.phi_deg)).value() - row.k) / line.K_T),
      row.fit ? fmt::format("{:.2f}", 1e3 * row.fit->rms_n) : "–",
      row.fit ? fmt::format("{:.5f}", row.fit->r_squared) : "–", row.fit ? fmt::format("{}", row.fit->n) : "–");
}

std::string coefficient_table(const Identification& identification) {
  const std::string at = identification.at_speed_rad_s > 0 ? " at " + rpm(identification.at_speed_rad_s) + " RPM" : "";
  std::string html = fmt::format(
      "<h2>Coefficients</h2>\n<div class=\"scroll\"><table><thead><tr><th>φ</th><th>k, N/(rad/s)²<br/><span "
      "class=\"soft\">N/RPM²</span></th><th>k{}, N/(rad/s)²<br/><span class=\"soft\">N/RPM²</span></th><th>thrust "
      "share<br/>{}</th><th>line − k</th><th>residual<br/>rms, mN</th><th>R²</th><th>steps</th></tr></thead><tbody>\n",
      at, at);
  for (const OcclusionCoefficient& row : identification.table) html += coefficient_row(row, identification);
  return html +
         "</tbody></table></div>\n<p class=\"note\">± is one standard error: of k from noise, zero and scatter between "
         "the runs, of k at one speed from the repetitions. It holds no error that all steps share (calibration of the "
         "load cell, air density, mounting); the budget below does. Line − k is in percent of K<sub>T</sub>; the "
         "thrust "
         "share is k over k(0) at the same speed.</p>\n";
}

/// Numbers run through the page, and keep apart the ids of drawings.
std::string figure_block(const DrawnFigure& figure, int number) {
  std::ifstream file(figure.svg, std::ios::binary);
  const std::string svg((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  return fmt::format("<figure>\n{}\n<figcaption><b>Figure {}.</b> {}</figcaption>\n</figure>\n",
                     inline_svg(svg, fmt::format("figure{}-", number)), number, typeset(figure.caption));
}

std::string skipped_note(const Figures& figures) {
  if (figures.skipped.empty()) return {};
  return fmt::format("<p class=\"warning\">Figures skipped: {}.</p>\n", html_escaped(figures.skipped));
}

std::string figure_blocks(const Figures& figures, std::size_t begin, std::size_t end, int& number) {
  std::string html;
  for (std::size_t i = begin; i < std::min(end, figures.drawn.size()); ++i)
    html += figure_block(figures.drawn[i], ++number);
  return html;
}

std::string flagged_section(const StepSelection& selection) {
  const auto left_out = std::count_if(selection.flagged.begin(), selection.flagged.end(),
                                      [](const FlaggedStep& flagged) { return flagged.left_out; });
  std::string html = fmt::format(
      "<h2>Steps left out</h2>\n<p>{} steps were fitted; {} left out for a quality flag, {} lie outside the speed "
      "range.</p>\n<p class=\"note\">A step is left out for a quality flag or by hand, both of which name a cause, "
      "never for "
      "being "
      "far from the others: what repetitions scatter is their uncertainty (JCGM 100, 3.4.7 and 4.2), and is in the "
      "budget.</p>\n",
      selection.used.size(), left_out, selection.outside_range);
  if (selection.flagged.empty()) return html;
  html +=
      "<div class=\"scroll long\"><table><thead><tr><th>φ</th><th>repetition</th><th>step</th><th>commanded, RPM</th>"
      "<th>measured, RPM</th><th>thrust, N</th><th class=\"text\">flag</th><th "
      "class=\"text\">verdict</th></tr></thead>"
      "<tbody>\n";
  for (const FlaggedStep& flagged : selection.flagged) {
    const results::StepMean& step = flagged.step;
    html += fmt::format(
        "<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{:.4f}</td><td class=\"text\">{}</td>"
        "<td class=\"text\">{}</td></tr>\n",
        angle(step.occlusion_deg), step.repetition, step.step + 1, rpm(step.commanded_speed_rad_s),
        rpm(step.speed_rad_s), step.thrust_n, html_escaped(flagged.reason), flagged.left_out ? "left out" : "kept");
  }
  return html + "</tbody></table></div>\n";
}

std::string account_cells(const std::optional<results::SampleAccount>& account) {
  if (!account) return "<td>–</td><td>–</td><td>–</td>";
  return fmt::format("<td>{}</td><td>{}</td><td>{}</td>", account->expected, account->received,
                     account->lost_network + account->lost_host);
}

struct RunSteps {
  std::size_t used = 0, left_out = 0;
  std::string flags;  ///< each once, in the order of their first step
};

bool is_of(const RunProvenance& run, const results::StepMean& step) {
  return std::filesystem::path(run.file).filename() ==
         results::run_file_name(step.propeller, step.occlusion_deg, step.repetition);
}

RunSteps steps_of(const RunProvenance& run, const StepSelection& selection) {
  RunSteps steps;
  for (const results::StepMean& step : selection.used) steps.used += is_of(run, step) ? 1 : 0;
  for (const FlaggedStep& flagged : selection.flagged) {
    if (!is_of(run, flagged.step)) continue;
    steps.left_out += flagged.left_out ? 1 : 0;
    if (steps.flags.find(flagged.reason) == std::string::npos)
      steps.flags += (steps.flags.empty() ? "" : "; ") + flagged.reason;
  }
  return steps;
}

std::string run_row(const RunProvenance& run, const StepSelection& selection) {
  const RunSteps steps = steps_of(run, selection);
  const bool bad = !run.outcome.empty() && run.outcome != "complete";
  std::string flags = html_escaped(steps.flags);
  for (const std::string& event : run.events) flags += (flags.empty() ? "" : "<br/>") + html_escaped(event);
  return fmt::format(
      "<tr><td class=\"text\">{}</td><td class=\"text{}\">{}</td><td>{}</td><td>{}</td>{}<td "
      "class=\"text\">{}</td></tr>\n",
      html_escaped(run.file), bad ? " bad" : "", run.outcome.empty() ? "–" : html_escaped(run.outcome), steps.used,
      steps.left_out, account_cells(run.account), flags.empty() ? "none" : flags);
}

std::string run_section(const Provenance& provenance, const StepSelection& selection) {
  if (provenance.runs.empty() && provenance.rejected.empty()) return {};
  std::string html =
      "<h2>Runs</h2>\n<div class=\"scroll long\"><table><thead><tr><th class=\"text\">file</th><th "
      "class=\"text\">outcome</th><th>steps fitted</th><th>left out</th><th>samples expected</th><th>received</th>"
      "<th>lost</th><th class=\"text\">flags and events</th></tr></thead><tbody>\n";
  for (const RunProvenance& run : provenance.runs) html += run_row(run, selection);
  for (const RejectedRun& run : provenance.rejected) {
    html += fmt::format(
        "<tr><td class=\"text\">{}</td><td class=\"text bad\">not accepted</td><td>0</td><td>–</td><td>–</td><td>–</td>"
        "<td>–</td><td class=\"text\">{}: {}</td></tr>\n",
        html_escaped(run.file), html_escaped(run.utc), html_escaped(run.reason));
  }
  return html + "</tbody></table></div>\n";
}

std::string hash_section(const std::vector<RunProvenance>& runs) {
  if (runs.empty()) return {};
  std::string html =
      "<h2>Hashes of the runs</h2>\n<div class=\"scroll long\"><table><thead><tr><th class=\"text\">file</th><th "
      "class=\"text\">SHA-256</th></tr></thead><tbody>\n";
  for (const RunProvenance& run : runs)
    html += fmt::format("<tr><td class=\"text\">{}</td><td class=\"hash\">{}</td></tr>\n", html_escaped(run.file),
                        html_escaped(run.sha256));
  return html + "</tbody></table></div>\n";
}

std::string entry(const char* term, const std::string& description) {
  return fmt::format("<dt>{}</dt><dd>{}</dd>\n", term, html_escaped(description));
}

std::string optional_number(std::optional<double> value, const char* unit) {
  return value && std::isfinite(*value) ? fmt::format("{:g} {}", *value, unit) : "unknown";
}

std::string overlap_words(compensation::OverlapMeasure measure) {
  const std::string name(compensation::name_of(measure));
  return name + ": φ must be measured so in flight; on the bench's sector plates all measures are the same angle";
}

std::string clock_words(const MotorClock& clock) {
  if (!clock.u_gain)
    return "unchecked: all speeds may be off by some tenths of a percent together, and k by twice that; kphi devices "
           "--bench FILE --clock-gain measures it";
  return fmt::format("gain {:.7g} ± {:.1e}, speeds are corrected; shared by all steps: {:.1e} of k", clock.gain,
                     *clock.u_gain, 2 * *clock.u_gain / clock.gain);
}

std::string provenance_section(const Identification& identification, const Provenance& provenance) {
  std::string points;
  for (const LinePoint& point : identification.line.points)
    points += (points.empty() ? "" : ", ") + angle(point.phi_deg);
  std::string html = "<h2>Provenance</h2>\n<dl>\n";
  html += entry("Campaign", provenance.campaign.empty() ? "unknown" : provenance.campaign);
  html += entry("Fitted from", provenance.source);
  html += entry("Model", "T = k ω²: " + estimator_words(identification));
  html += entry("Line", (identification.line.anchored ? "anchored at K_T, points " : "free, points ") + points);
  if (identification.speed_max_rad_s > identification.speed_min_rad_s)
    html +=
        entry("Speeds", rpm(identification.speed_min_rad_s) + " to " + rpm(identification.speed_max_rad_s) + " RPM");
  html += entry("Overlap", overlap_words(identification.overlap));
  const auto& air = identification.air;
  html += entry("Air density", air ? fmt::format("{:.4f} ± {:.4f} kg/m³", air->kg_m3, air->u_kg_m3) : "unknown");
  html += entry("Supply", optional_number(provenance.supply_v, "V"));
  if (provenance.clock) html += entry("Motor's clock", clock_words(*provenance.clock));
  html += entry("Measured", provenance.measured_utc.empty() ? "unknown" : provenance.measured_utc);
  html += entry("Fitted by", "kphi " + provenance.tool_version);
  return html + "</dl>\n";
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

/// The first figure belongs to the headline, the others behind the table.
std::string body(const Identification& identification, const Provenance& provenance, const Figures& figures,
                 const Analysis* analysis, int& number) {
  std::string html =
      lead(identification) + headline(identification) + figure_blocks(figures, 0, 1, number) + skipped_note(figures);
  if (analysis != nullptr) html += remark_section(analysis->remarks);
  html += coefficient_table(identification) + standard_section(identification);
  const std::string details = figure_blocks(figures, 1, figures.drawn.size(), number);
  if (!details.empty()) html += "<h2>How well the model holds</h2>\n" + details;
  if (analysis != nullptr) html += analysis_sections(*analysis);
  return html + power_section(identification) + flagged_section(identification.selection) +
         run_section(provenance, identification.selection) + provenance_section(identification, provenance) +
         hash_section(provenance.runs);
}

std::string family_table(const std::vector<Chapter>& chapters) {
  std::string html =
      "<h2>Together</h2>\n<div class=\"scroll\"><table><thead><tr><th class=\"text\">propeller</th><th>diameter, "
      "in</th>"
      "<th>blades</th><th>K<sub>T</sub>, N/(rad/s)²</th><th>K<sub>T</sub>/D⁴, N/((rad/s)² m⁴)</th><th>slope, "
      "N/(rad/s)² "
      "per degree</th><th>slope, % of K<sub>T</sub> per degree</th></tr></thead><tbody>\n";
  for (const Chapter& chapter : chapters) {
    const Identification& one = chapter.identification;
    const double diameter_m = 0.0254 * one.diameter_in;
    html += fmt::format(
        "<tr><td class=\"text\">{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>\n",
        html_escaped(one.propeller), one.diameter_in > 0 ? fmt::format("{:g}", one.diameter_in) : "–",
        one.blades > 0 ? fmt::format("{}", one.blades) : "–",
        with_power_of_ten(one.line.K_T, one.line.K_T_standard_error),
        diameter_m > 0 ? fmt::format("{:.5f}", one.line.K_T / std::pow(diameter_m, 4)) : "–",
        with_power_of_ten(one.line.slope_per_deg, std::sqrt(one.line.covariance[1][1])),
        fmt::format("{}{:.4f}", one.line.slope_per_deg < 0 ? "−" : "+",
                    std::abs(100 * one.line.slope_per_deg / one.line.K_T)));
  }
  return html + "</tbody></table></div>\n";
}

/// The statements that need several propellers.
std::string statements_of(const std::vector<Chapter>& chapters) {
  std::vector<FamilyMember> family;
  for (const Chapter& chapter : chapters)
    if (chapter.analysis) family.push_back({chapter.identification, *chapter.analysis});
  if (family.size() < chapters.size()) return {};
  return slopes_section(shared_slopes(family)) + claims_section(test_claims(family));
}

}  // namespace

std::string with_error(double value, double standard_error) {
  if (!(standard_error > 0) || !std::isfinite(standard_error) || !(std::abs(value) > 0))
    return fmt::format("{:.5e}", value);
  const double digits = std::floor(std::log10(std::abs(value))) - std::floor(std::log10(standard_error)) + 1;
  return fmt::format("{:.{}e} ± {:.1e}", value, static_cast<int>(std::clamp(digits, 1.0, 12.0)), standard_error);
}

std::string format_report(const Identification& identification, const Provenance& provenance, const Figures& figures,
                          const Analysis* analysis) {
  int number = 0;
  return page_head("k(φ) of " + html_escaped(identification.propeller), "How an occlusion costs thrust: k(φ)",
                   propeller_line(identification, provenance)) +
         body(identification, provenance, figures, analysis, number) + kPageEnd;
}

std::string format_reports(const std::vector<Chapter>& chapters, const Figures& family) {
  std::string names, contents, bodies;
  int number = 0;
  const std::string together = figure_blocks(family, 0, family.drawn.size(), number) + skipped_note(family);
  for (std::size_t i = 0; i < chapters.size(); ++i) {
    const Chapter& chapter = chapters[i];
    const std::string name = html_escaped(chapter.identification.propeller);
    names += (names.empty() ? "" : ", ") + name;
    contents += fmt::format("<a href=\"#chapter{}\">{}</a>", i + 1, name);
    bodies += fmt::format("<h2 class=\"chapter\" id=\"chapter{}\">{}</h2>\n", i + 1,
                          propeller_line(chapter.identification, chapter.provenance)) +
              body(chapter.identification, chapter.provenance, chapter.figures,
                   chapter.analysis ? &*chapter.analysis : nullptr, number);
  }
  return page_head("k(φ) of " + names, "How an occlusion costs thrust: k(φ) of several propellers", names) + "<nav>" +
         contents + "</nav>\n" + family_table(chapters) + together + statements_of(chapters) + bodies + kPageEnd;
}

}  // namespace kphi::fit
