// Where in a text the table is: its rows, the line of names above them, the line of units, and what separates fields.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace kphi::fit {

/// A line that is not blank.
struct TextLine {
  std::size_t number = 0;
  std::string_view text;
  std::string_view comment;  ///< the sign that it begins with
};

/// A table in lines, by one separator.
struct TableShape {
  char separator = ',';
  std::size_t fields = 0;
  bool open_end = false;  ///< every row ends with an empty field, which `fields` does not count
  std::size_t first = 0;  ///< row, index into the lines
  std::optional<std::size_t> header{}, units{}, misfit{};  ///< lines; misfit: text above the rows of other fields
  std::vector<std::string> names, unit_names;
  double score = 0;
};

/// The first `most` lines that are not blank.
[[nodiscard]] std::vector<TextLine> lines_of(std::string_view text, std::size_t most);

/// The likeliest table, `separator` '\0' if that is to be found, too. Throws ConfigurationError (path:line) where there
/// is none.
[[nodiscard]] TableShape find_shape(const std::vector<TextLine>& lines, const std::string& path, char separator);

/// Fields of a line; none of one whose quotes do not end.
[[nodiscard]] std::vector<std::string> fields_of(std::string_view line, char separator);
/// Without the blanks around it.
[[nodiscard]] std::string_view bare(std::string_view text);
/// "", "NaN", "-" and their like.
[[nodiscard]] bool says_nothing(const std::string& field);
/// Throws ConfigurationError "path:line: what".
[[noreturn]] void refuse_at(const std::string& path, std::size_t line, const std::string& what);

}  // namespace kphi::fit
