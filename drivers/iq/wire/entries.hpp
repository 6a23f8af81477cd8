// Every entry of the speed firmware in one table: type, sub, name, format, unit, access, range.
// Formats and units follow the vendor's client files (its C++ headers and documents disagree in places: fault_now is
// one byte, ctrl_mode signed, the hobby ticks 32 bits). Ranges are those of the vendor's control program, not limits
// of the device. Requests are built from a name known at compile time; a set on what can only be read does not compile.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string_view>
#include <utility>

#include "drivers/iq/wire/packet.hpp"

namespace kphi::iq {

/// How an entry's data is laid out; little-endian.
enum class Format : std::uint8_t { none, i8, u8, u16, u32, i32, f32, bytes16 };

/// Bytes of data in a set or a reply.
[[nodiscard]] constexpr std::size_t size_of(Format format) noexcept {
  constexpr std::array<std::size_t, 8> sizes{0, 1, 1, 2, 4, 4, 4, 16};
  return sizes[static_cast<std::size_t>(format)];
}

/// One bit per Access. kUnknown: the vendor publishes no access; nothing may be asked.
inline constexpr std::uint8_t kUnknown = 0, kGet = 1, kSet = 2, kGetSet = 3, kGetSetSave = 7;

struct Entry {
  Client type;
  std::uint8_t sub;
  std::string_view name;
  Format format;
  std::string_view unit;
  std::uint8_t permitted;
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();

  /// A reply is permitted where a get is.
  [[nodiscard]] constexpr bool allows(Access access) const noexcept {
    const int bit = access == Access::reply ? 0 : static_cast<int>(access);
    return (permitted >> bit & 1) != 0;
  }
};

// brushless_drive 48..60 are absent from the 23-XX speed firmware as far as is known; the order of 55..60 is a guess.
inline constexpr Entry kEntries[] = {
    // propeller_motor_control
    {Client::propeller_motor_control, 0, "ctrl_mode", Format::i8, "enum", kGet},
    {Client::propeller_motor_control, 1, "ctrl_brake", Format::none, "", kSet},
    {Client::propeller_motor_control, 2, "ctrl_coast", Format::none, "", kSet},
    {Client::propeller_motor_control, 3, "ctrl_pwm", Format::f32, "PU", kGetSet, -1, 1},
    {Client::propeller_motor_control, 4, "ctrl_volts", Format::f32, "V", kGetSet, -25, 25},
    {Client::propeller_motor_control, 5, "ctrl_velocity", Format::f32, "rad/s", kGetSet, -3450, 3450},
    {Client::propeller_motor_control, 6, "ctrl_thrust", Format::f32, "", kGetSet},
    {Client::propeller_motor_control, 7, "velocity_Kp", Format::f32, "V/(rad/s)", kGetSetSave, 0, 1},
    {Client::propeller_motor_control, 8, "velocity_Ki", Format::f32, "V/(rad)", kGetSetSave, 0, 1},
    {Client::propeller_motor_control, 9, "velocity_Kd", Format::f32, "V/(rad/s^2)", kGetSetSave, 0, 1},
    {Client::propeller_motor_control, 10, "velocity_ff0", Format::f32, "V", kGetSetSave, -25.2, 25.2},
    {Client::propeller_motor_control, 11, "velocity_ff1", Format::f32, "V/(rad/s)", kGetSetSave, 0, 1},
    {Client::propeller_motor_control, 12, "velocity_ff2", Format::f32, "V/(rad/s)^2", kGetSetSave, 0, 1},
    {Client::propeller_motor_control, 13, "propeller_kt_pos", Format::f32, "", kGetSetSave},
    {Client::propeller_motor_control, 14, "propeller_kt_neg", Format::f32, "", kGetSetSave},
    {Client::propeller_motor_control, 15, "timeout", Format::f32, "s", kGetSetSave, 0, 1e9},
    {Client::propeller_motor_control, 16, "input_filter_fc", Format::u32, "Hz", kGetSetSave, 1, 10000},
    {Client::propeller_motor_control, 17, "timeout_meaning", Format::u8, "enum", kGetSetSave},
    {Client::propeller_motor_control, 18, "timeout_behavior", Format::u8, "enum", kGetSetSave},
    {Client::propeller_motor_control, 19, "timeout_song_option", Format::u8, "enum", kGetSetSave},
    {Client::propeller_motor_control, 20, "additional_velocity", Format::f32, "rad/s", kGetSetSave},
    {Client::propeller_motor_control, 21, "ctrl_torque", Format::f32, "Nm", kUnknown},
    // brushless_drive
    {Client::brushless_drive, 0, "drive_mode", Format::u8, "enum", kGet},
    {Client::brushless_drive, 1, "drive_phase_pwm", Format::f32, "PU", kSet},
    {Client::brushless_drive, 2, "drive_phase_volts", Format::f32, "V", kSet},
    {Client::brushless_drive, 3, "drive_spin_pwm", Format::f32, "PU", kSet},
    {Client::brushless_drive, 4, "drive_spin_volts", Format::f32, "V", kSet},
    {Client::brushless_drive, 5, "drive_brake", Format::none, "", kSet},
    {Client::brushless_drive, 6, "drive_coast", Format::none, "", kSet},
    {Client::brushless_drive, 7, "drive_angle_offset", Format::f32, "rad", kGet},
    {Client::brushless_drive, 8, "drive_pwm", Format::f32, "PU", kGet},
    {Client::brushless_drive, 9, "drive_volts", Format::f32, "V", kGet},
    {Client::brushless_drive, 10, "mech_lead_angle", Format::f32, "rad", kGet},
    {Client::brushless_drive, 11, "obs_supply_volts", Format::f32, "V", kGet},
    {Client::brushless_drive, 12, "obs_angle", Format::f32, "rad", kGet},
    {Client::brushless_drive, 13, "obs_velocity", Format::f32, "rad/s", kGet},
    {Client::brushless_drive, 14, "motor_pole_pairs", Format::u16, "PP", kGetSetSave},
    {Client::brushless_drive, 15, "motor_emf_shape", Format::u8, "enum", kGetSetSave},
    {Client::brushless_drive, 16, "permute_wires", Format::u8, "bool", kGetSetSave},
    {Client::brushless_drive, 17, "calibration_angle", Format::f32, "rad", kGetSetSave},
    {Client::brushless_drive, 18, "lead_time", Format::f32, "s", kGetSetSave},
    {Client::brushless_drive, 19, "commutation_hz", Format::u32, "Hz", kGetSetSave},
    {Client::brushless_drive, 20, "phase_angle", Format::f32, "rad", kGetSet},
    {Client::brushless_drive, 21, "drive_volts_addition", Format::f32, "V", kGetSet},
    {Client::brushless_drive, 22, "angle_adjust_enable", Format::u8, "bool", kGetSetSave},
    {Client::brushless_drive, 23, "motor_emf_calc", Format::f32, "V", kGet},
    {Client::brushless_drive, 24, "angle_adjustment", Format::f32, "rad", kGet},
    {Client::brushless_drive, 25, "angle_adjust_max", Format::f32, "rad", kGetSetSave},
    {Client::brushless_drive, 26, "angle_adjust_kp", Format::f32, "V/rad", kGetSetSave},
    {Client::brushless_drive, 27, "angle_adjust_ki", Format::f32, "V/(rad*s)", kGetSetSave},
    {Client::brushless_drive, 29, "v_max_start", Format::f32, "V", kGetSetSave, 0, 32768},
    {Client::brushless_drive, 30, "scaling_commutation_cycles_per_erev", Format::u32, "cycles per erev", kUnknown},
    {Client::brushless_drive, 31, "scaling_commutation_hz_floor", Format::u32, "Hz", kUnknown},
    {Client::brushless_drive, 32, "motor_Kv", Format::f32, "RPM/V", kGetSetSave},
    {Client::brushless_drive, 33, "motor_R_ohm", Format::f32, "ohm", kGetSetSave},
    {Client::brushless_drive, 34, "motor_I_max", Format::f32, "A", kGetSetSave, 0, 120},
    {Client::brushless_drive, 35, "volts_limit", Format::f32, "V", kGetSetSave, 0, 32768},
    {Client::brushless_drive, 36, "est_motor_amps", Format::f32, "A", kGet},
    {Client::brushless_drive, 37, "est_motor_torque", Format::f32, "Nm", kGet},
    {Client::brushless_drive, 38, "motor_redline_start", Format::f32, "rad/s", kGetSetSave, 0, 4100},
    {Client::brushless_drive, 39, "motor_redline_end", Format::f32, "rad/s", kGetSetSave, 0, 4200},
    {Client::brushless_drive, 40, "motor_l", Format::f32, "H", kGetSetSave},
    {Client::brushless_drive, 41, "derate", Format::i32, "PU fix16", kGet},
    {Client::brushless_drive, 42, "motor_i_soft_start", Format::f32, "A", kGetSetSave},
    {Client::brushless_drive, 43, "motor_i_soft_end", Format::f32, "A", kGetSetSave},
    {Client::brushless_drive, 44, "emf", Format::f32, "V", kGet},
    {Client::brushless_drive, 45, "volts_at_max_amps", Format::f32, "V", kGet},
    {Client::brushless_drive, 46, "slew_volts_per_second", Format::f32, "V/s", kGetSetSave},
    {Client::brushless_drive, 47, "slew_enable", Format::u8, "bool", kGetSetSave},
    {Client::brushless_drive, 48, "motoring_supply_current_limit", Format::f32, "A", kGetSetSave},
    {Client::brushless_drive, 49, "regen_supply_current_limit", Format::f32, "A", kGetSetSave},
    {Client::brushless_drive, 50, "supply_current_limit_enable", Format::u8, "bool", kGetSetSave},
    {Client::brushless_drive, 51, "regen_limiting", Format::u8, "bool", kGet},
    {Client::brushless_drive, 52, "regen_limit_adjust", Format::f32, "", kGet},
    {Client::brushless_drive, 53, "motoring_limiting", Format::u8, "bool", kGet},
    {Client::brushless_drive, 54, "motoring_limit_adjust", Format::f32, "", kGet},
    {Client::brushless_drive, 55, "regen_limit_kp", Format::f32, "", kGetSetSave},
    {Client::brushless_drive, 56, "regen_limit_ki", Format::f32, "", kGetSetSave},
    {Client::brushless_drive, 57, "regen_limit_max", Format::f32, "", kGetSetSave},
    {Client::brushless_drive, 58, "motoring_limit_kp", Format::f32, "", kGetSetSave},
    {Client::brushless_drive, 59, "motoring_limit_ki", Format::f32, "", kGetSetSave},
    {Client::brushless_drive, 60, "motoring_limit_max", Format::f32, "", kGetSetSave},
    {Client::brushless_drive, 61, "derate_low_pass_filter_fc", Format::u32, "Hz", kGetSetSave},
    {Client::brushless_drive, 62, "derate_low_pass_filter_fs", Format::u32, "Hz", kGetSetSave},
    {Client::brushless_drive, 63, "scaling_commutation_hz_ceiling", Format::u32, "Hz", kUnknown},
    // power_monitor
    {Client::power_monitor, 0, "volts", Format::f32, "V", kGet},
    {Client::power_monitor, 1, "amps", Format::f32, "A", kGet},
    {Client::power_monitor, 2, "watts", Format::f32, "W", kGet},
    {Client::power_monitor, 3, "joules", Format::f32, "J", kGet},
    {Client::power_monitor, 4, "reset_joules", Format::none, "", kSet},
    {Client::power_monitor, 5, "filter_fs", Format::u32, "Hz", kGet},
    {Client::power_monitor, 6, "filter_fc", Format::u32, "Hz", kGetSetSave, 1, 25000},
    {Client::power_monitor, 7, "volts_raw", Format::u16, "ADC ticks", kGet},
    {Client::power_monitor, 8, "amps_raw", Format::u16, "ADC ticks", kGet},
    {Client::power_monitor, 9, "volts_gain", Format::f32, "V/bit", kGetSetSave},
    {Client::power_monitor, 10, "amps_gain", Format::f32, "A/bit", kGetSetSave},
    {Client::power_monitor, 11, "amps_bias", Format::f32, "ADC ticks", kGetSetSave},
    {Client::power_monitor, 13, "volts_cascaded", Format::f32, "V", kGetSetSave},
    {Client::power_monitor, 14, "volts_cascaded_filter_fc", Format::u32, "Hz", kGetSetSave},
    // temperature_monitor_uc
    {Client::temperature_monitor_uc, 0, "uc_temp", Format::f32, "°C", kGet},
    {Client::temperature_monitor_uc, 1, "filter_fs", Format::u32, "Hz", kGet},
    {Client::temperature_monitor_uc, 2, "filter_fc", Format::u32, "Hz", kGetSetSave, 1, 25000},
    {Client::temperature_monitor_uc, 3, "otw", Format::f32, "°C", kGetSetSave},
    {Client::temperature_monitor_uc, 4, "otlo", Format::f32, "°C", kGetSetSave},
    {Client::temperature_monitor_uc, 5, "derate", Format::f32, "PU", kGet},
    // coil_temperature_estimator
    {Client::coil_temperature_estimator, 0, "t_coil", Format::f32, "°C", kGet},
    {Client::coil_temperature_estimator, 1, "t_alu", Format::f32, "°C", kGet},
    {Client::coil_temperature_estimator, 2, "t_amb", Format::f32, "°C", kGetSetSave},
    {Client::coil_temperature_estimator, 3, "h_coil_amb_free_conv", Format::f32, "W/°C", kGetSetSave},
    {Client::coil_temperature_estimator, 4, "h_coil_stator_cond", Format::f32, "W/°C", kGetSetSave},
    {Client::coil_temperature_estimator, 5, "h_coil_amb_forced_conv", Format::f32, "W/°C", kGet},
    {Client::coil_temperature_estimator, 6, "c_coil", Format::f32, "J/°C", kGetSetSave},
    {Client::coil_temperature_estimator, 7, "h_coil_amb_forced_conv_coeff", Format::f32, "W/(°C*sqrt(rad/s))",
     kGetSetSave, 0, 1},
    {Client::coil_temperature_estimator, 8, "otw", Format::f32, "°C", kGetSetSave},
    {Client::coil_temperature_estimator, 9, "otlo", Format::f32, "°C", kGetSetSave},
    {Client::coil_temperature_estimator, 10, "derate", Format::f32, "PU", kGet},
    {Client::coil_temperature_estimator, 11, "q_coil_joule", Format::f32, "W", kGet},
    {Client::coil_temperature_estimator, 12, "q_coil_amb_conv", Format::f32, "W", kGet},
    {Client::coil_temperature_estimator, 13, "q_coil_stator_cond", Format::f32, "W", kGet},
    {Client::coil_temperature_estimator, 14, "h_lam_alu", Format::f32, "W/(°C)", kGetSetSave},
    {Client::coil_temperature_estimator, 15, "c_lam", Format::f32, "J/°C", kGetSetSave},
    {Client::coil_temperature_estimator, 16, "k_lam_hist_coeff", Format::f32, "W/(rad/s)", kGetSetSave},
    {Client::coil_temperature_estimator, 17, "q_lam_hist", Format::f32, "W", kGetSetSave},
    {Client::coil_temperature_estimator, 18, "q_lam_alu", Format::f32, "W", kGetSetSave},
    {Client::coil_temperature_estimator, 19, "t_lam", Format::f32, "°C", kGetSetSave},
    // temperature_estimator: old firmware; only reading it is known to be right
    {Client::temperature_estimator, 0, "temp", Format::f32, "°C", kGet},
    {Client::temperature_estimator, 1, "otw", Format::f32, "°C", kGet},
    {Client::temperature_estimator, 2, "otlo", Format::f32, "°C", kGet},
    {Client::temperature_estimator, 3, "Rth", Format::f32, "", kGet},
    {Client::temperature_estimator, 4, "Cth", Format::f32, "", kGet},
    {Client::temperature_estimator, 5, "derate", Format::i32, "PU fix16", kGet},
    // power_safety
    {Client::power_safety, 0, "fault_now", Format::u8, "bit mask", kGet},
    {Client::power_safety, 1, "fault_ever", Format::u8, "bit mask", kGetSet},
    {Client::power_safety, 2, "fault_latching", Format::u8, "bool", kGetSetSave},
    {Client::power_safety, 3, "volt_input_low", Format::f32, "V", kGetSetSave},
    {Client::power_safety, 4, "volt_input_high", Format::f32, "V", kGetSetSave},
    {Client::power_safety, 5, "vref_int_low", Format::f32, "V", kGetSetSave},
    {Client::power_safety, 6, "vref_int_high", Format::f32, "V", kGetSetSave},
    {Client::power_safety, 7, "current_input_low", Format::f32, "A", kGetSetSave},
    {Client::power_safety, 8, "current_input_high", Format::f32, "A", kGetSetSave},
    {Client::power_safety, 9, "motor_current_low", Format::f32, "A", kGetSetSave},
    {Client::power_safety, 10, "motor_current_high", Format::f32, "A", kGetSetSave},
    {Client::power_safety, 11, "temperature_uc_low", Format::f32, "°C", kGetSetSave},
    {Client::power_safety, 12, "temperature_uc_high", Format::f32, "°C", kGetSetSave},
    {Client::power_safety, 13, "temperature_coil_low", Format::f32, "°C", kGetSetSave},
    {Client::power_safety, 14, "temperature_coil_high", Format::f32, "°C", kGetSetSave},
    // system_control
    {Client::system_control, 0, "reboot_program", Format::none, "", kSet},
    {Client::system_control, 1, "reboot_boot_loader", Format::none, "", kSet},
    {Client::system_control, 2, "dev_id", Format::u16, "ID", kGet},
    {Client::system_control, 3, "rev_id", Format::u16, "ID", kGet},
    {Client::system_control, 4, "uid1", Format::u32, "ID", kGet},
    {Client::system_control, 5, "uid2", Format::u32, "ID", kGet},
    {Client::system_control, 6, "uid3", Format::u32, "ID", kGet},
    {Client::system_control, 7, "mem_size", Format::u16, "Kb", kGet},
    {Client::system_control, 8, "build_year", Format::u16, "year", kGet},
    {Client::system_control, 9, "build_month", Format::u8, "month", kGet},
    {Client::system_control, 10, "build_day", Format::u8, "day", kGet},
    {Client::system_control, 11, "build_hour", Format::u8, "hour", kGet},
    {Client::system_control, 12, "build_minute", Format::u8, "min", kGet},
    {Client::system_control, 13, "build_second", Format::u8, "s", kGet},
    {Client::system_control, 14, "module_id", Format::u8, "ID", kGetSetSave, 0, 62},
    {Client::system_control, 15, "time", Format::f32, "s", kGetSet},
    {Client::system_control, 16, "firmware_version", Format::u32, "version", kGet},
    {Client::system_control, 17, "hardware_version", Format::u32, "version", kGetSetSave},
    {Client::system_control, 18, "electronics_version", Format::u32, "version", kGetSetSave},
    {Client::system_control, 19, "firmware_valid", Format::u8, "bool", kGet},
    {Client::system_control, 20, "applications_present", Format::u8, "enum", kGet},
    {Client::system_control, 21, "bootloader_version", Format::u32, "version", kGet},
    {Client::system_control, 22, "upgrade_version", Format::u32, "version", kGet},
    {Client::system_control, 23, "system_clock", Format::u32, "Hz", kGet},
    {Client::system_control, 24, "control_flags", Format::u32, "enum", kGet},
    {Client::system_control, 25, "pcb_version", Format::u32, "version", kGet},
    // serial_interface
    {Client::serial_interface, 0, "baud_rate", Format::u32, "bps", kGetSet},
    // persistent_memory
    {Client::persistent_memory, 0, "erase", Format::none, "", kSet},
    {Client::persistent_memory, 1, "revert_to_default", Format::none, "", kSet},
    {Client::persistent_memory, 2, "format_key_1", Format::u32, "key", kSet, 12345678, 12345678},
    {Client::persistent_memory, 3, "format_key_2", Format::u32, "key", kSet, 11223344, 11223344},
    // hobby_input
    {Client::hobby_input, 0, "allowed_protocols", Format::u8, "enum", kGetSetSave},
    {Client::hobby_input, 1, "protocol", Format::u8, "enum", kGetSet},
    {Client::hobby_input, 2, "calibrated_protocol", Format::u8, "enum", kGet},
    {Client::hobby_input, 3, "calibrated_high_ticks_us", Format::u32, "us", kGetSetSave},
    {Client::hobby_input, 4, "calibrated_low_ticks_us", Format::u32, "us", kGetSetSave},
    {Client::hobby_input, 5, "reset_calibration", Format::none, "", kSet},
    {Client::hobby_input, 6, "hobby_telemetry_frequency", Format::u16, "Hz", kGetSetSave},
    {Client::hobby_input, 7, "hobby_telemetry_speed_style", Format::u8, "enum", kGetSetSave},
    {Client::hobby_input, 8, "allow_dshot_disarming_message", Format::u8, "bool", kGetSetSave},
    // esc_propeller_input_parser
    {Client::esc_propeller_input_parser, 0, "mode", Format::u8, "enum", kGetSetSave},
    {Client::esc_propeller_input_parser, 1, "raw_value", Format::f32, "PU", kGetSet, 0, 1},
    {Client::esc_propeller_input_parser, 3, "sign", Format::u8, "enum", kGetSetSave},
    {Client::esc_propeller_input_parser, 4, "volts_max", Format::f32, "V", kGetSetSave, 0, 25.2},
    {Client::esc_propeller_input_parser, 5, "velocity_max", Format::f32, "rad/s", kGetSetSave, 0, 4200},
    {Client::esc_propeller_input_parser, 6, "thrust_max", Format::f32, "", kGetSetSave},
    {Client::esc_propeller_input_parser, 7, "safe_factor", Format::f32, "PU", kGetSetSave, 0, 1},
    {Client::esc_propeller_input_parser, 8, "flip_negative", Format::u8, "bool", kGetSetSave},
    {Client::esc_propeller_input_parser, 9, "zero_spin_throttle", Format::f32, "PU", kGetSetSave, -1, 1},
    {Client::esc_propeller_input_parser, 10, "zero_spin_tolerance", Format::f32, "PU", kGetSetSave, 0, 1},
    {Client::esc_propeller_input_parser, 11, "report_telemetry_as_speed", Format::u8, "bool", kGetSetSave},
    {Client::esc_propeller_input_parser, 12, "torque_max", Format::f32, "Nm", kUnknown},
    // arming_handler
    {Client::arming_handler, 1, "always_armed", Format::u8, "bool", kGetSetSave},
    {Client::arming_handler, 2, "arm_on_throttle", Format::u8, "bool", kGetSetSave},
    {Client::arming_handler, 3, "arm_throttle_upper_limit", Format::f32, "PU", kGetSetSave, -1, 1},
    {Client::arming_handler, 4, "arm_throttle_lower_limit", Format::f32, "PU", kGetSetSave, -1, 1},
    {Client::arming_handler, 5, "disarm_on_throttle", Format::u8, "bool", kGetSetSave},
    {Client::arming_handler, 6, "disarm_throttle_upper_limit", Format::f32, "PU", kGetSetSave, -1, 1},
    {Client::arming_handler, 7, "disarm_throttle_lower_limit", Format::f32, "PU", kGetSetSave, -1, 1},
    {Client::arming_handler, 8, "consecutive_arming_throttles_to_arm", Format::u32, "throttles", kGetSetSave, 1,
     100000},
    {Client::arming_handler, 9, "disarm_behavior", Format::u8, "enum", kGetSetSave},
    {Client::arming_handler, 10, "disarm_song_option", Format::u8, "enum", kGetSetSave},
    {Client::arming_handler, 11, "manual_arming_throttle_source", Format::u8, "enum", kGetSetSave},
    {Client::arming_handler, 12, "motor_armed", Format::u8, "bool", kGetSet},
    {Client::arming_handler, 13, "consecutive_disarming_throttles_to_disarm", Format::u32, "throttles", kGetSetSave},
    {Client::arming_handler, 14, "play_arming_song_on_arm", Format::u8, "bool", kGetSetSave},
    // stopping_handler
    {Client::stopping_handler, 0, "stopped_speed", Format::f32, "rad/s", kGetSetSave, 2, 1000},
    {Client::stopping_handler, 1, "stopped_time", Format::f32, "s", kGetSetSave, 0, 1000},
    // iquart_flight_controller_interface
    {Client::iquart_flight_controller_interface, 1, "telemetry", Format::bytes16, "", kGet},
    {Client::iquart_flight_controller_interface, 2, "throttle_cvi", Format::u8, "index", kGetSetSave},
    {Client::iquart_flight_controller_interface, 3, "x_cvi", Format::u8, "index", kGetSetSave},
    {Client::iquart_flight_controller_interface, 4, "y_cvi", Format::u8, "index", kGetSetSave},
    {Client::iquart_flight_controller_interface, 5, "servo_cvi", Format::u8, "index", kUnknown},
};

inline constexpr std::pair<Client, std::string_view> kClientNames[] = {
    {Client::system_control, "system_control"},
    {Client::persistent_memory, "persistent_memory"},
    {Client::serial_interface, "serial_interface"},
    {Client::brushless_drive, "brushless_drive"},
    {Client::propeller_motor_control, "propeller_motor_control"},
    {Client::esc_propeller_input_parser, "esc_propeller_input_parser"},
    {Client::power_monitor, "power_monitor"},
    {Client::temperature_monitor_uc, "temperature_monitor_uc"},
    {Client::hobby_input, "hobby_input"},
    {Client::temperature_estimator, "temperature_estimator"},
    {Client::coil_temperature_estimator, "coil_temperature_estimator"},
    {Client::power_safety, "power_safety"},
    {Client::arming_handler, "arming_handler"},
    {Client::stopping_handler, "stopping_handler"},
    {Client::iquart_flight_controller_interface, "iquart_flight_controller_interface"},
};

[[nodiscard]] constexpr std::string_view name_of(Client client) noexcept {
  for (const auto& [known, name] : kClientNames) {
    if (known == client) return name;
  }
  return "";
}

/// Null when there is no such entry.
[[nodiscard]] constexpr const Entry* find(std::uint8_t type, std::uint8_t sub) noexcept {
  for (const Entry& entry : kEntries) {
    if (static_cast<std::uint8_t>(entry.type) == type && entry.sub == sub) return &entry;
  }
  return nullptr;
}

/// `path`: "client.name", as in "propeller_motor_control.timeout". std::size(kEntries) when there is no such entry.
[[nodiscard]] constexpr std::size_t index_of(std::string_view path) noexcept {
  for (std::size_t i = 0; i < std::size(kEntries); ++i) {
    const std::string_view client = name_of(kEntries[i].type);
    if (path.size() == client.size() + 1 + kEntries[i].name.size() && path[client.size()] == '.' &&
        path.substr(0, client.size()) == client && path.substr(client.size() + 1) == kEntries[i].name) {
      return i;
    }
  }
  return std::size(kEntries);
}

/// Null when there is no such entry.
[[nodiscard]] constexpr const Entry* find(std::string_view path) noexcept {
  const std::size_t i = index_of(path);
  return i < std::size(kEntries) ? &kEntries[i] : nullptr;
}

/// A path as a template argument.
template <std::size_t N>
struct Path {
  char text[N]{};
  constexpr Path(const char (&literal)[N]) { std::copy_n(literal, N, text); }  // NOLINT: meant to convert
  [[nodiscard]] constexpr std::string_view view() const noexcept { return {text, N - 1}; }
};

template <Path path>
concept Known = (index_of(path.view()) < std::size(kEntries));
template <Path path>
concept Readable = (Known<path>)&&(kEntries[index_of(path.view())].allows(Access::get));
template <Path path>
concept Writable = (Known<path>)&&(kEntries[index_of(path.view())].allows(Access::set));

/// entry<"power_monitor.volts">: unknown names do not compile.
template <Path path>
requires Known<path>
inline constexpr const Entry& entry = kEntries[index_of(path.view())];

/// The packet of one access. Data goes with set and reply; a value is rounded to the format and held to its range.
/// Formats none and bytes16 carry no number.
[[nodiscard]] Packet make(const Entry& entry, Access access, int module_id, double value = 0);

/// The number in a set or a reply; NaN for none and bytes16. `data` must have size_of(format) bytes.
[[nodiscard]] double number(Format format, std::span<const std::uint8_t> data) noexcept;

template <Path path>
requires Readable<path>
[[nodiscard]] Packet get(int module_id) { return make(entry<path>, Access::get, module_id); }

template <Path path>
requires Writable<path>
[[nodiscard]] Packet set(int module_id, double value = 0) { return make(entry<path>, Access::set, module_id, value); }

/// Whether a program may set it in passing: a parameter that a restart brings back, or what an operator resets, the
/// clock and the memory of faults. Not so: what moves the motor, what the factory calibrated, the id, the baud rate, a
/// reboot, the memory.
[[nodiscard]] bool is_volatile_setting(const Entry& entry) noexcept;

/// Whether `read` is what a set of `wanted` leaves: the same bits on the wire. Nothing near it will do: velocity_ff2 is
/// near 5e-7.
[[nodiscard]] bool is_as_set(const Entry& entry, double wanted, double read) noexcept;

}  // namespace kphi::iq
