// Files for the simulated bench, read strictly: maps of scalars, each key once, and complaints that name the place.
#pragma once

#include <yaml-cpp/yaml.h>

#include <map>
#include <string>

#include "drivers/sim/file_error.hpp"

namespace kphi::sim {

/// Throws FileError.
[[noreturn]] void refuse(const std::string& path, const YAML::Mark& mark, const std::string& what,
                         const std::string& next_move);
/// The whole text. Throws FileError.
[[nodiscard]] YAML::Node parse_yaml(const std::string& text, const std::string& path);
/// Of a map, each key once. Throws FileError.
[[nodiscard]] std::map<std::string, YAML::Node> members(const YAML::Node& map, const std::string& path);
/// The value of `key`, which must be a single one. Throws FileError.
[[nodiscard]] const std::string& scalar(const std::string& key, const YAML::Node& value, const std::string& path);

}  // namespace kphi::sim
