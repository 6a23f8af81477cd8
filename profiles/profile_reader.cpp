#include "profiles/profile_reader.hpp"

#include <fmt/format.h>

namespace kphi::profiles {
namespace {

void refuse_other_kind(const SourceDocument& document, FileKind kind) {
  if (!document.value.is_object()) return;
  const auto format = document.value.find("format");
  if (format == document.value.end()) return;
  for (const FileKindInfo& other : kFileKinds) {
    if (other.kind == kind || *format != other.format) continue;
    throw RefusedFile(document.path,
                      {{document.value_mark("/format"), "/format",
                        fmt::format("this is a {} file, expected a {} file", other.word, info(kind).word),
                        fmt::format("name a file that begins with format: {}", info(kind).format)}});
  }
}

}  // namespace

ProfileReader::ProfileReader(const std::string& text, const std::string& path, FileKind kind)
    : document_(parse_strict_yaml(text, path)) {
  refuse_other_kind(document_, kind);
  for (Finding& finding : check_schema(document_, kind)) document_.findings.push_back(std::move(finding));
  finish();
}

const nlohmann::json& ProfileReader::value(const std::string& pointer) const {
  return document_.value.at(nlohmann::json::json_pointer(pointer));
}

bool ProfileReader::has(const std::string& pointer) const {
  return document_.value.contains(nlohmann::json::json_pointer(pointer));
}

double ProfileReader::number(const std::string& pointer) const { return get<double>(pointer); }

std::string ProfileReader::text(const std::string& pointer) const { return get<std::string>(pointer); }

std::vector<std::string> ProfileReader::keys(const std::string& pointer) const {
  std::vector<std::string> keys;
  for (const auto& [key, unused] : value(pointer).items()) keys.push_back(key);
  return keys;
}

void ProfileReader::refuse(const std::string& pointer, const std::string& what, const std::string& next_move) {
  document_.findings.push_back(
      {document_.value_mark(pointer), pointer, fmt::format("{}: {}", dotted(pointer), what), next_move});
}

void ProfileReader::finish() const {
  if (!document_.findings.empty()) throw RefusedFile(document_.path, document_.findings);
}

}  // namespace kphi::profiles
