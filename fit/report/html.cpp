#include "fit/report/html.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <boost/locale/utf.hpp>
#include <cctype>
#include <cmath>
#include <pugixml.hpp>
#include <sstream>

namespace kphi::fit {
namespace {

constexpr std::string_view kReplacement = "\xEF\xBF\xBD";

/// Length of the UTF-8 character at the front; 0 if it is broken or XML 1.0 does not allow it.
std::size_t character_length(std::string_view text) {
  const char* end = text.data();
  const auto code = boost::locale::utf::utf_traits<char>::decode(end, text.data() + text.size());
  const bool allowed = code >= 0x20 || code == '\t' || code == '\n' || code == '\r';
  const bool valid = boost::locale::utf::is_valid_codepoint(code) && code != 0xFFFE && code != 0xFFFF;
  return allowed && valid ? static_cast<std::size_t>(end - text.data()) : 0;
}

std::string_view escape_of(char c) {
  if (c == '&') return "&amp;";
  if (c == '<') return "&lt;";
  if (c == '>') return "&gt;";
  if (c == '"') return "&quot;";
  return c == '\'' ? "&#39;" : "";
}

void prefix_references(pugi::xml_node node, const std::string& prefix) {
  // gnuplot numbers the curves of each panel from 1 again, for mouse events that this page does not have.
  if (std::string_view(node.attribute("id").value()).starts_with("gnuplot_plot_")) node.remove_attribute("id");
  for (pugi::xml_attribute attribute : node.attributes()) {
    const std::string_view name = attribute.name();
    const std::string value = attribute.value();
    if (name == "id") {
      attribute.set_value((prefix + value).c_str());
    } else if ((name == "href" || name == "xlink:href") && value.starts_with('#')) {
      attribute.set_value(("#" + prefix + value.substr(1)).c_str());
    } else if (const auto at = value.find("url(#"); at != std::string::npos) {
      attribute.set_value((value.substr(0, at + 5) + prefix + value.substr(at + 5)).c_str());
    }
  }
  for (pugi::xml_node child : node.children()) prefix_references(child, prefix);
}

}  // namespace

std::string html_escaped(std::string_view text) {
  std::string result;
  while (!text.empty()) {
    const std::size_t length = character_length(text);
    const std::string_view escape = length == 0 ? kReplacement : escape_of(text.front());
    result += escape.empty() ? text.substr(0, length) : escape;
    text.remove_prefix(std::max<std::size_t>(length, 1));
  }
  return result;
}

std::string html_number(double value, const char* format) {
  if (!std::isfinite(value)) return "–";
  const std::string text = fmt::format(fmt::runtime(format), value);
  return text.starts_with('-') ? "−" + text.substr(1) : text;
}

std::string html_angle(double phi_deg) { return fmt::format("{:g}°", phi_deg); }

std::string html_heading(std::string_view title) { return fmt::format("<h2>{}</h2>\n", title); }

std::string html_note(std::string_view html) { return fmt::format("<p class=\"note\">{}</p>\n", html); }

HtmlTable::HtmlTable(std::vector<Heading> headings, bool is_long) {
  html_ = fmt::format("<div class=\"scroll{}\"><table><thead><tr>", is_long ? " long" : "");
  for (Heading& heading : headings) {
    html_ += fmt::format("<th{}>{}</th>", heading.column == Column::number ? "" : " class=\"text\"", heading.html);
    columns_.push_back(heading.column);
  }
  html_ += "</tr></thead><tbody>\n";
}

void HtmlTable::row(const std::vector<std::string>& cells, std::optional<std::size_t> bad) {
  static constexpr std::array<const char*, 3> kClasses{"", "text", "hash"};
  html_ += "<tr>";
  for (std::size_t i = 0; i < columns_.size(); ++i) {
    std::string name = kClasses[static_cast<std::size_t>(columns_[i])];
    if (bad == i) name += name.empty() ? "bad" : " bad";
    html_ += name.empty() ? "<td>" : fmt::format("<td class=\"{}\">", name);
    html_ += cells.at(i) + "</td>";
  }
  html_ += "</tr>\n";
  has_rows_ = true;
}

std::string inline_svg(std::string_view svg, const std::string& prefix) {
  pugi::xml_document document;
  if (!document.load_buffer(svg.data(), svg.size())) return {};
  pugi::xml_node root = document.child("svg");
  if (!root) return {};
  prefix_references(root, prefix);
  std::ostringstream text;
  root.print(text, "", pugi::format_raw | pugi::format_no_declaration);
  return std::move(text).str();
}

std::string typeset(std::string_view text) {
  using Sign = std::pair<std::string_view, std::string_view>;
  static constexpr Sign kSigns[] = {{"K_T", "K<sub>T</sub>"},
                                    {"k_i", "k<sub>i</sub>"},
                                    {"w^2", "ω²"},
                                    {"phi", "φ"},
                                    {" deg", "°"},
                                    {"RPM^2", "RPM²"},
                                    {")^2", ")²"},
                                    {"D^4", "D⁴"}};
  std::string result = html_escaped(text);
  const auto letter = [&](std::size_t at) {
    return at < result.size() && std::isalpha(static_cast<unsigned char>(result[at])) != 0;
  };
  for (const auto& [plain, set] : kSigns) {
    for (std::size_t at = result.find(plain); at != std::string::npos; at = result.find(plain, at + 1)) {
      const bool in_a_word = letter(at + plain.size()) || (at > 0 && letter(at) && letter(at - 1));
      if (!in_a_word) result.replace(at, plain.size(), set);
    }
  }
  return result;
}

std::string with_power_of_ten(double value, double error) {
  if (!(std::abs(value) > 0) || !std::isfinite(value)) return fmt::format("{:.5e}", value);
  static constexpr std::array kDigits{"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
  const int exponent = static_cast<int>(std::floor(std::log10(std::abs(value))));
  const double unit = std::pow(10, exponent);
  const bool known = error > 0 && std::isfinite(error);
  const int digits = known ? std::clamp(1 - static_cast<int>(std::floor(std::log10(error / unit))), 0, 12) : 5;
  std::string power = exponent < 0 ? "⁻" : "";
  for (const char c : fmt::format("{}", std::abs(exponent))) power += kDigits[static_cast<std::size_t>(c - '0')];
  const std::string sign = value < 0 ? "−" : "";
  const std::string number = fmt::format("{}{:.{}f}", sign, std::abs(value) / unit, digits);
  return known ? fmt::format("({} ± {:.{}f}) × 10{}", number, error / unit, digits, power)
               : fmt::format("{} × 10{}", number, power);
}

const char* report_style() {
  return R"(
:root{--ink:#1c2430;--soft:#566071;--rule:#dde2e8;--accent:#d55e00;--blue:#0072b2;--panel:#f6f8fa}
*{box-sizing:border-box}
html{-webkit-text-size-adjust:100%}
body{font:16px/1.55 system-ui,-apple-system,"Segoe UI",Roboto,"Helvetica Neue",Arial,"DejaVu Sans",sans-serif;
 color:var(--ink);background:#fff;max-width:70rem;margin:0 auto;padding:2.5rem 1.5rem 4rem}
header{border-bottom:3px solid var(--ink);padding-bottom:1rem;margin-bottom:1.5rem}
h1{font-size:1.9rem;line-height:1.2;letter-spacing:-.01em;margin:0 0 .3rem}
h2{font-size:1.25rem;line-height:1.3;margin:2.75rem 0 .8rem;padding-bottom:.3rem;border-bottom:1px solid var(--rule)}
h2.chapter{font-size:1.5rem;border-bottom:3px solid var(--ink);margin-top:4rem}
p{margin:.6rem 0}
p.sub{color:var(--soft);margin:0}
p.lead{font-size:1.1rem;max-width:46rem;margin:0 0 1.4rem}
p.note,figcaption{color:var(--soft);font-size:.88rem;max-width:52rem}
nav{margin:1rem 0;font-size:.95rem}nav a{color:var(--blue);margin-right:1.2rem}
.cards{display:grid;grid-template-columns:repeat(auto-fit,minmax(17rem,1fr));gap:1rem}
.card{background:var(--panel);border:1px solid var(--rule);border-top:3px solid var(--blue);border-radius:4px;
 padding:.9rem 1.1rem}
.card h3{margin:0;font-size:.86rem;font-weight:600;color:var(--soft)}
.card .value{font-size:1.02rem;font-weight:650;font-variant-numeric:tabular-nums;margin:.2rem 0;white-space:normal}
.card .value .unit{display:block;font-size:.86rem;font-weight:400;color:var(--soft)}
.card p{margin:0;font-size:.86rem;color:var(--soft);font-variant-numeric:tabular-nums}
figure{margin:1.5rem 0 2rem}
figure svg{display:block;width:100%;max-width:54rem;height:auto;margin:0 auto}
figcaption{margin:.6rem auto 0;max-width:54rem}
figcaption b{color:var(--ink)}
.scroll{overflow-x:auto}
table{border-collapse:collapse;width:100%;font-size:.86rem;line-height:1.4;font-variant-numeric:tabular-nums}
th{text-align:right;font-weight:600;color:var(--soft);border-bottom:2px solid var(--ink);padding:.35rem .6rem;
 vertical-align:bottom}
td{text-align:right;border-bottom:1px solid var(--rule);padding:.32rem .6rem;white-space:nowrap}
tbody tr:nth-child(even){background:#fafbfc}
th.text,td.text{text-align:left;white-space:normal}
td.bad{color:#9c3d00;font-weight:600}
td.hash{text-align:left;font:.68rem/1.4 ui-monospace,"DejaVu Sans Mono",Menlo,monospace;white-space:normal;
 word-break:break-all;color:var(--soft)}
.soft{color:var(--soft)}
.remarks{background:var(--panel);border-left:4px solid var(--accent);padding:.7rem 1.2rem;margin:1.2rem 0}
.remarks h3{margin:0 0 .3rem;font-size:.95rem}.remarks ul{margin:0;padding-left:1.2rem}.remarks li{margin:.15rem 0}
.verdict{background:var(--panel);border-left:4px solid #2e7d4f;padding:.6rem 1.2rem;margin:1.2rem 0}.verdict h3,.verdict p{margin:.1rem 0}
.verdict.with_care{border-color:#c77d00}.verdict.not_yet{border-color:#b3261e}
.warning{background:#fff5e9;border-left:4px solid var(--accent);padding:.6rem 1rem}
dl{display:grid;grid-template-columns:max-content 1fr;gap:.3rem 1.4rem;margin:0;font-size:.92rem}
dt{color:var(--soft)}dd{margin:0;overflow-wrap:anywhere}
@media (max-width:40rem){dl{grid-template-columns:1fr}dd{margin-bottom:.4rem}}
@page{size:A4;margin:16mm 15mm 18mm}
@media print{body{margin:0;padding:0;max-width:none;font-size:9.5pt}
 .card,figure,tr,.warning,.remarks,.scroll{break-inside:avoid}.scroll.long{break-inside:auto}h2{break-after:avoid}h2.chapter{break-before:page}
 thead{display:table-header-group}.scroll{overflow:visible}table{font-size:7.6pt}th,td{padding:.2rem .35rem}
 .cards{grid-template-columns:repeat(3,1fr);gap:.6rem}.card{padding:.45rem .55rem}.card h3,.card p{font-size:7.8pt}.card .value{font-size:9.2pt;white-space:nowrap}
 figure{margin:.6rem 0 1rem}figure svg{max-width:none;width:78%}nav{display:none}
 *{-webkit-print-color-adjust:exact;print-color-adjust:exact}}
)";
}

}  // namespace kphi::fit
