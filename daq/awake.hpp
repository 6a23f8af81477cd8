// Whether this computer has slept. What happened at the bench meanwhile nobody has seen, and the module has let the
// motor go by its own timeout: nothing may turn afterwards until a person has looked.
#pragma once

#include "daq/interlock.hpp"
#include "drivers/clock.hpp"

namespace kphi::daq {

[[nodiscard]] inline bool has_slept(const Clock& clock) noexcept { return clock.suspended() >= kShortestSleep; }
/// The safety stop that follows from it.
[[nodiscard]] Trip slept(const Clock& clock);
/// Throws SafetyStop when the computer has slept since the clock's epoch.
void require_awake(const Clock& clock);

}  // namespace kphi::daq
