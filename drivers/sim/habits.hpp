// The open questions of the box by name, so that a person can choose an answer to each.
#pragma once

#include <string>

#include "drivers/sim/netbox_settings.hpp"

namespace kphi::sim {

/// `name` as in NetBoxHabits; `value`: true or false, a number, or a word. Throws FaultEntryError.
void set_habit(NetBoxHabits& habits, const std::string& name, const std::string& value);

}  // namespace kphi::sim
