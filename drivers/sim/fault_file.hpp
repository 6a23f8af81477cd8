// A fault script as a file:
//
//     format: kphi-faults/1
//     habits: {bias_stops_stream: true}     # of the box, see NetBoxHabits; may be absent
//     faults:
//       - {at_s: 2, for_s: 1, kind: loss, p: 0.01, burst: 3}
//       - {at_s: 5, kind: reboot, down_s: 0.8, resume: true}
//
// `kind` says which device an entry concerns.
#pragma once

#include <string>

#include "drivers/sim/faults.hpp"
#include "drivers/sim/file_error.hpp"
#include "drivers/sim/iq_faults.hpp"
#include "drivers/sim/netbox_settings.hpp"
#include "drivers/sim/supply_faults.hpp"
#include "drivers/sim/usb_faults.hpp"

namespace kphi::sim {

/// Strict; throws FileError. `path` only names the text in messages. Entries of the motor, whose kinds begin with
/// motor_, are for parse_motor_faults(), those of the supply (supply_) for parse_supply_faults(), those
/// of the sensor of the air (ambient_ and a kind of usb_faults.hpp) for parse_ambient_faults(), all others for this.
[[nodiscard]] FaultScript parse_faults(const std::string& text, const std::string& path);
/// Of the same file; defaults where it names none.
[[nodiscard]] NetBoxHabits parse_habits(const std::string& text, const std::string& path);
[[nodiscard]] MotorFaultScript parse_motor_faults(const std::string& text, const std::string& path);
[[nodiscard]] SupplyFaultScript parse_supply_faults(const std::string& text, const std::string& path);
[[nodiscard]] UsbFaultScript parse_ambient_faults(const std::string& text, const std::string& path);

}  // namespace kphi::sim
