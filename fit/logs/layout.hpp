// How a table of a stand is written: what find_layout() takes from its bytes, what a layout file holds, and what
// read_log() reads by.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "base/text.hpp"
#include "fit/logs/column_roles.hpp"
#include "fit/logs/number_format.hpp"

namespace kphi::fit {

enum class Encoding : std::uint8_t { utf8, utf16le, utf16be, windows1252 };

struct LayoutColumn {
  Role role{};
  std::size_t index = 0;  ///< in a line, from 0
  std::string name;       ///< in the header; empty: the table has none
  std::string unit;       ///< as unit_named() knows it
};

struct Layout {
  Encoding encoding = Encoding::utf8;
  std::size_t header_line = 1;  ///< of the names; 0: the table has none
  std::size_t units_line = 0;   ///< 0: none
  std::size_t first_row = 2;    ///< line
  std::size_t fields = 0;       ///< of a row
  std::string comment;          ///< lines that begin so are skipped; empty: no such lines
  char separator = ',';         ///< ' ': any number of blanks
  NumberFormat numbers;
  std::vector<LayoutColumn> columns;
  // What was found beside it.
  std::vector<std::string> header;  ///< all names
  std::vector<std::string> unread;  ///< columns that look like a role and are not taken, with the reason

  /// Columns of the role.
  [[nodiscard]] std::vector<LayoutColumn> all(Role role) const;
  [[nodiscard]] bool has(Role role) const { return !all(role).empty(); }
  /// More than one: each has a speed, and the thrust is that of all together.
  [[nodiscard]] std::size_t rotors() const;
};

/// The text as UTF-8 with '\n' at the ends of its lines, in blocks of whole lines.
[[nodiscard]] TextBlocks as_utf8(TextBlocks text, Encoding encoding);
/// By the first block: a byte order mark, NULs at every other place, bytes that are not UTF-8.
[[nodiscard]] Encoding encoding_of(std::string_view text);

/// A dozen lines for a person to confirm: "  separator  ;".
[[nodiscard]] std::string describe(const Layout& layout);

/// The layout file, format kphi-layout/1.
[[nodiscard]] std::string layout_text(const Layout& layout);
/// Throws RefusedFile.
[[nodiscard]] Layout parse_layout(const std::string& text, const std::string& path);

}  // namespace kphi::fit
