#include "drivers/iq/session/connecting.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <optional>
#include <stdexcept>

#include "test/drivers/iq/wire.hpp"

namespace kphi::iq {
namespace connecting_test {

using namespace std::chrono_literals;
using fake::Bytes;
using fake::Connected;
using fake::State;
using fake::Wire;

TEST(Connecting, CoastsBeforeAnythingElse) {
  Connected wire;
  ASSERT_FALSE(wire.module.heard.empty());
  EXPECT_TRUE(wire.module.heard[0].is_coast());
  EXPECT_EQ(fake::hex(std::span(wire.batches[0].second).first(7)), "55 02 34 02 01 8E 06");
}

TEST(Connecting, ReadsWhoTheModuleIs) {
  Connected wire;
  const AuditRecord& identity = wire.session.identity();
  EXPECT_EQ(identity.value<"brushless_drive.motor_pole_pairs">(), 7);
  EXPECT_EQ(identity.value<"brushless_drive.motor_Kv">(), 2200);
  EXPECT_EQ(identity.summary(),
            "firmware speed 0.0.32, hardware type 1.1 batch 0, electronics type 3.0 batch 0, uid "
            "111111112222222233333333, timeout 0.5 s, coil temperature from client 83");
}

TEST(Connecting, MakesTheModuleCoastByItselfWithoutASong) {
  Connected wire;
  EXPECT_EQ(fake::to_f32(wire.module.values.at({52, 15})), 0.5f);
  EXPECT_EQ(wire.module.values.at({52, 18}), fake::u8(0));
  EXPECT_EQ(wire.module.values.at({52, 19}), fake::u8(0));
  EXPECT_EQ(wire.module.count([](const auto& m) { return m.access == 2; }), 0u) << "nothing is ever saved";
}

TEST(Connecting, FailsWhenTheTimeoutIsNotAccepted) {
  for (const int sub : {15, 18, 19}) {
    Wire wire;
    wire.module.read_only = {{52, sub}};
    wire.session.connect(wire.now);
    wire.expect_failure("the motor would keep turning if this computer stopped", 3s);
    EXPECT_TRUE(wire.module.last_motion()->is_coast());
  }
}

TEST(Connecting, ComparesTheTimeoutBitByBit) {
  Wire wire;
  wire.module.read_only = {{52, 15}};
  wire.module.values[{52, 15}] = fake::f32(std::nextafter(0.5f, 1.0f));
  wire.session.connect(wire.now);
  EXPECT_TRUE(wire.run_to_state(State::failed, 3s));
}

TEST(Connecting, RepeatsASetThatWasLost) {
  Wire wire;
  wire.module.ignore_sets = true;
  wire.session.connect(wire.now);
  const auto sets = [&] {
    return wire.module.count([](const auto& m) { return m.type == 52 && m.sub == 15 && m.access == 1; });
  };
  while (sets() == 0) wire.run_for(1ms);
  wire.module.ignore_sets = false;
  EXPECT_TRUE(wire.run_to_state(State::ready, 1s)) << wire.session.failure();
  EXPECT_GE(sets(), 2u);
}

TEST(Connecting, AcceptsOldFirmwareWithoutTimeoutBehaviour) {
  Wire wire;
  wire.module.silent = {{77, 0}, {52, 18}, {52, 19}};
  wire.connect(10s);
  EXPECT_NE(wire.session.identity().summary().find("old firmware: plays its song"), std::string::npos);
}

TEST(Connecting, TakesTheCoilTemperatureOfOldFirmware) {
  Wire wire;
  wire.module.silent = {{83, 0}};
  wire.connect(3s);
  EXPECT_EQ(wire.session.identity().coil_temperature_client(), 77);
  wire.readings();
  wire.run_for(1s);
  const auto temperatures = wire.values(MotorChannel::coil_temperature);
  ASSERT_FALSE(temperatures.empty());
  EXPECT_EQ(temperatures[0], 44.5);
}

TEST(Connecting, GoesOnWithoutACoilTemperature) {
  Wire wire;
  wire.module.silent = {{83, 0}, {77, 0}};
  wire.connect(3s);
  wire.run_for(1s);
  EXPECT_TRUE(wire.values(MotorChannel::coil_temperature).empty());
  EXPECT_EQ(wire.session.state(), State::ready);
}

TEST(Connecting, FailsWithinASecondOrTwoAndSaysWhy) {
  const auto fails = [](const std::string& words, Duration limit, const std::function<void(Wire&)>& spoil) {
    Wire wire;
    spoil(wire);
    wire.session.connect(wire.now);
    EXPECT_TRUE(wire.run_to_state(State::failed, limit)) << words;
    EXPECT_EQ(wire.session.failure(), words);
    return wire.session.counters();
  };
  fails("nothing was received", 1s, [](Wire& wire) { wire.module.mute = true; });
  fails("bytes were received, but no valid packet", 1s, [](Wire& wire) {
    wire.spoil = [](Bytes& reply, Duration&) { reply = {0x00, 0xE6, 0x55, 0x80}; };
  });
  const Counters counters = fails("only modules with another id answer", 1s, [](Wire& wire) {
    wire.spoil = [](Bytes& reply, Duration&) { reply = fake::message(50, 0, 3, 5, fake::u8(5)); };
  });
  EXPECT_GT(counters.wrong_module, 0u);
  fails("coast not confirmed: the drive mode last read 3", 2s, [](Wire& wire) {
    wire.module.ignore_sets = true;
    wire.module.values[{50, 0}] = fake::u8(3);
  });
}

TEST(Reconnecting, SendsNothingOfBefore) {
  Connected wire;
  wire.session.spin_at(RadPerSec(700), wire.now);
  wire.session.sent(3);  // the rest has not left when the plug is pulled
  wire.session.fail(EventKind::motor_port_lost, "unplugged", wire.now);
  wire.session.connect_anew(wire.now + 1s);
  wire.now += 1s;
  EXPECT_EQ(fake::hex(wire.session.output().first(7)), "55 02 34 02 01 8E 06") << "a whole coast, not half a speed";
  wire.flush();
  ASSERT_TRUE(wire.run_to_state(State::ready, 1s));
  EXPECT_EQ(wire.module.count([](const auto& m) { return m.is_speed(); }), 0u);
}

TEST(Reconnecting, RefusesAnotherModuleBeforeTellingItAnythingButCoast) {
  Connected wire;
  wire.session.fail(EventKind::motor_port_lost, "unplugged", wire.now);
  wire.module.heard.clear();
  wire.module.values[{5, 6}] = fake::u32(0x99999999);
  wire.session.connect_anew(wire.now);
  wire.flush();
  wire.expect_failure("another module answers, uid 111111112222222299999999");
  EXPECT_EQ(wire.session.take_events().back().kind, EventKind::motor_another_module);
  EXPECT_EQ(wire.module.count([](const auto& m) { return m.access == 1 && !m.is_coast(); }), 0u);
}

TEST(OldFirmware, AnswersForItsSystemOnIdZero) {
  Settings settings;
  settings.module_id = 7;
  Wire wire(settings);
  wire.module.id = 7;
  wire.module.values[{5, 14}] = fake::u8(7);
  wire.module.old_system_control = true;
  wire.connect(3s);
  EXPECT_EQ(wire.session.identity().uid(), "111111112222222233333333");
  wire.run_for(1s);
  EXPECT_EQ(wire.session.counters().wrong_module, 0u);
  wire.module.restart();
  EXPECT_TRUE(wire.run_to_state(State::failed, 400ms)) << "its uptime is read there too";
}

TEST(OldFirmware, IsNotTakenForModuleZeroWhenItsOtherClientsHaveAnotherId) {
  Wire wire;
  wire.module.values[{5, 14}] = fake::u8(7);
  wire.session.connect(wire.now);
  wire.expect_failure("set module_id to 7");
}

TEST(Inquiries, AreAnsweredBetweenThePolls) {
  Connected wire;
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
  Connected wire;
  for (const char* path : {"propeller_motor_control.ctrl_velocity", "brushless_drive.motor_pole_pairs",
                           "system_control.module_id", "arming_handler.motor_armed", "power_monitor.volts"}) {
    const Entry* entry = find(path);
    EXPECT_FALSE(is_volatile_setting(*entry)) << path;
    EXPECT_THROW(wire.session.inquire({{entry, 1.0}}, wire.now), std::invalid_argument) << path;
  }
  for (const Entry& entry : kEntries)
    EXPECT_FALSE(entry.name().starts_with("ctrl_") && is_volatile_setting(entry)) << entry.path;
  EXPECT_THROW(wire.session.inquire({{find("propeller_motor_control.ctrl_coast"), {}}}, wire.now),
               std::invalid_argument);
}

constexpr const Entry& kTimeout = entry<"propeller_motor_control.timeout">;

/// Takes each answer and is over with the last of them.
Reply reply_after(OpenInquiry open, const std::vector<std::optional<double>>& answers) {
  for (const std::optional<double>& answer : answers) {
    EXPECT_FALSE(open.done());
    open.take(answer);
  }
  EXPECT_TRUE(open.done());
  return open.reply();
}

TEST(OpenInquiry, IsOverWithTheFirstAnswerToAQuestion) {
  const Reply reply = reply_after(OpenInquiry({&kTimeout, {}}), {std::nullopt, 0.7});
  EXPECT_EQ(reply.value, 0.7);
  EXPECT_FALSE(reply.accepted) << "nothing was set";
}

TEST(OpenInquiry, IsPutThreeTimesToAModuleThatStaysSilent) {
  const std::vector<std::optional<double>> silence(OpenInquiry::kAttempts);
  EXPECT_EQ(reply_after(OpenInquiry({&kTimeout, 0.5}), silence).value, std::nullopt);
}

TEST(OpenInquiry, SetsUntilItReadsBackBitByBit) {
  EXPECT_TRUE(reply_after(OpenInquiry({&kTimeout, 0.5}), {std::nextafterf(0.5f, 1.0f), 0.5}).accepted);
}

TEST(OpenInquiry, RemembersWhatAModuleInsistsOn) {
  const Reply reply = reply_after(OpenInquiry({&kTimeout, 0.5}, 2), {10.0, std::nullopt});
  EXPECT_EQ(reply.value, 10.0);
  EXPECT_FALSE(reply.accepted);
}

TEST(OpenInquiry, CanBeGivenUp) {
  OpenInquiry open({&kTimeout, 0.5});
  open.give_up();
  EXPECT_TRUE(open.done());
}

}  // namespace connecting_test
}  // namespace kphi::iq
