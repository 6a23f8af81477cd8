#include "drivers/sim/fault_file.hpp"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

namespace kphi::sim {
namespace {

constexpr const char* kFormat = "kphi-faults/1";

[[noreturn]] void refuse(const std::string& path, const YAML::Mark& mark, const std::string& what,
                         const std::string& next_move) {
  throw FaultFileError(fmt::format("{}:{}:{}: {}; {}", path, mark.line + 1, mark.column + 1, what, next_move));
}

/// A map of scalars, each key once.
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

/// Adds the entry to the script if it is of its kind.
template <class FaultType>
void read_entry(const YAML::Node& node, const std::string& path, FaultType (*make)(const FaultEntry&), bool of_motor,
                std::vector<FaultType>& script) {
  FaultEntry entry;
  const auto all = members(node, path);
  for (const auto& [key, value] : all) {
    if (!value.IsScalar()) refuse(path, value.Mark(), fmt::format("{} is no single value", key), "write a number");
    entry[key] = value.Scalar();
  }
  try {
    if (is_motor_fault(entry) == of_motor) script.push_back(make(entry));
  } catch (const FaultEntryError& error) {
    const auto at = all.find(error.key);
    refuse(path, at == all.end() ? node.Mark() : at->second.Mark(), error.what(), "mend this entry");
  }
}

YAML::Node parse(const std::string& text, const std::string& path) {
  try {
    return YAML::Load(text);
  } catch (const YAML::Exception& error) {
    refuse(path, error.mark, error.msg, "mend the YAML");
  }
}

YAML::Node entries_of(const std::string& text, const std::string& path) {
  const YAML::Node root = parse(text, path);
  const auto all = members(root, path);
  for (const auto& [key, value] : all) {
    if (key != "format" && key != "faults")
      refuse(path, value.Mark(), fmt::format("unknown key '{}'", key), "remove it");
  }
  if (!all.contains("format") || !all.at("format").IsScalar() || all.at("format").Scalar() != kFormat) {
    refuse(path, root.Mark(), "this is no fault script", fmt::format("begin it with format: {}", kFormat));
  }
  if (!all.contains("faults") || !all.at("faults").IsSequence()) {
    refuse(path, root.Mark(), "there is no list of faults", "write faults: and a list of entries, or []");
  }
  return all.at("faults");
}

}  // namespace

FaultScript parse_faults(const std::string& text, const std::string& path) {
  FaultScript script;
  for (const auto& entry : entries_of(text, path)) read_entry(entry, path, fault_of, false, script);
  return script;
}

MotorFaultScript parse_motor_faults(const std::string& text, const std::string& path) {
  MotorFaultScript script;
  for (const auto& entry : entries_of(text, path)) read_entry(entry, path, motor_fault_of, true, script);
  return script;
}

}  // namespace kphi::sim
