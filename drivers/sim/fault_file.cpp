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
void read_entry(const YAML::Node& node, const std::string& path, FaultType (*make)(const FaultEntry&),
                bool (*belongs)(const FaultEntry&), std::vector<FaultType>& script) {
  FaultEntry entry;
  const auto all = members(node, path);
  for (const auto& [key, value] : all) entry[key] = scalar(key, value, path);
  try {
    if (belongs(entry)) script.push_back(make(entry));
  } catch (const FaultEntryError& error) {
    const auto at = all.find(error.key);
    refuse(path, at == all.end() ? node.Mark() : at->second.Mark(), error.what(), "mend this entry");
  }
}

constexpr std::string_view kAmbient = "ambient_";

bool is_ambient_fault(const FaultEntry& entry) {
  const auto kind = entry.find("kind");
  return kind != entry.end() && kind->second.starts_with(kAmbient);
}

UsbFault ambient_fault_of(const FaultEntry& entry) {
  FaultEntry plain = entry;
  plain["kind"].erase(0, kAmbient.size());
  return usb_fault_of(plain);
}

bool is_load_cell_fault(const FaultEntry& entry) {
  return !is_motor_fault(entry) && !is_supply_fault(entry) && !is_ambient_fault(entry);
}
bool of_motor(const FaultEntry& entry) { return is_motor_fault(entry); }
bool of_supply(const FaultEntry& entry) { return is_supply_fault(entry); }

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

template <class FaultType>
std::vector<FaultType> entries(const std::string& text, const std::string& path, FaultType (*make)(const FaultEntry&),
                               bool (*belongs)(const FaultEntry&)) {
  std::vector<FaultType> script;
  const auto file = file_of(text, path);
  for (const auto& entry : file.at("faults")) read_entry(entry, path, make, belongs, script);
  return script;
}

}  // namespace

FaultScript parse_faults(const std::string& text, const std::string& path) {
  return entries(text, path, fault_of, is_load_cell_fault);
}

MotorFaultScript parse_motor_faults(const std::string& text, const std::string& path) {
  return entries(text, path, motor_fault_of, of_motor);
}

SupplyFaultScript parse_supply_faults(const std::string& text, const std::string& path) {
  return entries(text, path, supply_fault_of, of_supply);
}

UsbFaultScript parse_ambient_faults(const std::string& text, const std::string& path) {
  return entries(text, path, ambient_fault_of, is_ambient_fault);
}

NetBoxHabits parse_habits(const std::string& text, const std::string& path) {
  const auto file = file_of(text, path);
  return file.contains("habits") ? read_habits(file.at("habits"), path) : NetBoxHabits{};
}

}  // namespace kphi::sim
