// The text of a YAML file before its structure: UTF-8 without control characters, no tabs in the indentation; and what
// an unquoted scalar is: true or false, a number, text, or one of YAML's traps.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "profiles/refused_file.hpp"

namespace kphi::profiles {

/// Of a UTF-8 sequence, behind its first byte.
[[nodiscard]] constexpr bool is_continuation(char byte) { return (static_cast<unsigned char>(byte) & 0xC0u) == 0x80u; }

/// Turns a reader's line and byte column (both from 0) into a Mark.
class Lines {
 public:
  explicit Lines(const std::string& text);
  [[nodiscard]] Mark mark(int line, int byte_column) const;

 private:
  std::vector<std::string> lines_;
};

/// First control character or broken UTF-8 sequence; tabs and line ends are allowed.
struct BadCharacter {
  std::size_t offset = 0;  ///< bytes
  std::string what;
};
[[nodiscard]] std::optional<BadCharacter> first_bad_character(const std::string& text);

/// As first_bad_character, with the mark; also a tab in the indentation.
[[nodiscard]] std::optional<FileFinding> first_fault_of_characters(const std::string& text);

struct Scalar {
  nlohmann::json value;  ///< null if refused
  std::string what;      ///< why it is refused; empty if it is not
  std::string next_move;
};

/// An unquoted scalar.
[[nodiscard]] Scalar read_plain_scalar(const std::string& text);

}  // namespace kphi::profiles
