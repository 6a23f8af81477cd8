// Checks a module's parameters, read at connection, against the intended run. The values go into the run's header; the
// findings are listed worst first, each with a remedy. A fault: do not spin.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/finding.hpp"
#include "drivers/iq/service/dialogue.hpp"
#include "drivers/iq/wire/identity.hpp"

namespace kphi::iq {

/// The entries that are read, in this order. The first entry of a client is one that every firmware with this client
/// answers: without an answer the client counts as absent. temperature_estimator is read only if its successor is
/// absent.
inline constexpr const Entry* kAudited[] = {
    &entry<"system_control.uid1">,
    &entry<"system_control.uid2">,
    &entry<"system_control.uid3">,
    &entry<"system_control.firmware_version">,
    &entry<"system_control.hardware_version">,
    &entry<"system_control.electronics_version">,
    &entry<"system_control.time">,
    &entry<"brushless_drive.motor_pole_pairs">,
    &entry<"brushless_drive.motor_Kv">,
    &entry<"brushless_drive.motor_R_ohm">,
    &entry<"brushless_drive.motor_I_max">,
    &entry<"brushless_drive.motor_i_soft_start">,
    &entry<"brushless_drive.motor_i_soft_end">,
    &entry<"brushless_drive.motor_redline_start">,
    &entry<"brushless_drive.motor_redline_end">,
    &entry<"brushless_drive.v_max_start">,
    &entry<"brushless_drive.volts_limit">,
    &entry<"brushless_drive.derate">,
    &entry<"brushless_drive.slew_enable">,
    &entry<"brushless_drive.slew_volts_per_second">,
    &entry<"propeller_motor_control.timeout">,
    &entry<"propeller_motor_control.timeout_meaning">,
    &entry<"propeller_motor_control.timeout_behavior">,
    &entry<"propeller_motor_control.timeout_song_option">,
    &entry<"propeller_motor_control.velocity_Kp">,
    &entry<"propeller_motor_control.velocity_Ki">,
    &entry<"propeller_motor_control.velocity_Kd">,
    &entry<"propeller_motor_control.velocity_ff0">,
    &entry<"propeller_motor_control.velocity_ff1">,
    &entry<"propeller_motor_control.velocity_ff2">,
    &entry<"propeller_motor_control.input_filter_fc">,
    &entry<"power_monitor.volts">,
    &entry<"power_monitor.filter_fc">,
    &entry<"temperature_monitor_uc.uc_temp">,
    &entry<"temperature_monitor_uc.otw">,
    &entry<"temperature_monitor_uc.otlo">,
    &entry<"temperature_monitor_uc.derate">,
    &entry<"coil_temperature_estimator.t_coil">,
    &entry<"coil_temperature_estimator.t_amb">,
    &entry<"coil_temperature_estimator.h_coil_amb_forced_conv_coeff">,
    &entry<"coil_temperature_estimator.otw">,
    &entry<"coil_temperature_estimator.otlo">,
    &entry<"coil_temperature_estimator.derate">,
    &entry<"temperature_estimator.temp">,
    &entry<"temperature_estimator.otw">,
    &entry<"temperature_estimator.otlo">,
    &entry<"temperature_estimator.derate">,
    &entry<"power_safety.fault_now">,
    &entry<"power_safety.fault_ever">,
    &entry<"power_safety.fault_latching">,
    &entry<"power_safety.volt_input_low">,
    &entry<"power_safety.volt_input_high">,
    &entry<"power_safety.current_input_low">,
    &entry<"power_safety.current_input_high">,
    &entry<"power_safety.motor_current_low">,
    &entry<"power_safety.motor_current_high">,
    &entry<"power_safety.temperature_uc_low">,
    &entry<"power_safety.temperature_uc_high">,
    &entry<"power_safety.temperature_coil_low">,
    &entry<"power_safety.temperature_coil_high">,
    &entry<"hobby_input.allowed_protocols">,
    &entry<"hobby_input.protocol">,
    &entry<"arming_handler.motor_armed">,
    &entry<"arming_handler.disarm_behavior">,
    &entry<"stopping_handler.stopped_speed">,
    &entry<"stopping_handler.stopped_time">,
};
inline constexpr std::size_t kAuditedCount = std::size(kAudited);

/// kAuditedCount: not among them.
[[nodiscard]] constexpr std::size_t audited_index(const Entry& asked) noexcept {
  std::size_t i = 0;
  while (i < kAuditedCount && kAudited[i] != &asked) ++i;
  return i;
}

template <Path path>
concept Audited = Readable<path> &&(audited_index(entry<path>) < kAuditedCount);

/// The values that were read.
struct AuditRecord {
  std::array<std::optional<double>, kAuditedCount> values;  ///< as kAudited; nullopt: no answer, or not asked

  /// value<"brushless_drive.volts_limit">(): an entry outside kAudited does not compile.
  template <Path path>
  requires Audited<path>
  [[nodiscard]] const std::optional<double>& value() const noexcept { return values[audited_index(entry<path>)]; }

  [[nodiscard]] std::optional<FirmwareVersion> firmware() const noexcept;
  [[nodiscard]] std::optional<BoardVersion> hardware() const noexcept;
  [[nodiscard]] std::optional<BoardVersion> electronics() const noexcept;
  /// 24 hexadecimal digits; empty if unknown.
  [[nodiscard]] std::string uid() const;
  /// 83 or, with old firmware, 77; 0: no answer.
  [[nodiscard]] int coil_temperature_client() const noexcept;

  /// For the run's header: YAML, one line per known value ("brushless_drive.volts_limit: 27  # V"), starting with the
  /// decoded versions. Unknown values are left out.
  [[nodiscard]] std::string text() const;
  /// Reads text() back; other lines are skipped.
  [[nodiscard]] static AuditRecord of(std::string_view text);
};

/// Reads all entries; takes as long as the time-outs of the silent ones.
[[nodiscard]] AuditRecord read_audit(Dialogue& module);

/// The intended use. Zero or empty: unknown, not checked.
struct Intention {
  double supply_voltage_max_v = 0;  ///< largest supply voltage; the present voltage counts, too
  double timeout_max_s = 1;         ///< longest communication timeout that is accepted
  double speed_max_rad_s = 0;       ///< fastest step
  double coil_temperature_max_degc = 0;
  bool hobby_input_allowed = false;  ///< false: refuse a module whose hobby input may also command it
  bool clock_unchecked = false;      ///< the gain of the module's clock is unknown: add a note
  std::string uid;                   ///< of the expected module: seen before, or named by the clock gain
};

/// Worst first.
[[nodiscard]] std::vector<Finding> audit(const AuditRecord& module, const Intention& intention = {});

/// "motor current, coil temperature": the set bits of power_safety.fault_now or fault_ever.
[[nodiscard]] std::string fault_words(int bits);

}  // namespace kphi::iq
