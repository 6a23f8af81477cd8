#include "fit/report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>

#include "compensation/units.hpp"
#include "fit/html.hpp"
#include "fit/power.hpp"

namespace kphi::fit {
namespace {

constexpr const char* kStyle = R"(
:root{--ink:#1c2430;--soft:#5c6675;--rule:#dfe3e8;--accent:#c2570c;--panel:#f7f8fa}
*{box-sizing:border-box}
body{font:16px/1.5 system-ui,-apple-system,"Segoe UI",Roboto,"Helvetica Neue",Arial,sans-serif;color:var(--ink);
 background:#fff;max-width:68rem;margin:2.5rem auto;padding:0 1.5rem}
h1{font-size:1.75rem;line-height:1.2;margin:0 0 .25rem}
h2{font-size:1.15rem;margin:2.5rem 0 .75rem;padding-bottom:.3rem;border-bottom:1px solid var(--rule)}
p.sub{color:var(--soft);margin:0 0 1.5rem}
p.note,figcaption{color:var(--soft);font-size:.9rem}
.cards{display:grid;grid-template-columns:repeat(auto-fit,minmax(17rem,1fr));gap:1rem}
.card{background:var(--panel);border:1px solid var(--rule);border-radius:8px;padding:1rem 1.2rem}
.card h3{margin:0;font-size:.85rem;font-weight:600;color:var(--soft)}
.card .value{font-size:1.3rem;font-weight:650;font-variant-numeric:tabular-nums;margin:.15rem 0;white-space:nowrap}
.card .value .unit{display:block;font-size:.85rem;font-weight:400;color:var(--soft)}
.card p{margin:0;font-size:.88rem;color:var(--soft);font-variant-numeric:tabular-nums}
.line{border-left:4px solid var(--accent)}
figure{margin:1.25rem 0}
figure svg{display:block;width:100%;height:auto;border:1px solid var(--rule);border-radius:8px}
figcaption{margin-top:.5rem}
.scroll{overflow-x:auto}
table{border-collapse:collapse;width:100%;font-size:.86rem;font-variant-numeric:tabular-nums}
th{text-align:right;font-weight:600;color:var(--soft);border-bottom:2px solid var(--rule);padding:.35rem .5rem;
 vertical-align:bottom}
td{text-align:right;border-bottom:1px solid var(--rule);padding:.35rem .5rem;white-space:nowrap}
th.text,td.text{text-align:left;white-space:normal}
td.hash{text-align:left;font:.66rem ui-monospace,"DejaVu Sans Mono",Menlo,monospace;white-space:normal;
 word-break:break-all;color:var(--soft)}
.warning{background:#fff6e5;border:1px solid #f0c36d;border-radius:8px;padding:.7rem 1rem}
dl{display:grid;grid-template-columns:max-content 1fr;gap:.3rem 1.2rem;margin:0;font-size:.92rem}
dt{color:var(--soft)}dd{margin:0}
@media print{body{margin:0;max-width:none;font-size:11pt}.card,figure,tr{break-inside:avoid}h2{break-after:avoid}
 .scroll{overflow:visible}}
)";

std::string rpm(double speed_rad_s) { return fmt::format("{:.0f}", to_rpm(RadPerSec(speed_rad_s))); }
double per_rpm2(double k) { return to_newtons_per_rpm2(ThrustCoefficient(k)); }
std::string angle(double phi_deg) { return fmt::format("{:g}°", phi_deg); }

std::string card(const std::string& title, double value, double error, const char* si, const char* rpm_unit,
                 const std::string& more) {
  return fmt::format(
      "<div class=\"card\"><h3>{}</h3><div class=\"value\">{} <span class=\"unit\">{}</span></div>"
      "<p>{} {}</p>{}</div>\n",
      title, with_error(value, error), si, with_error(per_rpm2(value), per_rpm2(error)), rpm_unit, more);
}

std::string headline(const Identification& identification) {
  const LineFit& line = identification.line;
  std::string crossings;
  if (line.clipping_deg() && !line.anchored)
    crossings +=
        fmt::format("<p>meets K<sub>T</sub> at {:.1f}°; below, compensation clips to 1</p>", *line.clipping_deg());
  if (line.zero_crossing_deg()) crossings += fmt::format("<p>reaches zero at {:.1f}°</p>", *line.zero_crossing_deg());
  const std::string mismatch = line.anchored
                                   ? "<p>anchored at K<sub>T</sub></p>"
                                   : fmt::format("<p>{:+.2f} % of K<sub>T</sub> above the measured K<sub>T</sub></p>",
                                                 100 * line.mismatch() / line.K_T);
  return "<div class=\"cards\">\n" +
         card("Thrust coefficient K<sub>T</sub> = k(0)", line.K_T, line.K_T_standard_error, "N/(rad/s)²", "N/RPM²",
              "<p>measured without occlusion</p>") +
         card("Line k(φ): intercept", line.intercept, std::sqrt(line.covariance[0][0]), "N/(rad/s)²", "N/RPM²",
              mismatch) +
         card("Line k(φ): slope", line.slope_per_deg, std::sqrt(line.covariance[1][1]), "N/(rad/s)² per degree",
              "N/RPM² per degree", crossings) +
         "</div>\n";
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
                        with_error(row.standard->k, row.standard->standard_error),
                        with_error(per_rpm2(row.standard->k), per_rpm2(row.standard->standard_error)));
  }
  return html + "</tbody></table></div>\n<p class=\"note\">± includes the standard uncertainty of the density.</p>\n";
}

std::string power_section(const Identification& identification) {
  const std::vector<StepPower> rows = power_of(identification.selection.used);
  if (rows.empty()) return {};
  std::string html =
      "<h2>Power</h2>\n<div class=\"scroll\"><table><thead><tr><th>φ</th><th>step</th><th>speed, RPM</th><th>thrust, "
      "N</th><th>power, W</th><th>g/W</th><th>N/W</th><th class=\"text\">measured by</th></tr></thead><tbody>\n";
  for (const StepPower& row : rows) {
    html += fmt::format(
        "<tr><td>{}</td><td>{}</td><td>{}</td><td>{:.4f}</td><td>{:.2f}</td><td>{:.3f}</td><td>{:.5f}</td><td "
        "class=\"text\">{}</td></tr>\n",
        angle(row.phi_deg), row.step + 1, rpm(row.speed_rad_s), row.thrust_n, row.power_w, row.gram_per_watt(),
        row.newton_per_watt(), row.by_supply ? "supply" : "module");
  }
  return html + "</tbody></table></div>\n";
}

std::string at_speed_cell(const OcclusionCoefficient& row) {
  return row.at_speed ? with_error(row.at_speed->k, row.at_speed->standard_error) : "–";
}

std::string share_cell(const Identification& identification, const OcclusionCoefficient& row) {
  const auto& nominal = identification.table.front().at_speed;
  if (!row.at_speed || !nominal) return fmt::format("{:.1f} %", 100 * row.k / identification.line.K_T);
  return fmt::format("{:.1f} %", 100 * row.at_speed->k / nominal->k);
}

std::string coefficient_table(const Identification& identification) {
  const LineFit& line = identification.line;
  const std::string at = identification.at_speed_rad_s > 0 ? " at " + rpm(identification.at_speed_rad_s) + " RPM" : "";
  std::string html = fmt::format(
      "<h2>Coefficients</h2>\n<div class=\"scroll\"><table><thead><tr><th>φ</th><th>k, N/(rad/s)²</th><th>k, "
      "N/RPM²</th>"
      "<th>k{}, N/(rad/s)²</th><th>thrust share{}</th><th>line − k</th><th>residual rms, "
      "N</th><th>R²</th><th>n</th></tr>"
      "</thead><tbody>\n",
      at, at);
  for (const OcclusionCoefficient& row : identification.table) {
    html += fmt::format(
        "<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{:+.2f} "
        "%</td><td>{}</td><td>{}</td><td>{}</td></tr>\n",
        angle(row.phi_deg), with_error(row.k, row.standard_error),
        with_error(per_rpm2(row.k), per_rpm2(row.standard_error)), at_speed_cell(row), share_cell(identification, row),
        100 * (line.at(row.phi_deg) - row.k) / line.K_T, row.fit ? fmt::format("{:.4f}", row.fit->rms_n) : "–",
        row.fit ? fmt::format("{:.5f}", row.fit->r_squared) : "–", row.fit ? fmt::format("{}", row.fit->n) : "–");
  }
  return html +
         "</tbody></table></div>\n<p class=\"note\">± is one standard error: of k from the residuals of the fit, of k "
         "at one speed from the repetitions. It holds no error that all steps share (calibration of the load cell, air "
         "density, mounting). Line − k is in percent of K<sub>T</sub>; the thrust share is k over k(0) at the same "
         "speed.</p>\n";
}

std::string figure_section(const Figures& figures) {
  std::string html = "<h2>Figures</h2>\n";
  for (std::size_t i = 0; i < figures.drawn.size(); ++i) {
    std::ifstream file(figures.drawn[i].svg, std::ios::binary);
    const std::string svg((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
    html += fmt::format("<figure>\n{}\n<figcaption>{}</figcaption>\n</figure>\n",
                        inline_svg(svg, fmt::format("figure{}-", i + 1)), html_escaped(figures.drawn[i].caption));
  }
  if (!figures.skipped.empty())
    html += fmt::format("<p class=\"warning\">Figures skipped: {}.</p>\n", html_escaped(figures.skipped));
  return html;
}

std::string doubt_section(const StepSelection& selection) {
  const auto left_out = std::count_if(selection.doubtful.begin(), selection.doubtful.end(),
                                      [](const DoubtfulStep& doubtful) { return doubtful.left_out; });
  std::string html = fmt::format(
      "<h2>Steps left out</h2>\n<p>{} steps were fitted; {} left out for a doubt, {} lie outside the speed "
      "range.</p>\n",
      selection.used.size(), left_out, selection.outside_range);
  if (selection.doubtful.empty()) return html;
  html +=
      "<div class=\"scroll\"><table><thead><tr><th>φ</th><th>repetition</th><th>step</th><th>commanded, RPM</th>"
      "<th>measured, RPM</th><th>thrust, N</th><th class=\"text\">doubt</th><th "
      "class=\"text\">verdict</th></tr></thead>"
      "<tbody>\n";
  for (const DoubtfulStep& doubtful : selection.doubtful) {
    const results::StepMean& step = doubtful.step;
    html += fmt::format(
        "<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{:.4f}</td><td class=\"text\">{}</td>"
        "<td class=\"text\">{}</td></tr>\n",
        angle(step.occlusion_deg), step.repetition, step.step + 1, rpm(step.commanded_speed_rad_s),
        rpm(step.speed_rad_s), step.thrust_n, html_escaped(doubtful.reason), doubtful.left_out ? "left out" : "kept");
  }
  return html + "</tbody></table></div>\n";
}

std::string account_cells(const std::optional<results::SampleAccount>& account) {
  if (!account) return "<td>–</td><td>–</td><td>–</td>";
  return fmt::format("<td>{}</td><td>{}</td><td>{}</td>", account->expected, account->received,
                     account->lost_network + account->lost_host);
}

std::string run_section(const std::vector<RunProvenance>& runs) {
  if (runs.empty()) return {};
  std::string html =
      "<h2>Runs</h2>\n<div class=\"scroll\"><table><thead><tr><th class=\"text\">file</th><th "
      "class=\"text\">outcome</th>"
      "<th>samples expected</th><th>received</th><th>lost</th><th class=\"text\">SHA-256</th></tr></thead><tbody>\n";
  for (const RunProvenance& run : runs) {
    html += fmt::format("<tr><td class=\"text\">{}</td><td class=\"text\">{}</td>{}<td class=\"hash\">{}</td></tr>\n",
                        html_escaped(run.file), run.outcome.empty() ? "–" : html_escaped(run.outcome),
                        account_cells(run.account), html_escaped(run.sha256));
  }
  return html + "</tbody></table></div>\n";
}

std::string entry(const char* term, const std::string& description) {
  return fmt::format("<dt>{}</dt><dd>{}</dd>\n", term, html_escaped(description));
}

std::string optional_number(std::optional<double> value, const char* unit) {
  return value && std::isfinite(*value) ? fmt::format("{:g} {}", *value, unit) : "unknown";
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
  html += entry("Overlap", "rim arc");
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

}  // namespace

std::string with_error(double value, double standard_error) {
  if (!(standard_error > 0) || !std::isfinite(standard_error) || !(std::abs(value) > 0))
    return fmt::format("{:.5e}", value);
  const double digits = std::floor(std::log10(std::abs(value))) - std::floor(std::log10(standard_error)) + 1;
  return fmt::format("{:.{}e} ± {:.1e}", value, static_cast<int>(std::clamp(digits, 1.0, 12.0)), standard_error);
}

std::string format_report(const Identification& identification, const Provenance& provenance, const Figures& figures) {
  return fmt::format(
             "<!DOCTYPE html>\n<html xmlns=\"http://www.w3.org/1999/xhtml\" lang=\"en\">\n<head>\n<meta "
             "charset=\"utf-8\"/>\n"
             "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n<title>k(φ) of {}</title>\n"
             "<style>{}</style>\n</head>\n<body>\n<h1>How an occlusion costs thrust: k(φ)</h1>\n<p "
             "class=\"sub\">{}</p>\n",
             html_escaped(identification.propeller), kStyle, propeller_line(identification, provenance)) +
         headline(identification) + figure_section(figures) + coefficient_table(identification) +
         standard_section(identification) + power_section(identification) + doubt_section(identification.selection) +
         run_section(provenance.runs) + provenance_section(identification, provenance) + "</body>\n</html>\n";
}

}  // namespace kphi::fit
