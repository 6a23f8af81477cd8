#include "fit/report/report.hpp"

#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <iterator>

#include "compensation/units.hpp"
#include "fit/report/html.hpp"
#include "fit/report/sections.hpp"

namespace kphi::fit {
namespace {

std::string card(const std::string& title, double value, double error, const std::string& per,
                 const std::string& more) {
  return fmt::format(
      "<div class=\"card\"><h3>{0}</h3><div class=\"value\">{1} <span class=\"unit\">N/(rad/s)²{3}</span></div>"
      "<p>{2} N/RPM²{3}</p>{4}</div>\n",
      title, with_power_of_ten(value, error), with_power_of_ten(per_rpm2(value), per_rpm2(error)), per, more);
}

std::string headline(const LineFit& line) {
  std::string crossings;
  if (line.clipping_deg() && !line.anchored)
    crossings += fmt::format(
        "<p>meets K<sub>T</sub> at {:.1f}°; below that angle compensation holds k<sub>i</sub> at "
        "1</p>",
        *line.clipping_deg());
  if (line.zero_crossing_deg()) crossings += fmt::format("<p>reaches zero at {:.1f}°</p>", *line.zero_crossing_deg());
  const std::string mismatch =
      line.anchored ? "<p>anchored at K<sub>T</sub></p>"
                    : fmt::format("<p>{:.2f} % {} the measured K<sub>T</sub></p>",
                                  100 * std::abs(line.mismatch()) / line.K_T, line.mismatch() < 0 ? "below" : "above");
  return "<div class=\"cards\">\n" +
         card("Thrust coefficient K<sub>T</sub> = k(0)", line.K_T, line.K_T_standard_error, "",
              "<p>measured without occlusion</p>") +
         card("Line k(φ): intercept", line.intercept, std::sqrt(line.covariance[0][0]), "", mismatch) +
         card("Line k(φ): slope", line.slope_per_deg, std::sqrt(line.covariance[1][1]), " per degree", crossings) +
         "</div>\n";
}

/// The result in one sentence.
std::string lead(const Identification& identification) {
  const OcclusionCoefficient& widest = identification.table.back();
  const bool at = identification.at_speed_rad_s > 0 && widest.at_speed;
  return fmt::format(
      "<p class=\"lead\">{} occlusion of {} leaves {:.1f} % of the thrust; each further degree costs {:.3f} % of "
      "K<sub>T</sub>.</p>\n",
      at ? "At " + rpm_text(identification.at_speed_rad_s) + " RPM an" : "An", html_angle(widest.phi_deg),
      100 * share_of_thrust(identification, widest),
      -100 * identification.line.slope_per_deg / identification.line.K_T);
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
std::string body(const Identification& identification, const Provenance& provenance, const Figures& figures,
                 const Analysis* analysis, int& number) {
  std::string html = lead(identification) + headline(identification.line) + figure_blocks(figures, 0, 1, number) +
                     skipped_note(figures);
  if (analysis != nullptr) html += remark_section(analysis->remarks);
  html += coefficient_section(identification) + standard_section(identification);
  const std::string details = figure_blocks(figures, 1, figures.drawn.size(), number);
  if (!details.empty()) html += html_heading("How well the model holds") + details;
  if (analysis != nullptr) html += analysis_sections(*analysis);
  return html + power_section(identification) + step_section(identification.selection) +
         run_section(provenance, identification.selection) + provenance_section(identification, provenance);
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

std::string format_report(const Identification& identification, const Provenance& provenance, const Figures& figures,
                          const Analysis* analysis) {
  int number = 0;
  return page_head("k(φ) of " + html_escaped(identification.propeller), "How an occlusion costs thrust: k(φ)",
                   propeller_line(identification, provenance)) +
         body(identification, provenance, figures, analysis, number) + kPageEnd;
}

std::string format_reports(const std::vector<Chapter>& chapters, const Figures& family) {
  std::string names, contents, bodies;
  std::vector<const Identification*> identifications;
  int number = 0;
  const std::string together = figure_blocks(family, 0, family.drawn.size(), number) + skipped_note(family);
  for (const Chapter& chapter : chapters) {
    identifications.push_back(&chapter.identification);
    const std::string name = html_escaped(chapter.identification.propeller);
    names += (names.empty() ? "" : ", ") + name;
    contents += fmt::format("<a href=\"#chapter{}\">{}</a>", identifications.size(), name);
    bodies += fmt::format("<h2 class=\"chapter\" id=\"chapter{}\">{}</h2>\n", identifications.size(),
                          propeller_line(chapter.identification, chapter.provenance)) +
              body(chapter.identification, chapter.provenance, chapter.figures,
                   chapter.analysis ? &*chapter.analysis : nullptr, number);
  }
  return page_head("k(φ) of " + names, "How an occlusion costs thrust: k(φ) of several propellers", names) + "<nav>" +
         contents + "</nav>\n" + family_section(identifications) + together + statements_of(chapters) + bodies +
         kPageEnd;
}

}  // namespace kphi::fit
