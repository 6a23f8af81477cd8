#include "drivers/iq/service/clock_gain.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "base/error.hpp"
#include "test/drivers/iq/fake_dialogue.hpp"
#include "test/refusal.hpp"

namespace kphi::iq {
namespace clock_gain_test {

using fake::FakeDialogue;
using testing::HasSubstr;
using testing::IsEmpty;

/// A line as a USB adapter makes it: mostly 0.1 to 1 ms each way, now and then late by up to 60 ms.
struct Line {
  std::mt19937_64 random;
  Duration operator()() {
    std::uniform_real_distribution<double> usual(0.1e-3, 1e-3), late(1e-3, 60e-3), chance(0, 1);
    return from_seconds(chance(random) < 0.05 ? late(random) : usual(random));
  }
};

ClockGain measured(FakeDialogue& module, std::uint64_t seed, double seconds = 60) {
  Line line{std::mt19937_64(seed)};
  module.way = [&line] { return line(); };
  return measure_clock_gain(module.ask(), module.pause(), {seconds, std::chrono::milliseconds(20)});
}

TEST(ClockGain, TheIntervalHoldsTheTruthWhateverTheDelays) {
  double widest = 0, worst = 0;
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    FakeDialogue module;
    std::mt19937_64 random(seed * 7919);
    module.gain = 1 + std::uniform_real_distribution<double>(-0.005, 0.005)(random);
    const ClockGain gain = measured(module, seed);
    ASSERT_LE(gain.lowest, module.gain) << "seed " << seed;
    ASSERT_GE(gain.highest, module.gain) << "seed " << seed;
    ASSERT_EQ(gain.contradiction_s, 0) << "seed " << seed;
    widest = std::max(widest, gain.highest - gain.lowest);
    worst = std::max(worst, std::abs(gain.factor - module.gain));
  }
  EXPECT_LT(widest, 20e-6) << "an interval that says nothing would hold it, too";
  EXPECT_LT(worst, 10e-6);
}

TEST(ClockGain, ItsUncertaintyIsNoSmallerThanItsErrors) {
  double squares = 0, claimed = 0;
  constexpr int kSeeds = 200;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    FakeDialogue module;
    module.gain = 1.005;
    const ClockGain gain = measured(module, seed + 1000);
    squares += std::pow(gain.factor - module.gain, 2);
    claimed += std::pow((gain.highest - gain.lowest) / std::sqrt(12.0), 2);
    EXPECT_GE(gain.u_factor, 30e-6) << "the host's own clock is no better";
    EXPECT_LT(gain.u_factor, 31e-6);
  }
  EXPECT_LT(squares, claimed);
  EXPECT_GT(squares, 0);
}

TEST(ClockGain, IsFoundAtEitherSignOfHalfAPercent) {
  for (const double truth : {0.995, 1.0, 1.005}) {
    FakeDialogue module;
    module.gain = truth;
    const ClockGain gain = measured(module, 5);
    EXPECT_NEAR(gain.factor, truth, 10e-6);
    EXPECT_NEAR(gain.ppm(), 1e6 * (truth - 1), 10);
    EXPECT_THAT(gain.findings(), IsEmpty());
  }
}

TEST(ClockGain, LateStampsDoNotMoveIt) {
  FakeDialogue punctual, late;
  punctual.gain = late.gain = 0.9962;
  const ClockGain good = measured(punctual, 3);
  std::mt19937_64 random(3);
  int count = 0;
  // Nine of ten replies are late, all on the way back: a mean or a plain line would be off.
  late.way = [&] {
    const bool back = count++ % 2 == 1;
    return std::chrono::microseconds(back && random() % 10 != 0 ? 5000 + random() % 50000 : 200);
  };
  const ClockGain gain = measure_clock_gain(late.ask(), late.pause(), {60, std::chrono::milliseconds(20)});
  EXPECT_NEAR(gain.factor, 0.9962, 10e-6);
  EXPECT_NEAR(gain.factor, good.factor, 20e-6);
}

TEST(ClockGain, SetsTheTimeToZeroWhereFloatsAreFine) {
  FakeDialogue module;
  module.offset_s = 2e6;  // three weeks: a float32 moves in steps of 125 ms
  const ClockGain gain = measured(module, 1);
  EXPECT_NEAR(gain.factor, 1, 10e-6);
  EXPECT_LT(gain.highest - gain.lowest, 20e-6);
}

TEST(ClockGain, IsHonestWhenTheTimeCannotBeSet) {
  FakeDialogue module;
  module.gain = 1.004;
  module.offset_s = 1e5;  // steps of 7.8 ms
  module.ignores_sets = true;
  const ClockGain gain = measured(module, 1);
  EXPECT_LE(gain.lowest, 1.004);
  EXPECT_GE(gain.highest, 1.004);
  EXPECT_GT(gain.u_factor, 50e-6);
}

TEST(ClockGain, HoldsTheTruthWhenTheTimeMovesInUnknownSteps) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    FakeDialogue module;
    module.gain = 1.005;
    module.tick_s = 10e-3;
    const ClockGain gain = measured(module, seed);
    EXPECT_LE(gain.lowest, 1.005) << seed;
    EXPECT_GE(gain.highest, 1.005) << seed;
    EXPECT_GT(gain.contradiction_s, 1e-3);
    ASSERT_EQ(gain.findings().size(), 1u);
    EXPECT_THAT(gain.findings()[0].what, HasSubstr("no line fits"));
  }
}

TEST(ClockGain, IsLessCertainOverAShorterTime) {
  FakeDialogue module;
  const ClockGain gain = measured(module, 1, 6);
  EXPECT_GT(gain.highest - gain.lowest, 20e-6);
  ASSERT_EQ(gain.findings().size(), 1u);
  EXPECT_THAT(gain.findings()[0].what, HasSubstr("6 s is short"));
}

TEST(ClockGain, IsNotBelievedWhenNoOscillatorHasIt) {
  ClockGain gain;
  gain.factor = 1.2;
  gain.duration_s = 60;
  ASSERT_EQ(gain.findings().size(), 1u);
  EXPECT_EQ(gain.findings()[0].severity, Severity::fault);
}

TEST(ClockGain, IsOnlyMeasuredWhileTheMotorStands) {
  FakeDialogue turning;
  turning.values[&entry<"brushless_drive.obs_velocity">] = -20;
  EXPECT_THROW((void)measure_clock_gain(turning.ask(), turning.pause()), DeviceError);
  FakeDialogue driven;
  driven.values[&entry<"brushless_drive.drive_mode">] = 3;
  EXPECT_THROW((void)measure_clock_gain(driven.ask(), driven.pause()), DeviceError);
  EXPECT_EQ(driven.offset_s, 1000) << "the module's time is untouched";
}

TEST(ClockGain, NoticesARestart) {
  FakeDialogue module;
  int questions = 0;
  module.way = [&] {
    if (++questions == 100) module.offset_s -= 5;
    return Duration(std::chrono::microseconds(300));
  };
  EXPECT_THAT(refusal([&] { return measure_clock_gain(module.ask(), module.pause()); }), HasSubstr("restarted"));
}

TEST(ClockGain, GivesUpOnAModuleThatFallsSilent) {
  FakeDialogue module;
  module.values.erase(&entry<"brushless_drive.obs_velocity">);
  EXPECT_THROW((void)measure_clock_gain(module.ask(), module.pause()), DeviceError);
}

TEST(ClockGain, NeedsReadingsAtTwoTimes) {
  const std::vector<Answer> none, one{{1, Instant(5), Duration(1)}}, same{2, {1, Instant(5), Duration(1)}};
  EXPECT_THROW((void)clock_gain(none), std::invalid_argument);
  EXPECT_THROW((void)clock_gain(one), std::invalid_argument);
  EXPECT_THROW((void)clock_gain(same), std::invalid_argument);
}

TEST(ClockGain, IsWrittenForTheBenchFile) {
  ClockGain gain;
  gain.factor = 1.0050312;
  gain.u_factor = 3.02e-5;
  gain.duration_s = 60.02;
  gain.uid = "002300064d4b501120343353";
  gain.measured_utc = "2026-05-01T12:00:00Z";
  EXPECT_EQ(gain.yaml(),
            "clock_gain: {factor: 1.0050312, u: 3.0e-05, uid: \"002300064d4b501120343353\", measured_utc: "
            "\"2026-05-01T12:00:00Z\", duration_s: 60.0}");
}

}  // namespace clock_gain_test
}  // namespace kphi::iq
