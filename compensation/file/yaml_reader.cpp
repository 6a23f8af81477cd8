#include "compensation/file/yaml_reader.hpp"

#include <charconv>
#include <cmath>
#include <set>
#include <utility>

#include "compensation/file/coefficient_error.hpp"

namespace kphi::compensation {
namespace {

/// In quotes "unknown" is a text like any other.
bool says_nothing(const YAML::Node& node) {
  return !node.IsDefined() || node.IsNull() || (node.IsScalar() && node.Scalar() == "unknown" && node.Tag() != "!");
}

}  // namespace

YamlReader::YamlReader(const std::string& text, std::string path) : path_(std::move(path)) {
  try {
    top_ = YAML::Load(text);
  } catch (const YAML::Exception& error) {
    refuse_line(error.mark.line, "not YAML: " + error.msg, "restore the file as `kphi fit` wrote it");
  }
  if (!top_.IsMap()) refuse_line(0, "not a coefficient file", "give the coefficients.yaml that `kphi fit` wrote");
  refuse_repeated_keys(top_);
}

YAML::Node YamlReader::optional(const YAML::Node& map, const std::string& key) const {
  const YAML::Node value = map[key];
  return says_nothing(value) ? YAML::Node(YAML::NodeType::Undefined) : value;
}

YAML::Node YamlReader::required(const YAML::Node& map, const std::string& key) const {
  const YAML::Node value = optional(map, key);
  if (!value.IsDefined()) refuse(map, "`" + key + "` is missing here", "write the file again with `kphi fit`");
  return value;
}

YAML::Node YamlReader::required_map(const YAML::Node& map, const std::string& key) const {
  const YAML::Node value = required(map, key);
  if (!value.IsMap()) refuse(value, "`" + key + "` must hold keys of its own", "write the file again with `kphi fit`");
  return value;
}

std::vector<YAML::Node> YamlReader::list(const YAML::Node& map, const std::string& key) const {
  const YAML::Node value = optional(map, key);
  if (!value.IsDefined()) return {};
  if (!value.IsSequence()) refuse(value, "`" + key + "` must be a list", "write it as [ … ]");
  return {value.begin(), value.end()};
}

double YamlReader::number(const YAML::Node& node, const std::string& name) const {
  if (!node.IsScalar()) refuse(node, "`" + name + "` must be a number", "give one finite number");
  const std::string& text = node.Scalar();
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) {
    refuse(node, "`" + name + "` is `" + text + "`, not a finite number", "give one finite number");
  }
  return value;
}

double YamlReader::number_at(const YAML::Node& map, const std::string& key) const {
  return number(required(map, key), key);
}

std::optional<double> YamlReader::optional_number_at(const YAML::Node& map, const std::string& key) const {
  const YAML::Node value = optional(map, key);
  if (!value.IsDefined()) return std::nullopt;
  return number(value, key);
}

std::optional<int> YamlReader::optional_count_at(const YAML::Node& map, const std::string& key) const {
  const std::optional<double> value = optional_number_at(map, key);
  if (!value) return std::nullopt;
  if (*value < 0 || *value > 1e9 || *value != std::floor(*value)) {
    refuse(optional(map, key), "`" + key + "` is not a count", "give a whole number, 0 or more");
  }
  return static_cast<int>(*value);
}

bool YamlReader::truth_at(const YAML::Node& map, const std::string& key) const {
  const YAML::Node value = required(map, key);
  if (value.IsScalar() && value.Scalar() == "true") return true;
  if (value.IsScalar() && value.Scalar() == "false") return false;
  refuse(value, "`" + key + "` is neither true nor false", "write true or false");
}

std::string YamlReader::text_at(const YAML::Node& map, const std::string& key) const {
  const YAML::Node value = required(map, key);
  if (!value.IsScalar())
    refuse(value, "`" + key + "` must be one word or text", "write the file again with `kphi fit`");
  return value.Scalar();
}

std::string YamlReader::optional_text_at(const YAML::Node& map, const std::string& key) const {
  return optional(map, key).IsDefined() ? text_at(map, key) : std::string();
}

void YamlReader::refuse_repeated_keys(const YAML::Node& node) const {
  std::set<std::string> seen;
  for (const auto& entry : node) {
    if (!node.IsMap()) {
      refuse_repeated_keys(entry);
      continue;
    }
    if (entry.first.IsScalar() && !seen.insert(entry.first.Scalar()).second) {
      refuse(entry.first, "`" + entry.first.Scalar() + "` stands here a second time", "keep one of the two");
    }
    refuse_repeated_keys(entry.second);
  }
}

void YamlReader::refuse(const YAML::Node& at, const std::string& what, const std::string& next_move) const {
  refuse_line(at.Mark().line, what, next_move);
}

void YamlReader::refuse_line(int line, const std::string& what, const std::string& next_move) const {
  throw CoefficientError(path_ + ":" + std::to_string(line + 1) + ": " + what + "; " + next_move);
}

}  // namespace kphi::compensation
