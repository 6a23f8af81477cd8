#include "fit/html.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <pugixml.hpp>
#include <sstream>

namespace kphi::fit {
namespace {

constexpr std::string_view kReplacement = "\xEF\xBF\xBD";

/// Length of the UTF-8 character at the front, 0 if there is none (overlong forms, surrogates and above U+10FFFF
/// included) or XML 1.0 does not allow it.
std::size_t character_length(std::string_view text) {
  const auto byte = [&](std::size_t i) { return i < text.size() ? static_cast<std::uint8_t>(text[i]) : 0u; };
  const auto follows = [&](std::size_t i) { return (byte(i) & 0xC0u) == 0x80u; };
  const std::uint32_t first = byte(0);
  if (first < 0x80) return first >= 0x20 || first == '\t' || first == '\n' || first == '\r' ? 1 : 0;
  if (first >= 0xC2 && first <= 0xDF) return follows(1) ? 2 : 0;
  if (first >= 0xE0 && first <= 0xEF) {
    if (!follows(1) || !follows(2)) return 0;
    const std::uint32_t code = ((first & 0x0Fu) << 12) | ((byte(1) & 0x3Fu) << 6) | (byte(2) & 0x3Fu);
    return code >= 0x800 && !(code >= 0xD800 && code <= 0xDFFF) && code < 0xFFFE ? 3 : 0;
  }
  if (first >= 0xF0 && first <= 0xF4) {
    if (!follows(1) || !follows(2) || !follows(3)) return 0;
    const std::uint32_t code = ((first & 0x07u) << 18) | ((byte(1) & 0x3Fu) << 12);
    return code >= 0x10000 && code <= 0x10FFFF ? 4 : 0;
  }
  return 0;
}

std::string_view escape_of(char c) {
  switch (c) {
    case '&':
      return "&amp;";
    case '<':
      return "&lt;";
    case '>':
      return "&gt;";
    case '"':
      return "&quot;";
    case '\'':
      return "&#39;";
    default:
      return {};
  }
}

void prefix_references(pugi::xml_node node, const std::string& prefix) {
  // gnuplot numbers the curves of each panel anew, for a mouse that is not there.
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
    if (length == 0) {
      result += kReplacement;
      text.remove_prefix(1);
      continue;
    }
    const std::string_view escape = escape_of(text.front());
    result += escape.empty() ? text.substr(0, length) : escape;
    text.remove_prefix(length);
  }
  return result;
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
  static constexpr std::array<std::pair<std::string_view, std::string_view>, 8> kSigns{{{"K_T", "K<sub>T</sub>"},
                                                                                        {"k_i", "k<sub>i</sub>"},
                                                                                        {"w^2", "ω²"},
                                                                                        {"phi", "φ"},
                                                                                        {" deg", "°"},
                                                                                        {"RPM^2", "RPM²"},
                                                                                        {")^2", ")²"},
                                                                                        {"D^4", "D⁴"}}};
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

}  // namespace kphi::fit
