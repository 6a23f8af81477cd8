// What is asked and told at connection, in order, after the coast is confirmed.
#pragma once

#include "drivers/iq/entries.hpp"
#include "drivers/iq/identity.hpp"

namespace kphi::iq {

struct Step {
  enum class Kind {
    own_id,       ///< must be the id that is being spoken to; old firmware answers on id 0 only, or not at all
    required,     ///< no answer: the connection fails
    last_of_uid,  ///< as required; afterwards another module than before is refused, before it is told anything
    optional,     ///< no answer: an older firmware, go on
    legacy_coil,  ///< only asked when the newer client did not answer
    set_timeout,  ///< set to Settings::module_timeout_s, then read back; required
    set_zero,     ///< set to 0, then read back; firmware without the entry stays silent and is accepted
  };
  const Entry* entry;
  Kind kind;
  void (*store)(Identity&, double);

  [[nodiscard]] constexpr bool sets() const noexcept { return kind == Kind::set_timeout || kind == Kind::set_zero; }
  [[nodiscard]] constexpr bool must_answer() const noexcept {
    return kind == Kind::required || kind == Kind::last_of_uid || kind == Kind::set_timeout;
  }
};

inline constexpr Step kScript[] = {
    {&entry<"system_control.module_id">, Step::Kind::own_id, [](Identity&, double) {}},
    {&entry<"system_control.uid1">, Step::Kind::required,
     [](Identity& i, double v) { i.uid1 = static_cast<std::uint32_t>(v); }},
    {&entry<"system_control.uid2">, Step::Kind::required,
     [](Identity& i, double v) { i.uid2 = static_cast<std::uint32_t>(v); }},
    {&entry<"system_control.uid3">, Step::Kind::last_of_uid,
     [](Identity& i, double v) { i.uid3 = static_cast<std::uint32_t>(v); }},
    // Before anything is set: a restart from here on is noticed by the first poll.
    {&entry<"system_control.time">, Step::Kind::optional, [](Identity& i, double v) { i.uptime_s = v; }},
    {&entry<"propeller_motor_control.timeout">, Step::Kind::set_timeout,
     [](Identity& i, double v) { i.timeout_s = v; }},
    {&entry<"propeller_motor_control.timeout_behavior">, Step::Kind::set_zero,
     [](Identity& i, double) { i.timeout_behavior_set = true; }},
    {&entry<"propeller_motor_control.timeout_song_option">, Step::Kind::set_zero, [](Identity&, double) {}},
    {&entry<"system_control.firmware_version">, Step::Kind::required,
     [](Identity& i, double v) { i.firmware = static_cast<std::uint32_t>(v); }},
    {&entry<"system_control.hardware_version">, Step::Kind::required,
     [](Identity& i, double v) { i.hardware = static_cast<std::uint32_t>(v); }},
    {&entry<"system_control.electronics_version">, Step::Kind::required,
     [](Identity& i, double v) { i.electronics = static_cast<std::uint32_t>(v); }},
    {&entry<"brushless_drive.motor_pole_pairs">, Step::Kind::optional,
     [](Identity& i, double v) { i.pole_pairs = static_cast<int>(v); }},
    {&entry<"brushless_drive.motor_Kv">, Step::Kind::optional,
     [](Identity& i, double v) { i.motor_kv_rpm_per_volt = v; }},
    {&entry<"power_safety.fault_now">, Step::Kind::optional,
     [](Identity& i, double v) { i.fault_now = static_cast<int>(v); }},
    {&entry<"power_safety.fault_ever">, Step::Kind::optional,
     [](Identity& i, double v) { i.fault_ever = static_cast<int>(v); }},
    {&entry<"coil_temperature_estimator.t_coil">, Step::Kind::optional,
     [](Identity& i, double) { i.coil_temperature_client = 83; }},
    {&entry<"temperature_estimator.temp">, Step::Kind::legacy_coil,
     [](Identity& i, double) { i.coil_temperature_client = 77; }},
};

}  // namespace kphi::iq
