// How late this computer wakes the program, and whether it gives it real-time priority: what decides whether a busy
// laptop stops campaigns.
#pragma once

#include <string>

#include "base/clock.hpp"
#include "daq/hardware/probe.hpp"

namespace kphi::daq {

struct WakeUps {
  int count = 0;        ///< of each kind, one every 5 ms
  Duration with{0};     ///< the latest with the priority that was asked for
  Duration without{0};  ///< the latest of an ordinary thread
  std::string refusal;  ///< why real-time priority was refused; empty: granted
  bool memory_stays = false;
};

/// Blocks for `seconds` of wall time, while two threads sleep as the guard does.
[[nodiscard]] WakeUps measure_wake_ups(double seconds);

/// Beside the limits that a run of `config` keeps.
[[nodiscard]] DeviceAnswer answer_of(const WakeUps& seen, const profiles::BenchConfig& config);

}  // namespace kphi::daq
