// What the module does when told, and by itself: memory, reboots, arming, songs, safe mode.
#include <gtest/gtest.h>

#include "test/drivers/sim/iq_module.hpp"

namespace kphi::sim::actions_test {

using namespace std::chrono_literals;
using test::hex;
using Mode = MotorDrive::Mode;
using Action = test::ExactModule;

TEST_F(Action, ARebootKeepsWhatWasSavedAndLosesTheRest) {
  set_float(52, 7, 0.5f);
  send(52, 7, 2);  // save
  set_float(52, 8, 0.25f);
  set_float(52, 5, 100);
  send(5, 0, 1, "", 10s);
  EXPECT_EQ(device.boots(), 2u);
  EXPECT_EQ(send(52, 7, 0, "", 10s), "") << "it boots";
  EXPECT_FLOAT_EQ(number(52, 7, 11s), 0.5f);
  EXPECT_FLOAT_EQ(number(52, 8, 11s), 0.9f);
  EXPECT_EQ(device.drive().mode, Mode::coast);
  EXPECT_NEAR(number(5, 15, 11s), 0.85f, 1e-3f) << "uptime begins anew";
}

TEST_F(Action, ABrownOutLooksLikeAReboot) {
  set_float(52, 5, 100);
  state.supply_volts = 2;
  run(1s, 1s);
  state.supply_volts = 12;
  EXPECT_EQ(device.stage().mode, PowerStage::Mode::coast);
  run(1001ms, 1100ms);
  EXPECT_EQ(device.boots(), 2u);
  EXPECT_NEAR(number(5, 15, 2s), 0.95f, 1e-3f);
}

TEST_F(Action, PowerThatComesBackIsNoFaultThoughItsFiltersAreSlow) {
  settings.sensors.perfect = false;
  for (int phase = 0; phase < 7; ++phase) {
    restart();
    run(0s, 10ms);
    for (int i = 0; i < phase; ++i) device.advance(10ms);  // its limits are looked at every seven ticks
    state.supply_volts = 0;
    run(1s, 1200ms);
    state.supply_volts = 12;
    run(1201ms, 1500ms);
    EXPECT_EQ(get(84, 1, 1500ms), hex("00")) << phase;
    EXPECT_NEAR(number(69, 0, 1500ms), 12, 0.5);
  }
}

TEST_F(Action, PlainSavesOfTheBaudAndOfTheUnsaveableDoNothing) {
  send(16, 0, 2);
  send(50, 13, 2);
  EXPECT_EQ(get(16, 0), hex("00 c2 01 00"));
}

TEST_F(Action, ATimeoutMayMeanTheDisarmBehaviour) {
  send(52, 17, 1, "01");
  send(86, 9, 1, "01");  // 0 V, then coast
  set_float(52, 5, 100);
  state.speed = 100;
  run(0s, 600ms);
  EXPECT_EQ(device.drive().mode, Mode::volts);
}

TEST_F(Action, TheSongRipplesTheDriveOnceAndEnds) {
  set_float(52, 5, 100);  // the song option is 1 from the factory
  run(0s, 501ms);
  EXPECT_TRUE(device.singing());
  bool up = false, down = false;
  for (int i = 0; i < 700; ++i) {
    device.advance(501ms + i * 143us);
    up = up || device.stage().duty > 0.001;
    down = down || device.stage().duty < -0.001;
  }
  EXPECT_TRUE(up && down);
  run(600ms, 1200ms);
  EXPECT_FALSE(device.singing());
  EXPECT_EQ(device.stage().mode, PowerStage::Mode::coast);
}

TEST_F(Action, AnEndlessSongLastsUntilASpin) {
  send(52, 19, 1, "02");
  set_float(52, 5, 100);
  run(0s, 60s);
  tell("55 02 34 02 01 8E 06", 60s);  // coast
  run(60s, 61s);
  EXPECT_TRUE(device.singing());
  set_float(52, 5, 100, 61s);
  run(61s, 61400ms);
  EXPECT_FALSE(device.singing());
}

TEST_F(Action, ACrossedLimitCoastsAndLatches) {
  set_float(52, 5, 100);
  state.supply_volts = 31;
  run(0s, 10ms);
  EXPECT_EQ(device.stage().mode, PowerStage::Mode::coast);
  state.supply_volts = 12;
  run(10ms, 20ms);
  EXPECT_EQ(get(84, 0, 20ms), hex("00"));
  EXPECT_EQ(get(84, 1, 20ms), hex("02"));
  set_float(52, 5, 100, 20ms);
  run(20ms, 30ms);
  EXPECT_EQ(device.stage().mode, PowerStage::Mode::coast) << "latched";
  tell("55 03 54 01 01 00 15 44", 30ms);
  set_float(52, 5, 100, 30ms);
  run(30ms, 40ms);
  EXPECT_EQ(device.stage().mode, PowerStage::Mode::drive);
}

TEST_F(Action, EveryWatchedQuantityHasItsBit) {
  const MotorState good = state;
  for (const auto& [spoil, bit] : std::vector<std::pair<void (*)(MotorState&), std::string>>{
           {[](MotorState& s) { s.supply_volts = 4; }, "02"},
           {[](MotorState& s) { s.supply_volts = 3.4; }, "03"},
           {[](MotorState& s) { s.supply_amps = 50; }, "08"},
           {[](MotorState& s) { s.motor_amps = -70; }, "10"},
           {[](MotorState& s) { s.controller_celsius = 120; }, "20"},
           {[](MotorState& s) { s.coil_celsius = 170; }, "40"}}) {
    state = good;
    restart();
    spoil(state);
    run(0s, 2ms);
    EXPECT_EQ(get(84, 0, 2ms), hex(bit));
  }
}

TEST_F(Action, SingleFaultBitsCanBeCleared) {
  state.supply_amps = 50;
  state.coil_celsius = 170;
  run(0s, 2ms);
  state = MotorState{};
  run(2ms, 4ms);
  EXPECT_EQ(get(84, 1, 4ms), hex("48"));
  send(84, 1, 1, "40", 4ms);
  EXPECT_EQ(get(84, 1, 4ms), hex("40"));
}

TEST_F(Action, HeatDeratesAndTheProductIsReported) {
  state.controller_celsius = 105;  // half between 100 and 110
  state.coil_celsius = 145;        // half between 140 and 150
  set_float(52, 5, 100);
  run(0s, 2ms);
  EXPECT_EQ(get(50, 41, 2ms), hex("00 40 00 00")) << "a quarter of 65536";
  EXPECT_FLOAT_EQ(number(73, 5, 2ms), 0.5f);
  EXPECT_FLOAT_EQ(number(83, 10, 2ms), 0.5f);
}

TEST_F(Action, AnIdIsTakenAtOnceByAllClients) {
  send(5, 14, 1, "05");
  EXPECT_EQ(send(50, 13, 0), "");
  EXPECT_EQ(send(50, 13, 5 << 2).substr(0, 15), hex("55 06 32 0D 17"));
}

TEST_F(Action, QuestionsWaitTheirTurn) {
  settings.reply_latency = 2ms;
  restart();
  tell("55 02 05 0E 00 57 A1 55 02 54 00 00 A6 EB", 10ms);
  IqReply reply;
  EXPECT_FALSE(device.next_reply(reply, 11ms));
  ASSERT_TRUE(device.next_reply(reply, 12ms));
  EXPECT_EQ(reply.sub, 14);
  EXPECT_FALSE(device.next_reply(reply, 13ms));
  ASSERT_TRUE(device.next_reply(reply, 14ms));
  EXPECT_EQ(reply.asked, 12ms) << "the second is read when the first is answered";
}

}  // namespace kphi::sim::actions_test
