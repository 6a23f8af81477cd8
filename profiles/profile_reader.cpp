#include "profiles/profile_reader.hpp"

#include <fmt/format.h>

#include <string_view>

namespace kphi::profiles {
namespace {

/// "coefficients" of "kphi-coefficients/2"; empty for any other format.
std::string word_of(const std::string& format) {
  constexpr std::string_view kOurs = "kphi-";
  const auto slash = format.find('/');
  if (format.compare(0, kOurs.size(), kOurs) != 0 || slash == std::string::npos) return "";
  return format.substr(kOurs.size(), slash - kOurs.size());
}

/// A file of another kind is one finding, not one for each of its keys. A misspelt kind is not another kind.
void refuse_other_kind(const SourceDocument& document, FileKind kind) {
  if (!document.value.is_object()) return;
  const auto format = document.value.find("format");
  if (format == document.value.end() || !format->is_string()) return;
  const std::string word = word_of(format->get<std::string>());
  if (word.empty() || nearest_name(word, {info(kind).word})) return;
  throw RefusedFile(document.path,
                    {{document.value_mark("/format"), "/format",
                      fmt::format("this is {}, expected {}", file_of_kind(word), file_of_kind(info(kind).word)),
                      fmt::format("name a file that begins with format: {}", info(kind).format)}});
}

}  // namespace

ProfileReader::ProfileReader(const std::string& text, const std::string& path, FileKind kind)
    : document_(parse_strict_yaml(text, path)) {
  refuse_other_kind(document_, kind);
  for (FileFinding& finding : check_schema(document_, schema_of(kind)))
    document_.findings.push_back(std::move(finding));
  throw_findings();
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

void ProfileReader::require_above(const std::string& high, const std::string& low, const char* unit,
                                  const std::string& next_move) {
  if (number(high) > number(low)) return;
  refuse(high, fmt::format("{} is not above {}{} ({})", number(high), number(low), unit, dotted(low)), next_move);
}

void ProfileReader::finish() {
  throw_findings();
  const nlohmann::json values = document_.value.flatten();
  for (const auto& [pointer, value] : values.items()) {
    if (value.is_null()) continue;  // an empty list or object
    std::string known = pointer;
    while (!known.empty() && !read_.contains(known)) known.resize(known.rfind('/'));
    if (known.empty()) refuse(pointer, "this kphi does not use it", "remove it, and report this mistake of kphi");
  }
  throw_findings();
}

void ProfileReader::throw_findings() const {
  if (!document_.findings.empty()) throw RefusedFile(document_.path, document_.findings);
}

}  // namespace kphi::profiles
