// The two firmwares, and what the documents of the module leave open.
#include <gtest/gtest.h>

#include "test/drivers/sim/iq_module.hpp"

namespace kphi::sim::quirks_test {

using namespace std::chrono_literals;
using test::hex;
using Mode = MotorDrive::Mode;
using Quirk = test::ExactModule;

TEST_F(Quirk, GetsAndCommandsRestartTheTimeoutFramesToOthersDoNot) {
  set_float(52, 5, 100);
  for (Instant at{0}; at <= 2s; at += 100ms) {
    get(50, 13, at);
    device.advance(at);
  }
  for (Instant at = 2s; at <= 4s; at += 100ms) {
    set_float(52, 5, 100, at);
    device.advance(at);
  }
  EXPECT_EQ(device.timeouts(), 0u);
  for (Instant at = 4s; at <= 6s; at += 100ms) {
    send(50, 13, 5 << 2, "", at);
    device.advance(at);
  }
  EXPECT_EQ(device.timeouts(), 1u);
}

TEST_F(Quirk, TheTimeoutIsHalfASecondOrWhatSomebodySaved) {
  EXPECT_EQ(get(52, 15), hex("00 00 00 3f"));
  settings.timeout_s = 0.25;
  restart();
  EXPECT_EQ(get(52, 15), hex("00 00 80 3e"));
}

TEST_F(Quirk, TheSongFollowsItsOptionOrPlaysForEver) {
  for (const bool legacy : {false, true}) {
    settings.quirks = legacy ? kLegacyFirmware : IqQuirks{};
    restart();
    send(52, 19, 1, "00");  // no song; not an entry of the old firmware
    set_float(52, 5, 100);
    run(0s, 3s);
    EXPECT_EQ(device.timeouts(), 1u);
    EXPECT_EQ(device.singing(), legacy);
    EXPECT_EQ(get(50, 0), legacy ? hex("01") : hex("05"));
  }
}

TEST_F(Quirk, TheClocksErrorReachesVelocityTimeAndBaud) {
  settings.oscillator_gain = 0.005;
  state.speed = 1005;
  restart();
  EXPECT_EQ(get(50, 13, 1000s), hex("00 00 7a 44")) << "a fast clock makes a speed read less";
  EXPECT_EQ(get(5, 15, 1000s), hex("00 40 7b 44"));
  EXPECT_NEAR(device.line_rate(), 115776, 1e-6);
}

TEST_F(Quirk, TheCoilIsEstimatedByClient83Or77) {
  EXPECT_NE(get(83, 0), "");
  EXPECT_EQ(get(77, 0), "");
  settings.quirks = kLegacyFirmware;
  restart();
  EXPECT_EQ(get(83, 0), "");
  EXPECT_NE(get(77, 0), "");
  EXPECT_EQ(get(77, 5), hex("00 00 01 00")) << "not derated";
  EXPECT_EQ(get(52, 19), "") << "no option for the song";
}

TEST_F(Quirk, SystemControlAnswersOnTheModulesIdOrOnZeroOnly) {
  settings.module_id = 5;
  restart();
  EXPECT_EQ(send(5, 14, 5 << 2), hex("55 03 05 0E 17 05 9F C4").substr(0, 18) + send(5, 14, 5 << 2).substr(18));
  EXPECT_EQ(send(5, 14, 0), "");
  settings.quirks.system_control_on_id_zero = true;
  restart();
  EXPECT_EQ(send(5, 14, 5 << 2), "");
  EXPECT_EQ(get(5, 14), hex("05")) << "its true id";
  EXPECT_NE(send(50, 13, 5 << 2), "") << "the other clients have the id";
}

TEST_F(Quirk, AVelocityBeyondItsRangeIsStored) {
  set_float(52, 5, 5000);
  EXPECT_EQ(device.drive().mode, Mode::velocity);
  EXPECT_EQ(device.drive().target, 5000);
}

TEST_F(Quirk, TheReceiveBufferHoldsSixtyFourBytes) {
  // The module is busy with the first question while the others come.
  settings.reply_latency = 1ms;
  restart();
  std::vector<std::uint8_t> burst;
  for (int i = 0; i < 20; ++i) append_iq_frame(burst, 50, 13, 0, {});
  device.receive(burst, Instant{0});
  int heard = 0;
  IqReply reply;
  for (Instant at{0}; at < 1s; at += 1ms) heard += device.next_reply(reply, at) ? 1 : 0;
  EXPECT_EQ(heard, 10) << "the first, and nine whole questions of 63 bytes";
}

TEST_F(Quirk, SafeModeReadsCoastAndEndsWithoutLatching) {
  send(84, 2, 1, "00");  // not latching
  set_float(52, 5, 100);
  state.supply_volts = 31;
  run(0s, 10ms);
  EXPECT_EQ(device.stage().mode, PowerStage::Mode::coast);
  EXPECT_EQ(get(50, 0), hex("05"));
  state.supply_volts = 12;
  run(10ms, 20ms);
  EXPECT_EQ(device.stage().mode, PowerStage::Mode::drive);
}

}  // namespace kphi::sim::quirks_test
