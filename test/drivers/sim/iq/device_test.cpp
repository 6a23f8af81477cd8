#include "drivers/sim/iq/device.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <limits>

#include "test/drivers/sim/iq_module.hpp"

namespace kphi::sim::device_test {

using namespace std::chrono_literals;
using namespace test;
using Mode = MotorDrive::Mode;

using Module = test::ExactModule;

TEST_F(Module, AnswersWhoItIsByteForByte) {
  EXPECT_EQ(tell("55 02 05 10 00 2B 81"), hex("55 06 05 10 03 20 00 10 00 39 08"));  // speed 0.0.32
  EXPECT_EQ(tell("55 02 05 0E 00 57 A1"), hex("55 03 05 0E 03 00 C9 0D"));           // module id 0
  EXPECT_EQ(tell("55 02 32 0E 00 62 E1"), hex("55 04 32 0E 03 07 00 41 22"));        // 7 pole pairs
  EXPECT_EQ(tell("55 02 10 00 00 CB 2A"), hex("55 06 10 00 03 00 C2 01 00 FA 13"));  // 115200 baud
  EXPECT_EQ(tell("55 02 54 00 00 A6 EB"), hex("55 03 54 00 03 00 47 15"));           // no fault
  EXPECT_EQ(tell("55 02 32 29 00 13 7E"), hex("55 06 32 29 03 00 00 01 00 92 28"));  // no derating
  EXPECT_EQ(tell("55 02 32 00 00 6D C2"), hex("55 03 32 00 03 05 A9 3B"));           // coasting
}

TEST_F(Module, ReportsThePhysics) {
  state.speed = 100;
  state.supply_volts = 12;
  state.supply_amps = 3.25;
  state.motor_amps = 10;
  state.controller_celsius = 36.5;
  state.coil_celsius = 55.25;
  EXPECT_EQ(tell("55 02 32 0D 00 31 B4"), hex("55 06 32 0D 03 00 00 C8 42 71 DF"));
  EXPECT_EQ(tell("55 02 45 00 00 F5 9F"), hex("55 06 45 00 03 00 00 40 41 45 AE"));
  EXPECT_EQ(tell("55 02 45 01 00 C4 AC"), hex("55 06 45 01 03 00 00 50 40 B7 F8"));
  EXPECT_EQ(tell("55 02 32 24 00 4F 08"), hex("55 06 32 24 03 00 00 20 41 E3 0B"));
  EXPECT_EQ(tell("55 02 49 00 00 94 EA"), hex("55 06 49 00 03 00 00 12 42 90 A4"));
  EXPECT_EQ(tell("55 02 53 00 00 36 6E"), hex("55 06 53 00 03 00 00 5D 42 57 7D"));
}

TEST_F(Module, AnswersGetsInOrderAndSetsNever) {
  EXPECT_EQ(tell("55 06 34 05 01 00 00 C8 42 95 37  55 02 34 02 01 8E 06"), "");
  EXPECT_EQ(tell("55 02 05 0E 00 57 A1 55 02 54 00 00 A6 EB"), hex("55 03 05 0E 03 00 C9 0D 55 03 54 00 03 00 47 15"));
}

TEST_F(Module, ObeysVelocityVoltsPwmBrakeAndCoast) {
  EXPECT_EQ(device.drive().mode, Mode::coast);
  tell("55 06 34 05 01 00 00 48 C1 E6 8D");
  EXPECT_EQ(device.drive().mode, Mode::velocity);
  EXPECT_EQ(device.drive().target, -12.5);
  EXPECT_EQ(tell("55 02 34 00 00 CD 70"), hex("55 03 34 00 03 04 11 0C")) << "ctrl_mode velocity";
  tell("55 06 34 04 01 00 00 40 40 46 C0");
  EXPECT_EQ(device.drive().mode, Mode::volts);
  EXPECT_EQ(device.drive().target, 3);
  tell("55 06 34 03 01 00 00 80 3E 0A 81");
  EXPECT_EQ(device.drive().mode, Mode::pwm);
  EXPECT_EQ(device.drive().target, 0.25);
  tell("55 02 34 01 01 DD 53");
  EXPECT_EQ(device.drive().mode, Mode::brake);
  tell("55 02 34 02 01 8E 06");
  EXPECT_EQ(device.drive().mode, Mode::coast);
}

TEST_F(Module, BroadcastSetsActAndBroadcastGetsAreSilent) {
  tell("55 06 34 05 01 00 00 C8 42 95 37");
  EXPECT_EQ(tell("55 02 34 02 FD 1D 28"), "");
  EXPECT_EQ(device.drive().mode, Mode::coast);
  EXPECT_EQ(tell("55 02 05 0E FC C4 8F"), "");
}

TEST_F(Module, IsSilentForOtherIdsUnknownEntriesRepliesAndWrongLengths) {
  EXPECT_EQ(tell("55 02 34 05 14 8D DD"), "") << "id 5";
  tell("55 06 34 05 15 00 00 C8 42 C9 BA");
  EXPECT_EQ(device.drive().mode, Mode::coast) << "id 5";
  std::vector<std::uint8_t> frames;
  append_iq_frame(frames, 52, 6, 0, {});                       // ctrl_thrust: not in this firmware
  append_iq_frame(frames, 99, 0, 0, {});                       // no such client
  append_iq_frame(frames, 52, 2, 0, {});                       // get of a set-only entry
  append_iq_frame(frames, 50, 13, 3, bytes("00 00 c8 42"));    // a reply is not for a module
  append_iq_frame(frames, 52, 5, 1, bytes("00 00 c8"));        // one byte short
  append_iq_frame(frames, 52, 5, 1, bytes("00 00 c8 42 00"));  // one too many
  append_iq_frame(frames, 50, 13, 1, bytes("00 00 c8 42"));    // set of a get-only entry
  append_iq_frame(frames, 52, 15, 2, {});                      // save
  device.receive(frames, Instant{0});
  EXPECT_TRUE(device.output().empty());
  EXPECT_EQ(device.drive().mode, Mode::coast);
}

TEST_F(Module, KeepsWhatItWasTold) {
  tell("55 06 34 0F 01 00 00 C0 3F 04 97");  // timeout 1.5 s
  EXPECT_EQ(tell("55 02 34 0F 00 F3 60").substr(15, 12), "00 00 c0 3f ");
  set_float(52, 12, 5e-7f);
  EXPECT_FLOAT_EQ(static_cast<float>(device.drive().ff2), 5e-7f);
}

TEST_F(Module, CarriesANanUnchangedButDoesNotSpinByIt) {
  set_float(52, 5, 100);
  std::vector<std::uint8_t> frame;
  append_iq_frame(frame, 52, 5, 1, bytes("01 00 c0 7f"));
  device.receive(frame, Instant{0});
  EXPECT_EQ(tell("55 02 34 05 00 38 8F").substr(15, 12), "01 00 c0 7f ");
  EXPECT_EQ(device.drive().mode, Mode::coast);
  set_float(52, 7, std::numeric_limits<float>::infinity());
  EXPECT_EQ(device.drive().kp, 0);
}

TEST_F(Module, TimesOutToCoastWithoutMessages) {
  set_float(52, 15, 0.25f);
  set_float(52, 5, 100);
  device.advance(249ms);
  EXPECT_EQ(device.drive().mode, Mode::velocity);
  device.advance(250ms);
  EXPECT_EQ(device.drive().mode, Mode::coast);
  EXPECT_EQ(device.timeouts(), 1u);
}

TEST_F(Module, AnyValidFrameForItRestartsTheTimeout) {
  set_float(52, 15, 0.25f);
  set_float(52, 5, 100);
  tell("55 02 32 0D 00 31 B4", 200ms);
  device.advance(449ms);
  EXPECT_EQ(device.drive().mode, Mode::velocity);
  tell("55 02 34 05 14 8D DD", 440ms);  // id 5
  tell("55 02 32 0D 00 31 B5", 440ms);  // wrong CRC
  device.advance(450ms);
  EXPECT_EQ(device.drive().mode, Mode::coast);
}

TEST_F(Module, DoesNotTimeOutInCoastOrBrake) {
  device.advance(1h);
  tell("55 02 34 01 01 DD 53", 1h);
  device.advance(2h);
  EXPECT_EQ(device.drive().mode, Mode::brake);
  EXPECT_EQ(device.timeouts(), 0u);
}

TEST_F(Module, TimeoutThroughZeroVoltsEndsInCoastOrBrake) {
  send(52, 19, 1, "00");
  for (const auto& [behavior, last] : {std::pair{"01", Mode::coast}, {"02", Mode::brake}}) {
    send(52, 18, 1, behavior);
    state.speed = 100;
    set_float(52, 5, 100);
    device.advance(500ms);
    EXPECT_EQ(device.drive().mode, Mode::volts);
    EXPECT_EQ(device.drive().target, 0);
    state.speed = 4;
    device.advance(501ms);
    EXPECT_EQ(device.drive().mode, Mode::volts) << "not slow for long enough";
    device.advance(1501ms);
    EXPECT_EQ(device.drive().mode, last);
  }
}

TEST_F(Module, TimeoutIsWallTime) {
  settings = exact();
  settings.time_scale = 20;
  IqDevice fast(settings, state);
  fast.receive(bytes("55 06 34 0F 01 00 00 80 3E E9 8A"), Instant{0});  // 0.25 s
  fast.receive(bytes("55 06 34 05 01 00 00 C8 42 95 37"), Instant{0});
  fast.advance(4999ms);
  EXPECT_EQ(fast.drive().mode, Mode::velocity);
  fast.advance(5000ms);
  EXPECT_EQ(fast.drive().mode, Mode::coast);
}

TEST(IqEntries, AnswerByTheirAccessAndLengthInBothFirmwares) {
  for (const IqQuirks& quirks : {IqQuirks{}, kLegacyFirmware}) {
    MotorState state;
    IqSettings settings;
    settings.quirks = quirks;
    std::size_t rows = 0;
    for (const auto& entry : iq_entries()) {
      IqDevice device(settings, state);
      std::vector<std::uint8_t> request;
      append_iq_frame(request, entry.type, entry.sub, 0, {});
      device.receive(request, Instant{0});
      const bool there = entry.get() && iq_present(entry, quirks);
      rows += iq_present(entry, quirks) ? 1 : 0;
      EXPECT_EQ(device.output().size(), there ? 7 + iq_size(entry.format) : 0)
          << int{entry.type} << "/" << int{entry.sub};
    }
    EXPECT_GT(rows, 80u);
  }
}

}  // namespace kphi::sim::device_test
