// Whether this computer has slept. Meanwhile the bench was unwatched, and the module has coasted the motor by its own
// timeout: nothing may turn until a person has looked at the stand.
#pragma once

#include "base/clock.hpp"
#include "daq/guard/interlock.hpp"

namespace kphi::daq {

[[nodiscard]] inline bool has_slept(const Clock& clock) noexcept { return clock.suspended() >= kShortestSleep; }
/// The safety stop that follows from it.
[[nodiscard]] Trip slept(const Clock& clock);
/// Throws SafetyStop when the computer has slept since the clock's epoch.
void require_awake(const Clock& clock);

}  // namespace kphi::daq
