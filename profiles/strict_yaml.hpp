// YAML without its traps: text in, JSON and the mark of every value out.
//
// Refused, each with its mark: duplicate keys, yes/no/on/off and other spellings of booleans, numbers that some YAML
// reads as octal, hexadecimal, sexagesimal or with separators, numbers that are not finite, tags, merge keys, a second
// document, tabs in the indentation, control characters, bytes that are not UTF-8. Quoted text stays text.
#pragma once

#include <cstddef>
#include <map>
#include <nlohmann/json.hpp>
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

/// A text beyond these is refused: no real file comes near.
inline constexpr std::size_t kMaxTextBytes = 1u << 20;
inline constexpr int kMaxDepth = 16;
inline constexpr int kMaxValues = 10'000;  ///< aliases count as often as they are used
inline constexpr std::size_t kMaxScalarBytes = 4096;
inline constexpr std::size_t kMaxKeyBytes = 128;

struct SourceDocument {
  std::string path;  ///< names the text in messages
  nlohmann::json value;
  std::map<std::string, Mark> value_marks;  ///< by JSON pointer; an aliased value lies where its anchor is
  std::map<std::string, Mark> key_marks;    ///< by JSON pointer of the value that the key names
  std::vector<FileFinding> findings;        ///< what is wrong but left the rest readable; such values are null

  /// Of the value, or of the nearest one around it.
  [[nodiscard]] Mark value_mark(std::string pointer) const;
  /// Of the key that names it, else of the value.
  [[nodiscard]] Mark key_mark(const std::string& pointer) const;
};

/// Throws RefusedFile where the rest of the text cannot be read; lesser faults go into `findings`.
[[nodiscard]] SourceDocument parse_strict_yaml(const std::string& text, const std::string& path);

/// The bytes of a file. Throws ConfigurationError if it cannot be read or is larger than kMaxTextBytes.
[[nodiscard]] std::string read_text(const std::string& path);

/// pointer + "/" + key, escaped by RFC 6901.
[[nodiscard]] std::string child_pointer(const std::string& pointer, const std::string& key);

/// "/profile/steps" → "profile.steps", "/occlusions_deg/2" → "occlusions_deg[2]".
[[nodiscard]] std::string dotted(const std::string& pointer);

}  // namespace kphi::profiles
