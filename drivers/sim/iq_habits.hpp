// What the documents of the module leave open, as switches: each is answered as seems likeliest, and can be answered
// otherwise. And the two firmware personalities that a stand may meet.
#pragma once

#include <cstddef>
#include <cstdint>

namespace kphi::sim {

struct IqHabits {
  enum class OutOfRange : std::uint8_t { stored, clamped, ignored };
  enum class Oscillator : std::uint8_t { none, velocity_and_time, all };  ///< what its error reaches; all: baud too

  bool get_restarts_timeout = true;  ///< "any IQUART message"; false: only commands do
  bool other_ids_restart_timeout = false;
  bool song_always = false;  ///< after a timeout, continuously, whatever the option says
  bool baud_at_once = true;  ///< false: after a reboot
  bool broadcast_get_answered = false;
  bool broadcast_set_obeyed = true;
  Oscillator oscillator = Oscillator::all;
  bool coil_estimator = true;     ///< client 83 is there
  bool legacy_estimator = false;  ///< client 77 is there
  bool lamination = false;        ///< rows 14 to 19 of client 83
  bool telemetry = true;          ///< client 88, row 1
  bool system_control_on_id_zero = false;
  bool thrust_entries = false;  ///< ctrl_thrust, propeller_kt_pos and _neg, ctrl_torque
  bool supply_limits = false;   ///< brushless_drive 48 to 60
  bool undocumented = false;    ///< rows without published access, and those of other firmware styles
  bool configurable_timeout = true;
  OutOfRange out_of_range = OutOfRange::stored;
  std::size_t receive_buffer = 64;  ///< bytes; what comes while it is full is lost. 0: without limit
  bool coast_in_safe_mode = true;   ///< drive_mode reads coast then; false: the last mode
  bool time_settable = true;
  std::uint32_t firmware = 0x00100020;  ///< speed 0.0.32
};

/// Before the coil estimator and the configurable timeout.
[[nodiscard]] constexpr IqHabits legacy_habits() noexcept {
  IqHabits habits;
  habits.song_always = true;
  habits.coil_estimator = false;
  habits.legacy_estimator = true;
  habits.telemetry = false;
  habits.system_control_on_id_zero = true;
  habits.configurable_timeout = false;
  habits.firmware = 0x0010000a;  // speed 0.0.10
  return habits;
}

}  // namespace kphi::sim
