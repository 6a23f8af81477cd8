// The entries of the speed firmware that kphi uses, in one table: type, sub, path, format, unit, access.
// Formats and units follow the vendor's client files (its C++ headers and documents disagree in places: fault_now is
// one byte, ctrl_mode signed). A path that is not in the table does not compile.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "drivers/iq/wire/packet.hpp"

namespace kphi::iq {

/// How an entry's data is laid out; little-endian.
enum class Format : std::uint8_t { none, i8, u8, u16, u32, i32, f32 };

/// Bytes of data in a set or a reply.
[[nodiscard]] constexpr std::size_t size_of(Format format) noexcept {
  constexpr std::array<std::size_t, 7> sizes{0, 1, 1, 2, 4, 4, 4};
  return sizes[static_cast<std::size_t>(format)];
}

/// One bit per Access.
inline constexpr std::uint8_t kGet = 1, kSet = 2, kGetSet = 3, kGetSetSave = 7;

/// Read by every audit (service/audit.hpp).
inline constexpr bool kAudit = true;

/// Fastest speed that the vendor's control program commands, rad/s.
inline constexpr double kFastest = 3450;

struct Entry {
  Client type;
  std::uint8_t sub;
  std::string_view path;  ///< "client.name", as in "propeller_motor_control.timeout"
  Format format;
  std::string_view unit;
  std::uint8_t permitted;
  bool audited = false;

  /// "timeout"
  [[nodiscard]] constexpr std::string_view name() const noexcept { return path.substr(path.find('.') + 1); }
  /// A reply is permitted where a get is.
  [[nodiscard]] constexpr bool allows(Access access) const noexcept {
    const int bit = access == Access::reply ? 0 : static_cast<int>(access);
    return (permitted >> bit & 1) != 0;
  }
};

/// Audits read and print them in this order. The first entry of a client is one that every firmware with this client
/// answers.
inline constexpr auto kEntries = [] {
  using enum Client;
  using enum Format;
  return std::to_array<Entry>({
      {system_control, 4, "system_control.uid1", u32, "ID", kGet, kAudit},
      {system_control, 5, "system_control.uid2", u32, "ID", kGet, kAudit},
      {system_control, 6, "system_control.uid3", u32, "ID", kGet, kAudit},
      {system_control, 16, "system_control.firmware_version", u32, "version", kGet, kAudit},
      {system_control, 17, "system_control.hardware_version", u32, "version", kGetSetSave, kAudit},
      {system_control, 18, "system_control.electronics_version", u32, "version", kGetSetSave, kAudit},
      {system_control, 15, "system_control.time", f32, "s", kGetSet, kAudit},
      {system_control, 14, "system_control.module_id", u8, "ID", kGetSetSave},
      {brushless_drive, 14, "brushless_drive.motor_pole_pairs", u16, "PP", kGetSetSave, kAudit},
      {brushless_drive, 32, "brushless_drive.motor_Kv", f32, "RPM/V", kGetSetSave, kAudit},
      {brushless_drive, 33, "brushless_drive.motor_R_ohm", f32, "ohm", kGetSetSave, kAudit},
      {brushless_drive, 34, "brushless_drive.motor_I_max", f32, "A", kGetSetSave, kAudit},
      {brushless_drive, 42, "brushless_drive.motor_i_soft_start", f32, "A", kGetSetSave, kAudit},
      {brushless_drive, 43, "brushless_drive.motor_i_soft_end", f32, "A", kGetSetSave, kAudit},
      {brushless_drive, 38, "brushless_drive.motor_redline_start", f32, "rad/s", kGetSetSave, kAudit},
      {brushless_drive, 39, "brushless_drive.motor_redline_end", f32, "rad/s", kGetSetSave, kAudit},
      {brushless_drive, 29, "brushless_drive.v_max_start", f32, "V", kGetSetSave, kAudit},
      {brushless_drive, 35, "brushless_drive.volts_limit", f32, "V", kGetSetSave, kAudit},
      {brushless_drive, 41, "brushless_drive.derate", i32, "PU fix16", kGet, kAudit},
      {brushless_drive, 47, "brushless_drive.slew_enable", u8, "bool", kGetSetSave, kAudit},
      {brushless_drive, 46, "brushless_drive.slew_volts_per_second", f32, "V/s", kGetSetSave, kAudit},
      {brushless_drive, 0, "brushless_drive.drive_mode", u8, "enum", kGet},
      {brushless_drive, 8, "brushless_drive.drive_pwm", f32, "PU", kGet},
      {brushless_drive, 9, "brushless_drive.drive_volts", f32, "V", kGet},
      {brushless_drive, 11, "brushless_drive.obs_supply_volts", f32, "V", kGet},
      {brushless_drive, 12, "brushless_drive.obs_angle", f32, "rad", kGet},
      {brushless_drive, 13, "brushless_drive.obs_velocity", f32, "rad/s", kGet},
      {brushless_drive, 36, "brushless_drive.est_motor_amps", f32, "A", kGet},
      {propeller_motor_control, 15, "propeller_motor_control.timeout", f32, "s", kGetSetSave, kAudit},
      {propeller_motor_control, 17, "propeller_motor_control.timeout_meaning", u8, "enum", kGetSetSave, kAudit},
      {propeller_motor_control, 18, "propeller_motor_control.timeout_behavior", u8, "enum", kGetSetSave, kAudit},
      {propeller_motor_control, 19, "propeller_motor_control.timeout_song_option", u8, "enum", kGetSetSave, kAudit},
      {propeller_motor_control, 7, "propeller_motor_control.velocity_Kp", f32, "V/(rad/s)", kGetSetSave, kAudit},
      {propeller_motor_control, 8, "propeller_motor_control.velocity_Ki", f32, "V/(rad)", kGetSetSave, kAudit},
      {propeller_motor_control, 9, "propeller_motor_control.velocity_Kd", f32, "V/(rad/s^2)", kGetSetSave, kAudit},
      {propeller_motor_control, 10, "propeller_motor_control.velocity_ff0", f32, "V", kGetSetSave, kAudit},
      {propeller_motor_control, 11, "propeller_motor_control.velocity_ff1", f32, "V/(rad/s)", kGetSetSave, kAudit},
      {propeller_motor_control, 12, "propeller_motor_control.velocity_ff2", f32, "V/(rad/s)^2", kGetSetSave, kAudit},
      {propeller_motor_control, 16, "propeller_motor_control.input_filter_fc", u32, "Hz", kGetSetSave, kAudit},
      {propeller_motor_control, 0, "propeller_motor_control.ctrl_mode", i8, "enum", kGet},
      {propeller_motor_control, 2, "propeller_motor_control.ctrl_coast", none, "", kSet},
      {propeller_motor_control, 5, "propeller_motor_control.ctrl_velocity", f32, "rad/s", kGetSet},
      {power_monitor, 0, "power_monitor.volts", f32, "V", kGet, kAudit},
      {power_monitor, 6, "power_monitor.filter_fc", u32, "Hz", kGetSetSave, kAudit},
      {power_monitor, 1, "power_monitor.amps", f32, "A", kGet},
      {power_monitor, 2, "power_monitor.watts", f32, "W", kGet},
      {power_monitor, 3, "power_monitor.joules", f32, "J", kGet},
      {temperature_monitor_uc, 0, "temperature_monitor_uc.uc_temp", f32, "°C", kGet, kAudit},
      {temperature_monitor_uc, 3, "temperature_monitor_uc.otw", f32, "°C", kGetSetSave, kAudit},
      {temperature_monitor_uc, 4, "temperature_monitor_uc.otlo", f32, "°C", kGetSetSave, kAudit},
      {temperature_monitor_uc, 5, "temperature_monitor_uc.derate", f32, "PU", kGet, kAudit},
      {coil_temperature_estimator, 0, "coil_temperature_estimator.t_coil", f32, "°C", kGet, kAudit},
      {coil_temperature_estimator, 2, "coil_temperature_estimator.t_amb", f32, "°C", kGetSetSave, kAudit},
      {coil_temperature_estimator, 7, "coil_temperature_estimator.h_coil_amb_forced_conv_coeff", f32,
       "W/(°C*sqrt(rad/s))", kGetSetSave, kAudit},
      {coil_temperature_estimator, 8, "coil_temperature_estimator.otw", f32, "°C", kGetSetSave, kAudit},
      {coil_temperature_estimator, 9, "coil_temperature_estimator.otlo", f32, "°C", kGetSetSave, kAudit},
      {coil_temperature_estimator, 10, "coil_temperature_estimator.derate", f32, "PU", kGet, kAudit},
      // old firmware; only reading it is known to be right
      {temperature_estimator, 0, "temperature_estimator.temp", f32, "°C", kGet, kAudit},
      {temperature_estimator, 1, "temperature_estimator.otw", f32, "°C", kGet, kAudit},
      {temperature_estimator, 2, "temperature_estimator.otlo", f32, "°C", kGet, kAudit},
      {temperature_estimator, 5, "temperature_estimator.derate", i32, "PU fix16", kGet, kAudit},
      {power_safety, 0, "power_safety.fault_now", u8, "bit mask", kGet, kAudit},
      {power_safety, 1, "power_safety.fault_ever", u8, "bit mask", kGetSet, kAudit},
      {power_safety, 2, "power_safety.fault_latching", u8, "bool", kGetSetSave, kAudit},
      {power_safety, 3, "power_safety.volt_input_low", f32, "V", kGetSetSave, kAudit},
      {power_safety, 4, "power_safety.volt_input_high", f32, "V", kGetSetSave, kAudit},
      {power_safety, 7, "power_safety.current_input_low", f32, "A", kGetSetSave, kAudit},
      {power_safety, 8, "power_safety.current_input_high", f32, "A", kGetSetSave, kAudit},
      {power_safety, 9, "power_safety.motor_current_low", f32, "A", kGetSetSave, kAudit},
      {power_safety, 10, "power_safety.motor_current_high", f32, "A", kGetSetSave, kAudit},
      {power_safety, 11, "power_safety.temperature_uc_low", f32, "°C", kGetSetSave, kAudit},
      {power_safety, 12, "power_safety.temperature_uc_high", f32, "°C", kGetSetSave, kAudit},
      {power_safety, 13, "power_safety.temperature_coil_low", f32, "°C", kGetSetSave, kAudit},
      {power_safety, 14, "power_safety.temperature_coil_high", f32, "°C", kGetSetSave, kAudit},
      {hobby_input, 0, "hobby_input.allowed_protocols", u8, "enum", kGetSetSave, kAudit},
      {hobby_input, 1, "hobby_input.protocol", u8, "enum", kGetSet, kAudit},
      {arming_handler, 12, "arming_handler.motor_armed", u8, "bool", kGetSet, kAudit},
      {arming_handler, 9, "arming_handler.disarm_behavior", u8, "enum", kGetSetSave, kAudit},
      {stopping_handler, 0, "stopping_handler.stopped_speed", f32, "rad/s", kGetSetSave, kAudit},
      {stopping_handler, 1, "stopping_handler.stopped_time", f32, "s", kGetSetSave, kAudit},
  });
}();

/// Index in kEntries; kEntries.size() for an unknown path.
[[nodiscard]] constexpr std::size_t index_of(std::string_view path) noexcept {
  return static_cast<std::size_t>(std::ranges::find(kEntries, path, &Entry::path) - kEntries.begin());
}
/// Null when there is no such entry.
[[nodiscard]] constexpr const Entry* find(std::string_view path) noexcept {
  const std::size_t index = index_of(path);
  return index == kEntries.size() ? nullptr : &kEntries[index];
}

/// A path as a template argument.
template <std::size_t N>
struct Path {
  char text[N]{};
  constexpr Path(const char (&literal)[N]) { std::copy_n(literal, N, text); }  // NOLINT: meant to convert
  [[nodiscard]] constexpr std::string_view view() const noexcept { return {text, N - 1}; }
};

template <Path path>
concept Known = (index_of(path.view()) < kEntries.size());

/// entry<"power_monitor.volts">: unknown names do not compile.
template <Path path>
requires Known<path>
inline constexpr const Entry& entry = kEntries[index_of(path.view())];

/// The packet of one access. Data goes with set and reply; a value is rounded to the format and held to its range.
/// Format none carries no number.
[[nodiscard]] Packet make(const Entry& entry, Access access, int module_id, double value = 0);

/// The number in a set or a reply; NaN for none. `data` must have size_of(format) bytes.
[[nodiscard]] double number(Format format, std::span<const std::uint8_t> data) noexcept;

/// Whether a program may set it in passing: a parameter that a restart brings back, or what an operator resets, the
/// clock and the memory of faults. Not so: what moves the motor, what the factory calibrated, the id, the baud rate, a
/// reboot, the memory.
[[nodiscard]] bool is_volatile_setting(const Entry& entry) noexcept;

/// Whether `read` is what a set of `wanted` leaves: the same bits on the wire. Nothing near it will do: velocity_ff2 is
/// near 5e-7.
[[nodiscard]] bool is_as_set(const Entry& entry, double wanted, double read) noexcept;

}  // namespace kphi::iq
