// The JSON Schemas of the kinds of files, and what they find in a document, in words for its author.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "profiles/strict_yaml.hpp"

namespace kphi::profiles {

enum class FileKind { campaign, bench, vehicle, answers, world, layout, flight_layout };

struct FileKindInfo {
  FileKind kind;
  const char* word;    ///< "campaign"
  const char* format;  ///< value of the key `format`
};

inline constexpr std::array<FileKindInfo, 7> kFileKinds{{
    {FileKind::campaign, "campaign", "kphi-campaign/1"},
    {FileKind::bench, "bench", "kphi-bench/1"},
    {FileKind::vehicle, "vehicle", "kphi-vehicle/1"},
    {FileKind::answers, "answers", "kphi-answers/1"},
    {FileKind::world, "world", "kphi-world/1"},
    {FileKind::layout, "layout", "kphi-layout/1"},
    {FileKind::flight_layout, "flight_layout", "kphi-flight-layout/1"},
}};

/// "a bench file", "an answers file"
[[nodiscard]] inline std::string file_of_kind(const std::string& word) {
  return (word.front() == 'a' ? "an " : "a ") + word + " file";
}

[[nodiscard]] constexpr const FileKindInfo& info(FileKind kind) { return kFileKinds[static_cast<std::size_t>(kind)]; }

/// The schema, verbatim from profiles/schema/, embedded in the program.
[[nodiscard]] const char* schema_text(FileKind kind);
[[nodiscard]] const nlohmann::json& schema_of(FileKind kind);

/// One finding per fault (the innermost value or key, never the objects around it); empty if the document fits.
/// Values that `document.findings` already names are not judged again.
/// `schema`: of the keywords in schema.cpp (JSON Schema draft 7); any other is ignored.
[[nodiscard]] std::vector<FileFinding> check_schema(const SourceDocument& document, const nlohmann::json& schema);

/// A key without its unit and the unit in words: dwell_s → {"dwell", "s"}, steps → {"steps", ""}.
struct KeyParts {
  std::string stem;
  std::string unit;
};
[[nodiscard]] KeyParts split_unit(const std::string& key);

/// The one of `names` with the fewest typing errors from `name`, if these are few for its length.
[[nodiscard]] std::optional<std::string> nearest_name(const std::string& name, const std::vector<std::string>& names);

/// The one of `names` that is `name` but for the unit: dwell_ms or dwell → dwell_s.
[[nodiscard]] std::optional<std::string> same_but_for_unit(const std::string& name,
                                                           const std::vector<std::string>& names);

}  // namespace kphi::profiles
