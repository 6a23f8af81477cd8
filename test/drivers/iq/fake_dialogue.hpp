// A module that answers from a table, with a clock of its own and a line with delays; time stands still until asked.
#pragma once

#include <cmath>
#include <functional>
#include <map>
#include <vector>

#include "drivers/iq/session/connecting.hpp"

namespace kphi::iq::fake {

/// A 2306 as it should be, at rest on a supply of 12 V.
inline std::map<const Entry*, double> good_values() {
  return {
      {&entry<"system_control.uid1">, 0x00230006},
      {&entry<"system_control.uid2">, 0x4d4b5011},
      {&entry<"system_control.uid3">, 0x20343353},
      {&entry<"system_control.firmware_version">, 0x00100020},
      {&entry<"system_control.hardware_version">, 0x00010100},
      {&entry<"system_control.electronics_version">, 0x00030000},
      {&entry<"brushless_drive.drive_mode">, 5},
      {&entry<"brushless_drive.obs_velocity">, 0},
      {&entry<"brushless_drive.motor_pole_pairs">, 7},
      {&entry<"brushless_drive.motor_Kv">, 2200},
      {&entry<"brushless_drive.motor_R_ohm">, 0.038},
      {&entry<"brushless_drive.motor_I_max">, 30},
      {&entry<"brushless_drive.motor_redline_start">, 3400},
      {&entry<"brushless_drive.motor_redline_end">, 3500},
      {&entry<"brushless_drive.v_max_start">, 26},
      {&entry<"brushless_drive.volts_limit">, 27},
      {&entry<"brushless_drive.derate">, 65536},
      {&entry<"brushless_drive.slew_enable">, 0},
      {&entry<"brushless_drive.slew_volts_per_second">, 500},
      {&entry<"propeller_motor_control.timeout">, 0.5},
      {&entry<"propeller_motor_control.timeout_meaning">, 0},
      {&entry<"propeller_motor_control.timeout_behavior">, 0},
      {&entry<"propeller_motor_control.timeout_song_option">, 0},
      {&entry<"propeller_motor_control.velocity_Kp">, 0.02},
      {&entry<"propeller_motor_control.velocity_Ki">, 0.9},
      {&entry<"propeller_motor_control.velocity_Kd">, 0},
      {&entry<"propeller_motor_control.velocity_ff0">, 0},
      {&entry<"propeller_motor_control.velocity_ff1">, 0.0043},
      {&entry<"propeller_motor_control.velocity_ff2">, 3.2e-7},
      {&entry<"propeller_motor_control.input_filter_fc">, 100},
      {&entry<"power_monitor.volts">, 12},
      {&entry<"temperature_monitor_uc.uc_temp">, 30},
      {&entry<"temperature_monitor_uc.derate">, 1},
      {&entry<"coil_temperature_estimator.t_coil">, 25},
      {&entry<"coil_temperature_estimator.otw">, 140},
      {&entry<"coil_temperature_estimator.otlo">, 150},
      {&entry<"coil_temperature_estimator.derate">, 1},
      {&entry<"power_safety.fault_now">, 0},
      {&entry<"power_safety.fault_ever">, 0},
      {&entry<"power_safety.fault_latching">, 1},
      {&entry<"power_safety.volt_input_low">, 5},
      {&entry<"power_safety.volt_input_high">, 30},
      {&entry<"hobby_input.allowed_protocols">, 254},
      {&entry<"arming_handler.motor_armed">, 0},
      {&entry<"arming_handler.disarm_behavior">, 0},
  };
}

class FakeDialogue {
 public:
  std::map<const Entry*, double> values = good_values();
  std::vector<const Entry*> asked;
  bool ignores_sets = false;

  ManualClock clock{std::chrono::hours(5)};
  double gain = 1;         ///< of the module's clock
  double offset_s = 1000;  ///< module time = gain · bench time + offset, as a float32
  double tick_s = 0;       ///< the module's time moves in such steps
  std::function<Duration()> way = [] { return Duration(std::chrono::microseconds(300)); };  ///< there, or back

  Ask ask() {
    return [this](const std::vector<Inquiry>& inquiries) {
      std::vector<Reply> replies;
      for (const Inquiry& inquiry : inquiries) replies.push_back(reply_to(inquiry));
      return replies;
    };
  }
  std::function<void(Duration)> pause() {
    return [this](Duration bench) { clock.advance(bench); };
  }

 private:
  static constexpr const Entry& kTime = entry<"system_control.time">;

  Reply reply_to(const Inquiry& inquiry) {
    Inquiries::check({inquiry});
    const Entry& entry = *inquiry.entry;
    if (inquiry.set_to && !ignores_sets) set(entry, *inquiry.set_to);
    asked.push_back(&entry);
    const Instant sent = clock.now();
    clock.advance(way());
    Reply reply;
    if (&entry == &kTime) {
      reply.value = module_time();
    } else if (const auto found = values.find(&entry); found != values.end()) {
      reply.value = on_the_wire(entry, found->second);
    }
    clock.advance(way());
    reply.accepted = inquiry.set_to && reply.value && is_as_set(entry, *inquiry.set_to, *reply.value);
    reply.time = sent + (clock.now() - sent) / 2;
    reply.uncertainty = (clock.now() - sent + Duration(1)) / 2;
    return reply;
  }
  static double on_the_wire(const Entry& entry, double value) {
    return entry.format == Format::f32 ? static_cast<double>(static_cast<float>(value)) : value;
  }
  [[nodiscard]] double module_time() const {
    const double exact = gain * to_seconds(clock.now()) + offset_s;
    return static_cast<float>(tick_s > 0 ? tick_s * std::floor(exact / tick_s) : exact);
  }
  void set(const Entry& entry, double value) {
    if (&entry == &kTime) {
      offset_s = value - gain * to_seconds(clock.now());
    } else if (values.count(&entry) != 0) {
      values[&entry] = value;
    }
  }
};

}  // namespace kphi::iq::fake
