// Text, tables and drawings for a page that is both HTML and well-formed XML.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace kphi::fit {

/// & < > " ' escaped; control characters and invalid UTF-8 become U+FFFD, so that the page stays well formed whatever a
/// name contains.
[[nodiscard]] std::string html_escaped(std::string_view text);

/// Escaped, and ASCII forms replaced by signs: K_T and k_i with their index, φ, ω², °, N/RPM².
[[nodiscard]] std::string typeset(std::string_view text);

/// (1.550197 ± 0.000027) × 10⁻⁶, with a true minus; an unknown error is left out.
[[nodiscard]] std::string with_power_of_ten(double value, double error);

/// A number with a true minus; "–" if it is not finite.
[[nodiscard]] std::string html_number(double value, const char* format = "{:.3g}");

/// "45°"
[[nodiscard]] std::string html_angle(double phi_deg);

/// Of a speed in rad/s, whole RPM: "19100"
[[nodiscard]] std::string html_rpm(double speed_rad_s);

/// A heading of level 2.
[[nodiscard]] std::string html_heading(std::string_view title);

/// A paragraph below a table.
[[nodiscard]] std::string html_note(std::string_view html);

/// A table; headings and cells are HTML.
class HtmlTable {
 public:
  enum class Column : std::uint8_t { number, text, hash };
  struct Heading {
    Heading(const char* title, Column content = Column::number) : html(title), column(content) {}
    Heading(std::string title) : html(std::move(title)) {}
    std::string html;
    Column column = Column::number;
  };
  /// Heading of a column of text.
  static Heading text(const char* html) { return {html, Column::text}; }
  /// A long table may break across pages.
  explicit HtmlTable(std::vector<Heading> headings, bool is_long = false);
  /// As many cells as headings. `bad` names the column whose cell is marked as a failure.
  void row(const std::vector<std::string>& cells, std::optional<std::size_t> bad = {});
  /// Empty without a row.
  [[nodiscard]] std::string html() const { return has_rows_ ? html_ + "</tbody></table></div>\n" : ""; }

 private:
  std::vector<Column> columns_;
  std::string html_;
  bool has_rows_ = false;
};

/// A table under its heading, with a note below; empty if the table is.
[[nodiscard]] std::string html_section(std::string_view title, const HtmlTable& table, std::string_view note = {});

/// An SVG file as an element of a page: without XML declaration and doctype, with `prefix` before every id and every
/// reference to one, so that two figures on a page do not mix. Empty if the text is not SVG.
[[nodiscard]] std::string inline_svg(std::string_view svg, const std::string& prefix);

/// The style sheet of the report, on screen and on paper: loads nothing, no script.
[[nodiscard]] const char* report_style();

}  // namespace kphi::fit
