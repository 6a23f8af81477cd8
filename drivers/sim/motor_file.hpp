// The simulated motor as a file: physics of motor, supply and heat, and the errors of the module's sensors. What the
// file does not name is as in the 2306 that is built in.
//
//     format: kphi-sim-motor/1
//     motor: {rotor_inertia_kg_m2: 3e-6, resistance_ohm: 0.05}
//     supply: {source_resistance_ohm: 0.1}
//
// profiles/motor_iq2306.yaml names all keys, with their units.
#pragma once

#include <string>

#include "drivers/sim/file_error.hpp"
#include "drivers/sim/iq_sensors.hpp"
#include "drivers/sim/motor.hpp"

namespace kphi::sim {

struct MotorProfile {
  MotorParameters motor;
  IqSensorErrors sensors;
};

/// Strict; throws FileError. `path` only names the text in messages.
[[nodiscard]] MotorProfile parse_motor_profile(const std::string& text, const std::string& path);
/// All keys with their values, as parse_motor_profile reads them.
[[nodiscard]] std::string motor_profile_yaml(const MotorProfile& profile);

}  // namespace kphi::sim
