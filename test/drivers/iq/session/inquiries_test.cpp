#include "drivers/iq/session/inquiries.hpp"

#include <gtest/gtest.h>

#include <stdexcept>

#include "test/drivers/iq/wire.hpp"

namespace kphi::iq {
namespace {

using namespace std::chrono_literals;
using fake::State;
using fake::Wire;

TEST(Inquiries, AreAnsweredBetweenThePolls) {
  Wire wire;
  wire.connect();
  wire.session.inquire({{find("brushless_drive.motor_Kv"), {}},
                        {find("power_monitor.volts"), {}},
                        {find("coil_temperature_estimator.otw"), {}},
                        {find("propeller_motor_control.timeout"), 0.25}},
                       wire.now);
  EXPECT_THROW(wire.session.inquire({}, wire.now), std::logic_error) << "one after the other";
  wire.flush();
  wire.run_for(5s);
  ASSERT_TRUE(wire.session.inquiries().done());
  const auto replies = wire.session.inquiries().replies();
  EXPECT_EQ(replies[0].value, 2200.0);
  EXPECT_EQ(replies[1].value, 12.5);
  EXPECT_EQ(replies[2].value, std::nullopt) << "this module has no such entry";
  EXPECT_EQ(replies[3].value, 0.25);
  EXPECT_TRUE(replies[3].accepted);
  EXPECT_EQ(wire.session.state(), State::ready);
}

TEST(Inquiries, TellWhenASettingIsNotTakenBitByBit) {
  Wire wire;
  wire.module.values[{52, 12}] = fake::f32(4.0e-7);
  wire.module.read_only = {{52, 12}};
  wire.connect();
  wire.session.inquire({{find("propeller_motor_control.velocity_ff2"), 5.0e-7}}, wire.now);
  wire.flush();
  wire.run_for(1s);
  EXPECT_FALSE(wire.session.inquiries().replies().at(0).accepted);
}

TEST(Inquiries, NeverMoveSaveEraseOrRename) {
  Wire wire;
  wire.connect();
  for (const char* path :
       {"propeller_motor_control.ctrl_velocity", "propeller_motor_control.ctrl_pwm",
        "propeller_motor_control.ctrl_volts", "brushless_drive.phase_angle", "brushless_drive.drive_volts_addition",
        "brushless_drive.calibration_angle", "system_control.module_id", "serial_interface.baud_rate",
        "esc_propeller_input_parser.raw_value", "arming_handler.motor_armed"}) {
    const Entry* entry = find(path);
    if (entry == nullptr || !entry->allows(Access::get)) continue;
    EXPECT_FALSE(is_volatile_setting(*entry)) << path;
    EXPECT_THROW(wire.session.inquire({{entry, 1.0}}, wire.now), std::invalid_argument) << path;
  }
  for (const Entry& entry : kEntries) {
    const bool moves = entry.name.substr(0, 5) == "ctrl_" || entry.type == Client::persistent_memory;
    EXPECT_FALSE(moves && is_volatile_setting(entry)) << entry.name;
  }
  EXPECT_THROW(wire.session.inquire({{find("propeller_motor_control.ctrl_coast"), {}}}, wire.now),
               std::invalid_argument);
}

constexpr const Entry& kTimeout = entry<"propeller_motor_control.timeout">;

TEST(OpenInquiry, IsOverWithTheFirstAnswerToAQuestion) {
  OpenInquiry open({&kTimeout, {}});
  EXPECT_FALSE(open.done());
  open.take(std::nullopt);
  EXPECT_FALSE(open.done());
  open.take(0.7);
  EXPECT_TRUE(open.done());
  EXPECT_EQ(open.reply().value, 0.7);
  EXPECT_FALSE(open.reply().accepted) << "nothing was set";
}

TEST(OpenInquiry, IsPutThreeTimesToAModuleThatStaysSilent) {
  OpenInquiry open({&kTimeout, 0.5});
  for (int i = 0; i < OpenInquiry::kAttempts; ++i) {
    EXPECT_FALSE(open.done());
    open.take(std::nullopt);
  }
  EXPECT_TRUE(open.done());
  EXPECT_EQ(open.reply().value, std::nullopt);
}

TEST(OpenInquiry, SetsUntilItReadsBackBitByBit) {
  OpenInquiry open({&kTimeout, 0.5});
  open.take(std::nextafterf(0.5f, 1.0f));
  EXPECT_FALSE(open.done());
  open.take(0.5);
  EXPECT_TRUE(open.done());
  EXPECT_TRUE(open.reply().accepted);
}

TEST(OpenInquiry, RemembersWhatAModuleInsistsOn) {
  OpenInquiry open({&kTimeout, 0.5}, 2);
  open.take(10.0);
  open.take(std::nullopt);
  EXPECT_TRUE(open.done());
  EXPECT_EQ(open.reply().value, 10.0);
  EXPECT_FALSE(open.reply().accepted);
}

TEST(OpenInquiry, CanBeGivenUp) {
  OpenInquiry open({&kTimeout, 0.5});
  open.give_up();
  EXPECT_TRUE(open.done());
}

}  // namespace
}  // namespace kphi::iq
