#include "fit/report/report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <fstream>
#include <iterator>

#include "compensation/units.hpp"
#include "fit/report/analysis_sections.hpp"
#include "fit/report/campaign_sections.hpp"
#include "fit/report/family_sections.hpp"
#include "fit/report/fit_summary.hpp"
#include "fit/report/history_section.hpp"
#include "fit/report/html.hpp"

namespace kphi::fit {
namespace {

constexpr const char* kPageEnd = "</body>\n</html>\n";

/// At the top of the page.
std::string verdict_box(const FlightReadiness& flight) {
  std::string html =
      fmt::format("<div class=\"verdict {}\"><h3>{}</h3>\n", name_of(flight.readiness()),
                  !flight.has_curve ? "K<sub>T</sub> alone: no occlusion was measured, so there is no k(φ) to fly with"
                  : flight.readiness() == Readiness::fit_to_fly ? "Fit to fly"
                  : flight.readiness() == Readiness::not_yet    ? "Do not fly yet"
                                                                : "Fly with care");
  std::string number = number_words(flight);
  number.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(number.front())));
  html += "<p><b>" + typeset(number) + ".</b></p>\n";
  for (const Doubt& doubt : flight.doubts) html += "<p>" + typeset(doubt.text) + "</p>\n";
  return html + "</div>\n";
}

/// Of numbers that no device gave.
std::string origin_banner(Origin origin) {
  if (origin == Origin::measured) return {};
  return fmt::format("<div class=\"origin\"><h3>{}</h3></div>\n",
                     origin == Origin::simulated ? "Simulated: no propeller turned, no load cell measured"
                                                 : "It is not known whether these numbers were measured or simulated");
}

std::string remark_section(std::span<const std::string> remarks) {
  if (remarks.empty()) return {};
  std::string html = "<div class=\"remarks\"><h3>Before you fly this</h3>\n<ul>\n";
  for (const std::string& remark : remarks) html += "<li>" + typeset(remark) + "</li>\n";
  return html + "</ul></div>\n";
}

std::string card(const std::string& title, const Budget& budget, const std::string& per) {
  const auto rpm = [](double k) { return to_newtons_per_rpm2(ThrustCoefficient(k)); };
  const double value = budget.value, error = budget.expanded();
  return fmt::format(
      "<div class=\"card\"><h3>{0}</h3><div class=\"value\">{1} <span class=\"unit\">N/(rad/s)²{3}</span></div>"
      "<p>{2} N/RPM²{3}</p></div>\n",
      title, with_power_of_ten(value, error), with_power_of_ten(rpm(value), rpm(error)), per);
}

std::string headline(const Fitted& fitted) {
  const CurveFit& curve = fitted.identification.curve_fit;
  const Analysis& analysis = fitted.analysis;
  const Budget& K_T = analysis.coefficients.front();
  std::string cards = card("Thrust coefficient K<sub>T</sub> = k(0), without occlusion", K_T, "");
  for (std::size_t i = 0; i < analysis.parameters.size(); ++i)
    if (curve.parameters[i].at_deg != 0.0)  // K_T once more
      cards += card(fmt::format("k(φ), {}: {}", name_of(curve.form), analysis.parameters[i].quantity),
                    analysis.parameters[i], curve.parameters[i].per);
  return "<div class=\"cards\">\n" + cards + "</div>\n" + html_note(typeset(plus_minus_words(K_T)) + ".");
}

/// The result in one sentence.
std::string lead(const Identification& identification) {
  if (identification.alone()) return {};
  const OcclusionCoefficient& widest = identification.table.back();
  const bool at = identification.at_speed_rad_s > 0 && widest.at_speed;
  const CurveParameter* slope = identification.curve_fit.find("slope_per_deg");
  return fmt::format("<p class=\"lead\">{} occlusion of {} leaves {:.1f} % of the thrust{}.</p>\n",
                     at ? "At " + html_rpm(identification.at_speed_rad_s) + " RPM an" : "An",
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

/// What φ is, on one look.
std::string stand_section(const std::string& drawing) {
  if (drawing.empty()) return {};
  return html_heading("What was measured") + "<figure class=\"stand\">\n" + inline_svg(drawing, "stand-") +
         "\n<figcaption>The plates cover a sector of angle φ under the propeller; the arrow is its sense of rotation, "
         "seen "
         "from above. The load cell measures the thrust less what the air presses on the "
         "plate.</figcaption></figure>\n";
}

std::string vehicle_section(const Chapter& chapter) {
  if (chapter.shapes.empty()) return {};
  return html_heading("On the vehicle") + fmt::format("<p><b>{}.</b></p>\n", typeset(chapter.vehicle)) +
         "<figure class=\"vehicle\">\n" + inline_svg(chapter.shapes, "vehicle-") +
         "\n<figcaption>Its shapes from above, the nose up: arms, disks (dashed) with number, sense and φ, and what of "
         "each disk the body covers.</figcaption></figure>\n";
}

std::string own_claims_section(const Fitted& fitted) {
  std::vector<Claim> claims = test_claims({&fitted, 1});
  std::erase_if(claims, [](const Claim& claim) { return claim.verdict == Verdict::not_tested; });
  return claims_section(claims);
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
  if (provenance.measured_utc.size() >= 10)
    text += fmt::format(" · {}{}",
                        provenance.origin == Origin::unknown ? "" : name_of(provenance.origin) + std::string(" "),
                        provenance.measured_utc.substr(0, 10));
  if (!provenance.stand.empty()) text += " · bench " + provenance.stand;
  if (!provenance.operator_name.empty()) text += " · by " + provenance.operator_name;
  return html_escaped(text);
}

std::string page_head(const std::string& title, const std::string& heading, const std::string& sub) {
  return fmt::format(
      "<!DOCTYPE html>\n<html xmlns=\"http://www.w3.org/1999/xhtml\" lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n<title>{}</title>\n"
      "<style>{}</style>\n</head>\n<body>\n<header><h1>{}</h1>\n<p class=\"sub\">{}</p></header>\n",
      title, report_style(), heading, sub);
}

std::string figure_section(const Figures& figures, std::size_t begin, std::size_t end, const char* heading,
                           int& number) {
  const std::string drawn = figure_blocks(figures, begin, end, number);
  return drawn.empty() ? "" : html_heading(heading) + "<div class=\"figures\">\n" + drawn + "</div>\n";
}

/// On a page of several propellers each chapter prints on two pages: standard air, the budget and the figures after
/// these move into its appendix, behind all chapters.
constexpr std::size_t kFiguresOfChapter = 5;

/// The first figure belongs to the headline, the others follow the table.
std::string body(const Fitted& fitted, const Chapter& chapter, int& number, bool alone) {
  const auto& [identification, analysis] = fitted;
  const Figures& figures = chapter.figures;
  std::string html =
      origin_banner(chapter.provenance.origin) + verdict_box(analysis.flight) + lead(identification) + headline(fitted);
  html += figure_blocks(figures, 0, 1, number) + skipped_note(figures) + remark_section(analysis.remarks) +
          coefficient_section(fitted) + (chapter.claims ? own_claims_section(fitted) : "");
  if (alone) html += standard_section(fitted) + stand_section(chapter.drawing) + vehicle_section(chapter);
  html +=
      figure_section(figures, 1, alone ? figures.drawn.size() : kFiguresOfChapter, "How well the model holds", number);
  if (alone) html += analysis_sections(analysis) + campaign_sections(identification, chapter.provenance);
  return html;
}

std::string appendix(const Fitted& fitted, const Chapter& chapter, const std::string& of, int& number, bool alone) {
  const auto& [identification, analysis] = fitted;
  std::string html = fmt::format("<h2{}>Appendix{}</h2>\n", alone ? "" : " class=\"chapter\"", of);
  if (!alone)
    html += standard_section(fitted) +
            figure_section(chapter.figures, kFiguresOfChapter, chapter.figures.drawn.size(), "More figures", number) +
            analysis_sections(analysis) + campaign_sections(identification, chapter.provenance);
  return html + analysis_appendix(analysis) + campaign_appendix(identification, chapter.provenance);
}

}  // namespace

std::string format_report(const Fitted& fitted, const Chapter& chapter) {
  int number = 0;
  const std::string name = html_escaped(fitted.identification.propeller);
  const auto [what, subject] = fitted.identification.alone() ? std::pair("K_T", "thrust coefficient")
                                                             : std::pair("k(φ)", "how an occlusion costs thrust");
  return page_head(what + (" of " + name), name + ": " + subject,
                   propeller_line(fitted.identification, chapter.provenance)) +
         body(fitted, chapter, number, true) + appendix(fitted, chapter, "", number, true) + kPageEnd;
}

std::string format_reports(std::span<const Fitted> family, std::span<const Chapter> chapters, const Figures& together,
                           const History* history) {
  std::string names, contents, bodies;
  int number = 0;
  const std::string figure = figure_blocks(together, 0, together.drawn.size(), number) + skipped_note(together);
  for (std::size_t i = 0; i < family.size(); ++i) {
    const Provenance& provenance = chapters[i].provenance;
    const std::string name =
        html_escaped(history != nullptr && provenance.measured_utc.size() >= 10 ? provenance.measured_utc.substr(0, 10)
                                                                                : family[i].identification.propeller);
    names += (names.empty() ? "" : ", ") + name;
    contents += fmt::format("<a href=\"#chapter{}\">{}</a>", i + 1, name);
    bodies += fmt::format("<h2 class=\"chapter\" id=\"chapter{}\">{}</h2>\n", i + 1,
                          propeller_line(family[i].identification, provenance)) +
              body(family[i], chapters[i], number, false);
  }
  for (std::size_t i = 0; i < family.size(); ++i)
    bodies += appendix(family[i], chapters[i], ": " + propeller_line(family[i].identification, chapters[i].provenance),
                       number, false);
  const std::string navigation = "<nav>" + contents + "</nav>\n";
  if (std::ranges::all_of(family, [](const Fitted& one) { return one.identification.alone(); }))
    return page_head("K_T of " + names, "K_T of several logs, without occlusions", names) + navigation +
           logs_section(family) + bodies + kPageEnd;
  if (history != nullptr) {
    const std::string propeller = html_escaped(history->propeller);
    return page_head("k(φ) of " + propeller + " over time", propeller + ": its campaigns over time", names) +
           navigation + figure + history_section(*history) + bodies + kPageEnd;
  }
  return page_head("k(φ) of " + names, "How an occlusion costs thrust: k(φ) of several propellers", names) +
         navigation + family_section(family) + figure + slopes_section(shared_slopes(family)) +
         claims_section(test_claims(family)) + bodies + kPageEnd;
}

}  // namespace kphi::fit
