// Entries of a script of faults in one line each: "loss at_s=0.1 for_s=2 p=0.5", the kind first.
#pragma once

#include <sstream>
#include <string>
#include <vector>

#include "drivers/sim/script/faults.hpp"

namespace kphi::sim::test {

/// A word without '=' goes on with the value before it: "motor_garbage at_s=0 bytes=55 3B".
inline FaultEntry fault_entry(const std::string& words) {
  FaultEntry entry;
  std::string key = "kind";
  std::istringstream stream(words);
  for (std::string word; stream >> word;) {
    const std::size_t equals = word.find('=');
    if (equals != std::string::npos) key = word.substr(0, equals);
    std::string& value = entry[key];
    value += (value.empty() ? "" : " ") + (equals == std::string::npos ? word : word.substr(equals + 1));
  }
  return entry;
}

inline Fault fault(const std::string& words) { return fault_of(fault_entry(words)); }

inline FaultScript fault_script(const std::vector<std::string>& entries) {
  FaultScript script;
  for (const std::string& words : entries) script.push_back(fault(words));
  return script;
}

}  // namespace kphi::sim::test
