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
#include <vector>

#include "profiles/yaml_text.hpp"

namespace kphi::profiles {

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
