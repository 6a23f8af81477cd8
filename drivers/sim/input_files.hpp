// Fault scripts and motor files of a simulated bench, read strictly: every message names file, line and
// column.
//
// A fault script; the beginning of `kind` (motor_, supply_, ambient_; none: the load cell) names the device:
//
//     format: kphi-faults/1
//     quirks: {bias_stops_stream: true}     # of the box, see NetBoxQuirks; optional
//     faults:
//       - {at_s: 2, for_s: 1, kind: loss, p: 0.01, burst: 3}
//       - {at_s: 5, kind: reboot, down_s: 0.8, resume: true}
//
// A motor; a key that is not given is as in the built-in 2306. profiles/motor_iq2306.yaml has every key with its unit:
//
//     format: kphi-sim-motor/1
//     motor: {rotor_inertia_kg_m2: 3e-6, resistance_ohm: 0.05}
//     supply: {source_resistance_ohm: 0.1}
#pragma once

#include <string>

#include "drivers/sim/simulated_bench.hpp"

namespace kphi::sim {

struct FaultFile {
  FaultScript faults;
  NetBoxQuirks quirks;
};

/// Throws ConfigurationError. `path` is used in messages only.
[[nodiscard]] FaultFile parse_faults(const std::string& text, const std::string& path);
/// Puts the whole file into the bench. Throws ConfigurationError, also for faults of a supply that the bench does not
/// have.
void load_faults(const std::string& text, const std::string& path, BenchSettings& bench);

struct MotorProfile {
  MotorParameters motor;
  IqSensorErrors sensors;
};

/// Throws ConfigurationError. `path` is used in messages only.
[[nodiscard]] MotorProfile parse_motor_profile(const std::string& text, const std::string& path);

}  // namespace kphi::sim
