#include "drivers/iq/setting.hpp"

#include <fmt/format.h>

namespace kphi::iq {
namespace {

std::string path(const Entry& entry) { return fmt::format("{}.{}", name_of(entry.type), entry.name); }

}  // namespace

std::vector<Finding> set_and_read_back(Dialogue& module, std::span<const Setting> settings) {
  std::vector<Finding> findings;
  for (const Setting& setting : settings) {
    module.tell(*setting.entry, setting.value);
    const auto answer = module.ask(*setting.entry);
    if (!answer && !setting.required) continue;
    if (answer && is_as_set(*setting.entry, setting.value, answer->value)) continue;
    findings.push_back(
        {Severity::fault,
         fmt::format("{} was set to {:.9g} {} and {}", path(*setting.entry), setting.value, setting.entry->unit,
                     answer ? fmt::format("reads back {:.9g}", answer->value) : "does not answer"),
         "check the firmware version and the line to the module, then connect again"});
  }
  return findings;
}

std::vector<Setting> connection_settings(double module_timeout_s) {
  return {{&entry<"propeller_motor_control.timeout">, module_timeout_s},
          {&entry<"propeller_motor_control.timeout_behavior">, static_cast<double>(TimeoutBehavior::coast), false},
          {&entry<"propeller_motor_control.timeout_song_option">, static_cast<double>(SongOption::never), false}};
}

}  // namespace kphi::iq
