#include "drivers/sim/strict_map.hpp"

#include <fmt/format.h>

namespace kphi::sim {

void refuse(const std::string& path, const YAML::Mark& mark, const std::string& what, const std::string& next_move) {
  throw FileError(fmt::format("{}:{}:{}: {}; {}", path, mark.line + 1, mark.column + 1, what, next_move));
}

YAML::Node parse_yaml(const std::string& text, const std::string& path) {
  try {
    return YAML::Load(text);
  } catch (const YAML::Exception& error) {
    refuse(path, error.mark, error.msg, "mend the YAML");
  }
}

std::map<std::string, YAML::Node> members(const YAML::Node& map, const std::string& path) {
  if (!map.IsMap()) refuse(path, map.Mark(), "this is no map of keys and values", "write key: value");
  std::map<std::string, YAML::Node> all;
  for (const auto& member : map) {
    if (!member.first.IsScalar()) refuse(path, member.first.Mark(), "this key is no word", "write key: value");
    const bool fresh = all.emplace(member.first.Scalar(), member.second).second;
    if (!fresh) refuse(path, member.first.Mark(), fmt::format("'{}' stands twice", member.first.Scalar()), "keep one");
  }
  return all;
}

const std::string& scalar(const std::string& key, const YAML::Node& value, const std::string& path) {
  if (!value.IsScalar()) refuse(path, value.Mark(), fmt::format("{} is no single value", key), "write one");
  return value.Scalar();
}

}  // namespace kphi::sim
