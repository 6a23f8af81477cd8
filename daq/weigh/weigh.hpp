// The load cell checked by a known mass that a person hangs on it and takes off again, while the motor is without power
// and watched.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "daq/bench/bench.hpp"
#include "daq/run/progress.hpp"
#include "daq/run/steering.hpp"
#include "results/reduction/weighing.hpp"

namespace kphi::daq {

/// What a person reads of a weighing's Position: its phase.
inline constexpr std::string_view kTakeOff = "mass off", kPutOn = "mass on", kMeasuring = "measuring";

struct Weigh {
  Bench& bench;
  Progress& progress;
  const std::function<bool()>& stop_asked;
  /// hold: the mass is as was asked for; stop: no more. nullptr: nobody is asked, for a simulated bench or a robot.
  Keys* keys;
  results::Weighing weighing;                  ///< what is known before: bench, mass, gravity, axis
  int times = 3;                               ///< on and off
  Duration stretch = std::chrono::seconds(3);  ///< of samples for one mean
  /// Called again and again while the motor is at rest, and without power if kphi controls that: Ctrl-Z may stop kphi.
  std::function<void()> while_at_rest = [] {};
};

/// Asks, waits until the load is at rest, measures; off, on, off, … . What cannot be the mass is asked for again.
/// Throws SafetyStop, Interrupted, DeviceError, DataRejected if the load does not come to rest or cannot be the mass
/// and nobody is there to change it.
[[nodiscard]] results::Weighing weigh(const Weigh& order);

/// " mass on  2/3   z   4.903 N"; the load is without its first zero.
[[nodiscard]] std::string describe_weighing(const Position& position, const Observation& seen,
                                            std::size_t columns = kAnyWidth);

}  // namespace kphi::daq
