#include "drivers/iq/setting.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "test/drivers/iq/fake_dialogue.hpp"

namespace kphi::iq {
namespace {

using fake::FakeDialogue;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr const Entry& kFf2 = entry<"propeller_motor_control.velocity_ff2">;
constexpr const Entry& kTimeout = entry<"propeller_motor_control.timeout">;

TEST(SettingReadBack, ComparesBitsOrRelativelyNeverAbsolutely) {
  EXPECT_TRUE(is_as_set(kFf2, 5e-7, static_cast<float>(5e-7)));
  EXPECT_TRUE(is_as_set(kFf2, 5e-7, 5e-7 * (1 + 0.9e-6)));
  EXPECT_FALSE(is_as_set(kFf2, 5e-7, 5.1e-7)) << "2 % off, and only 1e-8 away";
  EXPECT_FALSE(is_as_set(kFf2, 5e-7, 0));
  EXPECT_FALSE(is_as_set(kFf2, 0, 1e-30));
  EXPECT_TRUE(is_as_set(kFf2, 0, -0.0));
  EXPECT_FALSE(is_as_set(kFf2, 5e-7, std::nan("")));
  EXPECT_TRUE(is_as_set(kTimeout, 0.5, 0.5));
  EXPECT_FALSE(is_as_set(entry<"hobby_input.allowed_protocols">, 254, 255));
}

TEST(SettingReadBack, FindsNothingWhenAllArrived) {
  FakeDialogue module;
  module.values[&kTimeout] = 10;
  EXPECT_THAT(set_and_read_back(module, connection_settings(0.25)), IsEmpty());
  EXPECT_EQ(module.values[&kTimeout], 0.25);
}

TEST(SettingReadBack, FindsWhatDidNotArrive) {
  FakeDialogue module;
  module.values[&kTimeout] = 10;
  module.ignores_sets = true;
  const auto findings = set_and_read_back(module, connection_settings(0.25));
  ASSERT_EQ(findings.size(), 1u);
  EXPECT_EQ(findings[0].severity, Severity::fault);
  EXPECT_THAT(findings[0].what, HasSubstr("timeout was set to 0.25 s and reads back 10"));
}

TEST(SettingReadBack, AcceptsOldFirmwareWhereTheEntryIsNotRequired) {
  FakeDialogue module;
  module.values.erase(&entry<"propeller_motor_control.timeout_behavior">);
  EXPECT_THAT(set_and_read_back(module, connection_settings(0.5)), IsEmpty());
  module.values.erase(&kTimeout);
  EXPECT_EQ(set_and_read_back(module, connection_settings(0.5)).size(), 1u);
}

TEST(Dialogue, CannotCommandMotionOrDamage) {
  FakeDialogue module;
  for (const Entry* forbidden : {&entry<"propeller_motor_control.ctrl_velocity">,
                                 &entry<"propeller_motor_control.ctrl_volts">,
                                 &entry<"propeller_motor_control.ctrl_pwm">,
                                 &entry<"propeller_motor_control.ctrl_thrust">,
                                 &entry<"propeller_motor_control.ctrl_torque">,
                                 &entry<"propeller_motor_control.ctrl_brake">,
                                 &entry<"brushless_drive.drive_phase_pwm">,
                                 &entry<"brushless_drive.drive_phase_volts">,
                                 &entry<"brushless_drive.drive_spin_pwm">,
                                 &entry<"brushless_drive.drive_spin_volts">,
                                 &entry<"brushless_drive.drive_volts_addition">,
                                 &entry<"brushless_drive.phase_angle">,
                                 &entry<"esc_propeller_input_parser.raw_value">,
                                 &entry<"arming_handler.motor_armed">,
                                 &entry<"system_control.reboot_program">,
                                 &entry<"system_control.reboot_boot_loader">,
                                 &entry<"system_control.module_id">,
                                 &entry<"persistent_memory.erase">,
                                 &entry<"persistent_memory.revert_to_default">,
                                 &entry<"persistent_memory.format_key_1">,
                                 &entry<"serial_interface.baud_rate">,
                                 &entry<"power_monitor.volts">}) {
    EXPECT_THROW(module.tell(*forbidden, 1), std::logic_error) << forbidden->name;
  }
  EXPECT_NO_THROW(module.tell(entry<"coil_temperature_estimator.t_amb">, 21));
}

}  // namespace
}  // namespace kphi::iq
