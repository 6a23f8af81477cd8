// Each open question of the module's documents, answered both ways.
#include "drivers/sim/iq_habits.hpp"

#include <gtest/gtest.h>

#include "test/drivers/sim/iq_module.hpp"

namespace kphi::sim {
namespace {

using namespace std::chrono_literals;
using test::hex;
using Mode = MotorDrive::Mode;
using Habit = test::ExactModule;

TEST_F(Habit, GetsRestartTheTimeoutOrDoNot) {
  for (const bool restarts : {true, false}) {
    settings.habits.get_restarts_timeout = restarts;
    restart();
    set_float(52, 5, 100);
    for (Instant at{0}; at <= 2s; at += 100ms) {
      get(50, 13, at);
      device.advance(at);
    }
    EXPECT_EQ(device.drive().mode, restarts ? Mode::velocity : Mode::coast);
  }
}

TEST_F(Habit, CommandsRestartTheTimeoutInAnyCase) {
  settings.habits.get_restarts_timeout = false;
  restart();
  for (Instant at{0}; at <= 2s; at += 100ms) {
    set_float(52, 5, 100, at);
    device.advance(at);
  }
  EXPECT_EQ(device.timeouts(), 0u);
}

TEST_F(Habit, FramesToOthersRestartTheTimeoutOrDoNot) {
  for (const bool restarts : {true, false}) {
    settings.habits.other_ids_restart_timeout = restarts;
    restart();
    set_float(52, 5, 100);
    for (Instant at{0}; at <= 2s; at += 100ms) {
      send(50, 13, 5 << 2, "", at);
      device.advance(at);
    }
    EXPECT_EQ(device.timeouts(), restarts ? 0u : 1u);
  }
}

TEST_F(Habit, TheTimeoutIsHalfASecondOrWhatSomebodySaved) {
  EXPECT_EQ(get(52, 15), hex("00 00 00 3f"));
  settings.timeout_s = 0.25;
  restart();
  EXPECT_EQ(get(52, 15), hex("00 00 80 3e"));
}

TEST_F(Habit, TheSongFollowsItsOptionOrPlaysForEver) {
  for (const bool always : {false, true}) {
    settings.habits.song_always = always;
    restart();
    send(52, 19, 1, "00");
    set_float(52, 5, 100);
    run(0s, 3s);
    EXPECT_EQ(device.timeouts(), 1u);
    EXPECT_EQ(device.singing(), always);
    EXPECT_EQ(get(50, 0), always ? hex("01") : hex("05"));
  }
}

TEST_F(Habit, ABaudIsTakenAtOnceOrAfterAReboot) {
  for (const bool at_once : {true, false}) {
    settings.habits.baud_at_once = at_once;
    restart();
    send(16, 0, 1, "00 10 0e 00");
    EXPECT_EQ(get(16, 0), hex("00 10 0e 00")) << "set and saved";
    EXPECT_EQ(device.line_rate(), at_once ? 921600 : 115200);
    send(5, 0, 1);
    EXPECT_EQ(device.line_rate(), 921600);
  }
}

TEST_F(Habit, ABroadcastGetIsAnsweredOrNot) {
  EXPECT_EQ(send(5, 14, 0xfc), "");
  settings.habits.broadcast_get_answered = true;
  restart();
  EXPECT_EQ(send(5, 14, 0xfc), hex("55 03 05 0E 03 00 C9 0D"));
}

TEST_F(Habit, ABroadcastSetIsObeyedOrNot) {
  for (const bool obeyed : {true, false}) {
    settings.habits.broadcast_set_obeyed = obeyed;
    restart();
    set_float(52, 5, 100);
    send(52, 2, 0xfd);
    EXPECT_EQ(device.drive().mode, obeyed ? Mode::coast : Mode::velocity);
  }
}

TEST_F(Habit, TheClocksErrorReachesAllOrVelocityAndTimeOrNothing) {
  using Oscillator = IqHabits::Oscillator;
  settings.oscillator_gain = 0.005;
  state.speed = 1005;
  for (const auto oscillator : {Oscillator::all, Oscillator::velocity_and_time, Oscillator::none}) {
    settings.habits.oscillator = oscillator;
    restart();
    const bool fast = oscillator != Oscillator::none;
    const std::string thousand = hex("00 00 7a 44"), more = hex("00 40 7b 44");
    EXPECT_EQ(get(50, 13, 1000s), fast ? thousand : more) << "a fast clock makes a speed read less";
    EXPECT_EQ(get(5, 15, 1000s), fast ? more : thousand);
    EXPECT_NEAR(device.line_rate(), oscillator == Oscillator::all ? 115776 : 115200, 1e-6);
  }
}

TEST_F(Habit, TheCoilIsEstimatedByClient83Or77) {
  EXPECT_NE(get(83, 0), "");
  EXPECT_EQ(get(77, 0), "");
  settings.habits = legacy_habits();
  restart();
  EXPECT_EQ(get(83, 0), "");
  EXPECT_NE(get(77, 0), "");
  EXPECT_EQ(get(77, 5), hex("00 00 01 00")) << "not derated";
  EXPECT_EQ(get(52, 19), "") << "no option for the song";
}

TEST_F(Habit, TelemetryIsThereOrSilent) {
  EXPECT_EQ(get(88, 1).size(), 48u);
  settings.habits.telemetry = false;
  restart();
  EXPECT_EQ(get(88, 1), "");
}

TEST_F(Habit, SystemControlAnswersOnTheModulesIdOrOnZeroOnly) {
  settings.module_id = 5;
  restart();
  EXPECT_EQ(send(5, 14, 5 << 2), hex("55 03 05 0E 17 05 9F C4").substr(0, 18) + send(5, 14, 5 << 2).substr(18));
  EXPECT_EQ(send(5, 14, 0), "");
  settings.habits.system_control_on_id_zero = true;
  restart();
  EXPECT_EQ(send(5, 14, 5 << 2), "");
  EXPECT_EQ(get(5, 14), hex("05")) << "its true id";
  EXPECT_NE(send(50, 13, 5 << 2), "") << "the other clients have the id";
}

TEST_F(Habit, DoubtfulEntriesAreSilentOrThere) {
  for (const auto& [type, sub] : {std::pair{52, 6}, {52, 21}, {50, 48}, {50, 60}, {83, 14}, {60, 12}}) {
    settings.habits = IqHabits{};
    restart();
    EXPECT_EQ(get(static_cast<std::uint8_t>(type), static_cast<std::uint8_t>(sub)), "") << type << "/" << sub;
    auto& h = settings.habits;
    h.thrust_entries = h.supply_limits = h.lamination = h.undocumented = true;
    restart();
    EXPECT_NE(get(static_cast<std::uint8_t>(type), static_cast<std::uint8_t>(sub)), "") << type << "/" << sub;
  }
}

TEST_F(Habit, ThrustIsObeyedWhereItExists) {
  settings.habits.thrust_entries = true;
  restart();
  set_float(52, 6, 4);
  EXPECT_EQ(device.drive().mode, Mode::velocity);
  EXPECT_NEAR(device.drive().target, std::sqrt(4 / 1.6e-6), 1);
}

TEST_F(Habit, OutOfRangeIsStoredClampedOrIgnored) {
  using OutOfRange = IqHabits::OutOfRange;
  for (const auto& [habit, target, mode] : {std::tuple{OutOfRange::stored, 5000.0, Mode::velocity},
                                            {OutOfRange::clamped, 3450.0, Mode::velocity},
                                            {OutOfRange::ignored, 0.0, Mode::coast}}) {
    settings.habits.out_of_range = habit;
    restart();
    set_float(52, 5, 5000);
    EXPECT_EQ(device.drive().mode, mode);
    EXPECT_EQ(device.drive().target, target);
  }
}

TEST_F(Habit, TheReceiveBufferHoldsSixtyFourBytesOrAll) {
  // The module is busy with the first question while the others come.
  settings.reply_latency = 1ms;
  for (const auto& [capacity, answers] : {std::pair{64, 10}, {0, 20}}) {
    settings.habits.receive_buffer = static_cast<std::size_t>(capacity);
    restart();
    std::vector<std::uint8_t> burst;
    for (int i = 0; i < 20; ++i) append_iq_frame(burst, 50, 13, 0, {});
    device.receive(burst, Instant{0});
    int heard = 0;
    IqReply reply;
    for (Instant at{0}; at < 1s; at += 1ms) heard += device.next_reply(reply, at) ? 1 : 0;
    EXPECT_EQ(heard, answers) << "the first, and nine whole questions of 63 bytes";
    EXPECT_EQ(device.overflowed_bytes(), capacity == 0 ? 0u : 20u * 7 - 7 - 64);
  }
}

TEST_F(Habit, SafeModeReadsCoastOrTheLastMode) {
  for (const bool coast : {true, false}) {
    settings.habits.coast_in_safe_mode = coast;
    restart();
    send(84, 2, 1, "00");  // not latching
    set_float(52, 5, 100);
    state.supply_volts = 31;
    run(0s, 10ms);
    EXPECT_EQ(device.stage().mode, PowerStage::Mode::coast);
    EXPECT_EQ(get(50, 0), coast ? hex("05") : hex("03"));
    state.supply_volts = 12;
    run(10ms, 20ms);
    EXPECT_EQ(device.stage().mode, PowerStage::Mode::drive) << "without latching it comes back";
  }
}

TEST_F(Habit, SettingTheTimeShiftsItOrDoesNothing) {
  for (const bool settable : {true, false}) {
    settings.habits.time_settable = settable;
    restart();
    set_float(5, 15, 0, 100s);
    EXPECT_EQ(get(5, 15, 103s), settable ? hex("00 00 40 40") : hex("00 00 ce 42"));
  }
}

}  // namespace
}  // namespace kphi::sim
