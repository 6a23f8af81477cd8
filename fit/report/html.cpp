#include "fit/report/html.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <boost/locale/utf.hpp>
#include <cctype>
#include <cmath>
#include <pugixml.hpp>
#include <sstream>

#include "compensation/units.hpp"

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

std::string html_rpm(double speed_rad_s) { return fmt::format("{:.0f}", to_rpm(RadPerSec(speed_rad_s))); }

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

std::string html_section(std::string_view title, const HtmlTable& table, std::string_view note) {
  const std::string html = table.html();
  return html.empty() ? html : html_heading(title) + html + (note.empty() ? "" : html_note(note));
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
  if (const std::size_t begin = text.find('`'), end = text.find('`', begin + 1); end != std::string_view::npos)
    return typeset(text.substr(0, begin)) + "<code>" + html_escaped(text.substr(begin + 1, end - begin - 1)) +
           "</code>" + typeset(text.substr(end + 1));
  std::string result = html_escaped(text);
  const auto letter = [&](std::size_t at) {
    return at < result.size() && std::isalpha(static_cast<unsigned char>(result[at])) != 0;
  };
  const auto of_a_name = [&](std::size_t at) {  // 5x3_phi000_rep1.h5
    return letter(at) ||
           (at < result.size() && (result[at] == '_' || std::isdigit(static_cast<unsigned char>(result[at])) != 0));
  };
  for (const auto& [plain, set] : kSigns) {
    for (std::size_t at = result.find(plain); at != std::string::npos; at = result.find(plain, at + 1)) {
      const bool in_a_word = of_a_name(at + plain.size()) || (at > 0 && letter(at) && of_a_name(at - 1));
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

}  // namespace kphi::fit
