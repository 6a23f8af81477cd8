#include "drivers/sim/fault_file.hpp"

#include <fmt/format.h>

#include "drivers/sim/habits.hpp"
#include "drivers/sim/strict_map.hpp"

namespace kphi::sim {
namespace {

constexpr const char* kFormat = "kphi-faults/1";

NetBoxHabits read_habits(const YAML::Node& node, const std::string& path) {
  NetBoxHabits habits;
  for (const auto& [key, value] : members(node, path)) {
    try {
      set_habit(habits, key, scalar(key, value, path));
    } catch (const FaultEntryError& error) {
      refuse(path, value.Mark(), error.what(), "mend it");
    }
  }
  return habits;
}

/// Adds the entry to the script if it is of its kind.
template <class FaultType>
void read_entry(const YAML::Node& node, const std::string& path, FaultType (*make)(const FaultEntry&), bool of_motor,
                std::vector<FaultType>& script) {
  FaultEntry entry;
  const auto all = members(node, path);
  for (const auto& [key, value] : all) entry[key] = scalar(key, value, path);
  try {
    if (is_motor_fault(entry) == of_motor) script.push_back(make(entry));
  } catch (const FaultEntryError& error) {
    const auto at = all.find(error.key);
    refuse(path, at == all.end() ? node.Mark() : at->second.Mark(), error.what(), "mend this entry");
  }
}

/// Its members, known by name; there is a list of faults.
std::map<std::string, YAML::Node> file_of(const std::string& text, const std::string& path) {
  const YAML::Node root = parse_yaml(text, path);
  auto all = members(root, path);
  for (const auto& [key, value] : all) {
    if (key != "format" && key != "faults" && key != "habits")
      refuse(path, value.Mark(), fmt::format("unknown key '{}'", key), "remove it");
  }
  if (!all.contains("format") || !all.at("format").IsScalar() || all.at("format").Scalar() != kFormat) {
    refuse(path, root.Mark(), "this is no fault script", fmt::format("begin it with format: {}", kFormat));
  }
  if (!all.contains("faults") || !all.at("faults").IsSequence()) {
    refuse(path, root.Mark(), "there is no list of faults", "write faults: and a list of entries, or []");
  }
  return all;
}

}  // namespace

FaultScript parse_faults(const std::string& text, const std::string& path) {
  FaultScript script;
  const auto file = file_of(text, path);
  for (const auto& entry : file.at("faults")) read_entry(entry, path, fault_of, false, script);
  return script;
}

MotorFaultScript parse_motor_faults(const std::string& text, const std::string& path) {
  MotorFaultScript script;
  const auto file = file_of(text, path);
  for (const auto& entry : file.at("faults")) read_entry(entry, path, motor_fault_of, true, script);
  return script;
}

NetBoxHabits parse_habits(const std::string& text, const std::string& path) {
  const auto file = file_of(text, path);
  return file.contains("habits") ? read_habits(file.at("habits"), path) : NetBoxHabits{};
}

}  // namespace kphi::sim
