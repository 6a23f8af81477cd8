#include "drivers/iq/service/dialogue.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "base/error.hpp"
#include "drivers/iq/service/audit.hpp"
#include "test/drivers/iq/fake_dialogue.hpp"
#include "test/drivers/iq/module_on_a_line.hpp"
#include "test/refusal.hpp"

namespace kphi::iq {
namespace {

using fake::FakeDialogue;
using fake::Module;
using fake::ModuleOnALine;
using testing::HasSubstr;
using testing::IsEmpty;

const SteadyClock kClock;

std::string refusal(const std::string& device, int module_id = 0) {
  return kphi::refusal([&] { SerialDialogue dialogue({device, 115200, module_id}, kClock); });
}

TEST(SerialDialogue, CoastsBeforeItAsksAnythingElse) {
  ModuleOnALine line;
  line.with([](Module& m) { m.values[{50, 0}] = fake::u8(3); });  // left spinning by a program that died
  SerialDialogue dialogue({line.device(), 115200, 0}, kClock);
  line.with([](Module& m) {
    ASSERT_GE(m.heard.size(), 2u);
    EXPECT_TRUE(m.heard[0].is_coast());
    EXPECT_EQ(m.values[(fake::Key{50, 0})], fake::u8(5));
  });
}

TEST(SerialDialogue, LeavesTheMotorCoasting) {
  ModuleOnALine line;
  {
    SerialDialogue dialogue({line.device(), 115200, 0}, kClock);
    line.with([](Module& m) { m.heard.clear(); });
  }
  EXPECT_TRUE(line.left_coasting()) << "told again at the end";
}

template <Path path>
std::optional<double> ask(Dialogue& dialogue) {
  return dialogue.inquire({&entry<path>, std::nullopt}).value;
}

TEST(SerialDialogue, CarriesQuestionsAndSettings) {
  ModuleOnALine line;
  SerialDialogue dialogue({line.device(), 115200, 0}, kClock);
  EXPECT_EQ(ask<"power_monitor.volts">(dialogue), 12.5);
  EXPECT_EQ(ask<"brushless_drive.motor_pole_pairs">(dialogue), 7);
  EXPECT_FALSE(ask<"temperature_estimator.temp">(dialogue)) << "silent in this firmware";
  EXPECT_THAT(set_and_read_back(dialogue, connection_settings(0.5)), IsEmpty());
  EXPECT_EQ(dialogue.counters().timeouts, 3u);
  EXPECT_GT(dialogue.median_round_trip(), Duration(0));
}

TEST(SerialDialogue, StampsAnAnswerBetweenQuestionAndReply) {
  ModuleOnALine line;
  SerialDialogue dialogue({line.device(), 2000000, 0}, kClock);
  const Instant before = kClock.now();
  const Reply reply = dialogue.inquire({&entry<"power_monitor.volts">, std::nullopt});
  const Instant after = kClock.now();
  ASSERT_TRUE(reply.value);
  EXPECT_GE(reply.time - reply.uncertainty, before - Duration(1));
  EXPECT_LE(reply.time + reply.uncertainty, after + Duration(1));
}

TEST(SerialDialogue, ReadsAWholeAudit) {
  ModuleOnALine line;
  line.with([](Module& m) {
    for (const Entry& entry : kEntries) {
      if (entry.audited)
        m.values.insert({{static_cast<int>(entry.type), entry.sub}, fake::Bytes(size_of(entry.format))});
    }
  });
  SerialDialogue dialogue({line.device(), 115200, 0}, kClock);
  const AuditRecord record = read_audit(dialogue);
  EXPECT_EQ(dialogue.counters().timeouts, 0u);
  EXPECT_EQ(record.uid(), "111111112222222233333333");
  EXPECT_EQ(record.firmware()->text(), "speed 0.0.32");
  EXPECT_EQ(record.coil_temperature_client(), 83);
}

TEST(SerialDialogue, SaysWhyNobodyAnswers) {
  ModuleOnALine mute;
  mute.with([](Module& m) { m.mute = true; });
  EXPECT_THAT(refusal(mute.device()), HasSubstr("nothing was received"));
  ModuleOnALine stubborn;
  stubborn.with([](Module& m) {
    m.values[{50, 0}] = fake::u8(3);
    m.id = 0;
    m.silent.insert({52, 2});
    m.ignore_sets = true;
  });
  EXPECT_THAT(refusal(stubborn.device()), HasSubstr("coast not confirmed: the drive mode last read 3"));
  EXPECT_TRUE(stubborn.left_coasting()) << "the last thing it heard is a coast";
}

TEST(SerialDialogue, NoticesThatTheLineIsGone) {
  ModuleOnALine line;
  SerialDialogue dialogue({line.device(), 115200, 0}, kClock);
  line.unplug();
  EXPECT_THROW((void)ask<"power_monitor.volts">(dialogue), DeviceError);
}

TEST(SerialDialogue, IgnoresAReplyThatComesTooLate) {
  ModuleOnALine line;
  SerialDialogue dialogue({line.device(), 115200, 0}, kClock);
  line.with([](Module& m) { m.silent.insert({69, 0}); });
  EXPECT_FALSE(ask<"power_monitor.volts">(dialogue));
  line.with([](Module& m) { m.silent.erase({69, 0}); });
  EXPECT_EQ(ask<"power_monitor.amps">(dialogue), 3.25);
  EXPECT_EQ(ask<"power_monitor.volts">(dialogue), 12.5);
}

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
    EXPECT_THROW(Inquiries::check({{forbidden, 1.0}}), std::invalid_argument) << forbidden->path;
  }
  EXPECT_NO_THROW(Inquiries::check({{&entry<"coil_temperature_estimator.t_amb">, 21.0}}));
}

}  // namespace
}  // namespace kphi::iq
