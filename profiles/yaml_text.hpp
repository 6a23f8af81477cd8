// What is wrong in a file that a person wrote, where, and what to do about it; and the text of a YAML file before its
// structure: UTF-8 without control characters, no tabs in the indentation; and what
// an unquoted scalar is: true or false, a number, text, or one of YAML's traps.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/error.hpp"
#include "base/finding.hpp"

namespace kphi::profiles {

/// A place in a text. Both count from 1; columns count characters, not bytes.
struct Mark {
  int line = 1;
  int column = 1;
};

/// A fault: a file with any is refused.
struct FileFinding : Finding {
  FileFinding(Mark where, std::string json_pointer, std::string what_is_wrong, std::string next)
      : Finding{Severity::fault, std::move(what_is_wrong), std::move(next)},
        mark(where),
        pointer(std::move(json_pointer)) {}

  Mark mark;
  std::string pointer;  ///< JSON pointer of the guilty value or key; empty: the whole file
};

/// "path:line:column: what; next move"
[[nodiscard]] std::string describe(const std::string& path, const FileFinding& finding);

/// A file with findings; what() has one line per finding, in the order of the file, at most kShownFindings.
class RefusedFile : public ConfigurationError {
 public:
  static constexpr std::size_t kShownFindings = 20;
  RefusedFile(const std::string& path, std::vector<FileFinding> findings);
  [[nodiscard]] const std::vector<FileFinding>& findings() const noexcept { return findings_; }

 private:
  std::vector<FileFinding> findings_;
};

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
