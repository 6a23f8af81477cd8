// The numbers of IQUART, and nothing else: enums of codes, shared with the simulated module.
// Source: the vendor's communication library and documentation of the 23-XX speed modules.
#pragma once

#include <cstdint>

namespace kphi::iq {

/// Low two bits of the ACCESS byte; the six above are the module id. Only `get` is ever answered.
enum class Access : std::uint8_t { get = 0, set = 1, save = 2, reply = 3 };

/// The TYPE byte: which client (part of the firmware) a packet speaks to.
enum class Client : std::uint8_t {
  system_control = 5,
  brushless_drive = 50,
  propeller_motor_control = 52,
  power_monitor = 69,
  temperature_monitor_uc = 73,
  hobby_input = 76,
  temperature_estimator = 77,  ///< old firmware; newer ones have coil_temperature_estimator
  coil_temperature_estimator = 83,
  power_safety = 84,
  arming_handler = 86,
  stopping_handler = 87,
};

/// Module ids: 0..62 are a module's own.
enum class ModuleId : std::uint8_t { first = 0, last = 62, broadcast = 63 };

/// brushless_drive.drive_mode: what the power stage does. `coast` is the only proof of a stop command.
enum class DriveMode : std::uint8_t {
  phase_pwm = 0,
  phase_volts = 1,
  spin_pwm = 2,
  spin_volts = 3,
  brake = 4,
  coast = 5,
};

/// propeller_motor_control.timeout_behavior
enum class TimeoutBehavior : std::uint8_t { coast = 0, zero_volts_then_coast = 1, zero_volts_then_brake = 2 };

/// propeller_motor_control.timeout_meaning
enum class TimeoutMeaning : std::uint8_t { error_and_disarm = 0, disarm_behavior = 1, error_stay_armed = 2 };

/// propeller_motor_control.timeout_song_option. The song drives the coils: it shakes the load cell.
enum class SongOption : std::uint8_t { never = 0, once = 1, continuously = 2 };

/// Bits of power_safety.fault_now and fault_ever.
enum class FaultBit : std::uint8_t {
  under_voltage = 0,
  input_voltage = 1,
  reference_voltage = 2,
  supply_current = 3,
  motor_current = 4,
  controller_temperature = 5,
  coil_temperature = 6,
};

}  // namespace kphi::iq
