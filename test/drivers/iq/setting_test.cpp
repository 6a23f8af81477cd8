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

constexpr const Entry& kTimeout = entry<"propeller_motor_control.timeout">;

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
