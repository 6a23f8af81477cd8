// The characters of a text, before YAML looks at them: UTF-8, no control characters, no tabs in the indentation.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "profiles/finding.hpp"

namespace kphi::profiles {

/// Turns a reader's line and byte column (both from 0) into a Mark.
class Lines {
 public:
  explicit Lines(const std::string& text);
  [[nodiscard]] Mark mark(int line, int byte_column) const;

 private:
  std::vector<std::string> lines_;
};

/// First control character or broken UTF-8 sequence, tabs and line ends allowed.
struct BadCharacter {
  std::size_t offset = 0;  ///< bytes
  std::string what;
};
[[nodiscard]] std::optional<BadCharacter> first_bad_character(const std::string& text);

/// As first_bad_character, over a whole file, with the place; also a tab where the indentation stands.
[[nodiscard]] std::optional<Finding> first_fault_of_characters(const std::string& text);

}  // namespace kphi::profiles
