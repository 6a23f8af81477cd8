#include "daq/guard/awake.hpp"

#include <fmt/format.h>

namespace kphi::daq {

Trip slept(const Clock& clock) {
  Trip trip;
  trip.watched = Watched::sleep;
  trip.source = Source::computer;
  trip.value = to_seconds(clock.suspended());
  trip.reason = fmt::format("this computer slept for {:.2g} s", trip.value);
  return trip;
}

void require_awake(const Clock& clock) {
  if (has_slept(clock)) throw SafetyStop(slept(clock));
}

}  // namespace kphi::daq
