// Finds out how a table is written: preamble, line of names, line of units, separator, marks in numbers, encoding, and
// what each column measures. What a person would doubt, too, is asked for and not guessed.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "fit/logs/layout.hpp"
#include "fit/logs/table_shape.hpp"

namespace kphi::fit {

/// What a person says of a table beforehand.
struct LayoutHints {
  std::vector<ColumnRole> columns{};
  char separator = '\0';          ///< '\0': find it
  std::optional<char> decimal{};  ///< '.' or ','
};

/// `begin`: its first lines, UTF-8. Throws ConfigurationError (path:line) that says what could not be found or could be
/// read in two ways, with what either would mean, and how to say which.
[[nodiscard]] Layout find_layout(std::string_view begin, const std::string& path, const LayoutHints& hints = {});

/// What the shape alone says: lines, separator, names, comments.
[[nodiscard]] Layout layout_of(const TableShape& shape, const std::vector<TextLine>& lines);

inline constexpr std::size_t kLinesLooked = 500;  ///< of the begin; a preamble is shorter

}  // namespace kphi::fit
