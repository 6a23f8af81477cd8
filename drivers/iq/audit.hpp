// A module's parameters, read at connection, against what is to be done with it. What was read goes into the run's
// header; what is wrong is told worst first, with the remedy. A fault: do not spin.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/finding.hpp"
#include "drivers/iq/dialogue.hpp"
#include "drivers/iq/version.hpp"

namespace kphi::iq {

/// What is asked, in this order. The first entry of a client is one that every firmware with this client answers: when
/// it stays silent, the client is taken as absent. temperature_estimator is only asked where its successor is absent.
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

/// kAuditedCount when it is not asked.
[[nodiscard]] constexpr std::size_t audited_index(const Entry& asked) noexcept {
  std::size_t i = 0;
  while (i < kAuditedCount && kAudited[i] != &asked) ++i;
  return i;
}

template <Path path>
concept Audited = Readable<path> &&(audited_index(entry<path>) < kAuditedCount);

/// What the module told.
struct AuditRecord {
  std::array<std::optional<double>, kAuditedCount> values;  ///< as kAudited; nothing: no answer, or not asked

  /// value<"brushless_drive.volts_limit">(): what is not audited does not compile.
  template <Path path>
  requires Audited<path>
  [[nodiscard]] const std::optional<double>& value() const noexcept { return values[audited_index(entry<path>)]; }

  [[nodiscard]] std::optional<FirmwareVersion> firmware() const noexcept;
  [[nodiscard]] std::optional<BoardVersion> hardware() const noexcept;
  [[nodiscard]] std::optional<BoardVersion> electronics() const noexcept;
  /// 24 hexadecimal digits; empty when it was not told.
  [[nodiscard]] std::string uid() const;
  /// 83 or, with old firmware, 77; 0: none answers.
  [[nodiscard]] int coil_temperature_client() const noexcept;

  /// For the run's header: YAML, a line for each value that was told ("brushless_drive.volts_limit: 27  # V"),
  /// beginning with the decoded versions. What was not told is not in it.
  [[nodiscard]] std::string text() const;
  /// text() read again; lines that are none of these are passed over.
  [[nodiscard]] static AuditRecord of(std::string_view text);
};

/// Asks for everything; takes as long as the silent entries' time-outs.
[[nodiscard]] AuditRecord read_audit(Dialogue& module);

/// What the module is to do. Zero or empty: not known, not audited.
struct Intention {
  double supply_voltage_max_v = 0;  ///< the most the supply may give; the voltage it gives now counts, too
  double timeout_max_s = 1;         ///< longest communication timeout that is accepted
  double speed_max_rad_s = 0;       ///< fastest step
  double coil_temperature_max_degc = 0;
  bool hobby_input_allowed = false;  ///< false: refuse a module whose hobby input may also command it
  bool clock_unchecked = false;      ///< no gain of the module's clock is known: note it
  std::string uid;                   ///< of the module expected: one seen before, or the clock gain's
};

/// Worst first.
[[nodiscard]] std::vector<Finding> audit(const AuditRecord& module, const Intention& intention = {});

/// "motor current, coil temperature": the set bits of power_safety.fault_now or fault_ever.
[[nodiscard]] std::string fault_words(int bits);

}  // namespace kphi::iq
