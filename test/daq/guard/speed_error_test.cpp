#include "daq/guard/speed_error.hpp"

#include <gmock/gmock.h>

#include <array>
#include <cmath>
#include <limits>
#include <random>

#include "daq/virtual/deterministic_bench.hpp"
#include "test/daq/bench_fixture.hpp"

namespace kphi::daq {
namespace speed_error_test {

using std::chrono::milliseconds;
using testing::HasSubstr;
using Kind = SpeedError::Kind;

constexpr Duration kHost = milliseconds(60);
constexpr Duration kEvery = milliseconds(20);
constexpr double kTop = 2000;  // rad/s
constexpr int kBenchSeconds = 120;

/// A watch, told and shown a speed every 20 ms.
class Watched {
 public:
  explicit Watched(int way = +1) : direction(way), watch(way, kHost) {}

  void command(double speed) { watch.command(now, RadPerSec(speed)); }
  void show(double signed_speed) {
    now += kEvery;
    watch.take({MotorChannel::speed, now.count(), 0, signed_speed});
  }
  void show(double signed_speed, int times) {
    for (; times > 0; --times) show(signed_speed);
  }
  void show_current(double amps) { watch.take({MotorChannel::motor_current, now.count(), 0, amps}); }
  /// Until something is found; how long that took, in ms; -1: nothing within a second.
  double ms_until_found(double signed_speed) {
    const Instant since = now;
    while (now < since + milliseconds(1000)) {
      show(signed_speed);
      if (kind() != Kind::none) return 1e3 * to_seconds(now - since);
    }
    return -1;
  }
  [[nodiscard]] Kind kind() const { return watch.error().kind; }
  void expect_innocent() const { EXPECT_EQ(kind(), Kind::none) << to_words(watch.error()); }
  /// Soon enough, `later` after what a rotor that turns is allowed.
  void expect_guilt(double signed_speed, double later = 0) {
    const double ms = ms_until_found(signed_speed);
    EXPECT_GT(ms, 0) << signed_speed;
    EXPECT_LE(ms, 140 + later) << signed_speed;
  }
  /// For long.
  void follow(double speed, int times = 100) {
    command(speed);
    show(direction * speed, times);
  }

  Instant now = std::chrono::seconds(5);
  const int direction;
  SpeedWatch watch;
};

TEST(SpeedWatch, LetsARotorBeAnywhereOnARampButNotBesideIt) {
  for (const auto& [from, to] : {std::pair(300.0, 1800.0), std::pair(1800.0, 300.0)}) {
    Watched rotor;
    rotor.follow(from, 200);
    rotor.watch.command_ramp(rotor.now, RadPerSec(to));
    for (int i = 0; i <= 1000; ++i) rotor.show(from + (to - from) * i / 1000);  // 20 s: slower than any rotor
    EXPECT_EQ(rotor.kind(), Kind::none) << from;
    rotor.follow(to);
    rotor.expect_innocent();
    rotor.watch.command_ramp(rotor.now, RadPerSec(from));
    EXPECT_GT(rotor.ms_until_found(1800 * 1.3), 0) << "a runaway is one on a ramp, too";
  }
}

TEST(SpeedWatch, FindsNothingInARotorThatFollowsFortyStepsUpAndDown) {
  for (const int direction : {+1, -1}) {
    Watched rotor(direction);
    std::mt19937 random(7);
    std::normal_distribution<double> noise(0, 4);
    double speed = 0;
    for (int i = 0; i < 80; ++i) {
      const double commanded = 10 + (i < 40 ? i : 79 - i) * 51;
      rotor.command(commanded);
      for (int n = 0; n < 100; ++n) {
        speed += (commanded - speed) * (1 - std::exp(-1.0));  // one time constant of 0.02 s
        rotor.show(direction * (speed + noise(random)));
      }
    }
    rotor.expect_innocent();
  }
}

TEST(SpeedWatch, WaitsForTheSlowestRotorThatIsAtWork) {
  Watched rotor;
  rotor.command(kTop);
  for (double speed = 0; speed < kTop; speed += SpeedWatch::kSlowestRise * to_seconds(kEvery)) rotor.show(speed);
  rotor.expect_innocent();
  rotor.command(500);
  for (double speed = kTop; speed > 500; speed -= SpeedWatch::kSlowestFall * to_seconds(kEvery)) rotor.show(speed);
  rotor.expect_innocent();
}

TEST(SpeedWatch, ForgetsNoSpeedThatTheRotorMayHaveWhenCommandsFollowSoonUponEachOther) {
  Watched rotor;
  rotor.command(kTop);
  rotor.show(1500, 5);
  rotor.command(500);
  rotor.show(1400, 25);  // a slow rotor would never have been so fast
  rotor.expect_innocent();
}

TEST(SpeedWatch, FindsAHeldRotorWithin140MillisecondsAtEverySpeedFrom30RadPerSecOn) {
  for (double speed = 30; speed <= kTop; speed += 10) {
    Watched rotor;
    rotor.follow(speed, 200);
    const double ms = rotor.ms_until_found(0);
    EXPECT_GT(ms, 100) << speed;
    EXPECT_LE(ms, 140) << speed;
    EXPECT_EQ(rotor.kind(), Kind::strays);
  }
}

TEST(SpeedWatch, FindsARotorThatIsHeldInTheMiddleOfAStep) {
  Watched rotor;
  rotor.follow(1000, 200);
  rotor.command(1051);
  rotor.show(1030);
  rotor.expect_guilt(0);
}

TEST(SpeedWatch, FindsARotorThatNeverStarts) {
  Watched rotor;
  rotor.command(1000);
  rotor.expect_guilt(0, 1e3 * (SpeedWatch::kFloor + SpeedWatch::kShare * 1000) / SpeedWatch::kSlowestRise);
}

TEST(SpeedWatch, FindsWhatRunsAwaySlipsTurnsTheWrongWayOrIsNoNumber) {
  for (const double speed : {1200.0, 800.0, -1000.0, std::numeric_limits<double>::quiet_NaN()}) {
    Watched rotor;
    rotor.follow(1000);
    rotor.expect_guilt(speed);
  }
  Watched clockwise(-1);
  clockwise.follow(1000);
  clockwise.expect_innocent();
  EXPECT_GT(clockwise.ms_until_found(+1000), 0);
}

TEST(SpeedWatch, ForgivesWhatIsOverSoonerAndLeavesALittleTooSlowToTheJudgeOfTheMeasurement) {
  Watched rotor;
  rotor.follow(1000);
  for (int i = 0; i < 20; ++i) {
    rotor.show(0, 5);
    rotor.show(1000);
  }
  rotor.expect_innocent();
  rotor.show(0.9 * 1000, 100);
  rotor.expect_innocent();
}

TEST(SpeedWatch, FindsAStalledMotorByItsCurrentWhicheverWayItFlowsWhereTheSpeedTellsNothing) {
  for (const int direction : {+1, -1}) {
    Watched rotor(direction);
    rotor.command(10.5);  // 100 RPM
    rotor.show(0, 8);
    rotor.show_current(direction * 29);
    EXPECT_EQ(rotor.kind(), Kind::none) << "one reading is none";
    rotor.show(0, 8);
    rotor.show_current(direction * 30);
    ASSERT_EQ(rotor.kind(), Kind::stalled);
    EXPECT_THAT(to_words(rotor.watch.error()), HasSubstr(direction > 0 ? "stalled for 0.16 s: 30 A at 0 of 100 RPM"
                                                                       : "stalled for 0.16 s: -30 A at -0 of 100 RPM"));
  }
}

TEST(SpeedWatch, AllowsTheCurrentOfARotorThatTurns) {
  Watched rotor;
  rotor.command(kTop);
  double speed = 0;
  for (int i = 0; i < 100; ++i) {
    rotor.show(speed = std::min(kTop, speed + 100));
    rotor.show_current(30);
  }
  rotor.expect_innocent();
}

TEST(SpeedWatch, FindsThatTheSpeedIsNoLongerReadThoughTheModuleAnswers) {
  Watched rotor;
  rotor.follow(1000);
  const Instant last = rotor.now;
  while (rotor.kind() == Kind::none && rotor.now < last + milliseconds(1000)) {
    rotor.now += kEvery;
    rotor.show_current(10);
  }
  EXPECT_EQ(rotor.kind(), Kind::unseen);
  EXPECT_LE(rotor.now - last, SpeedWatch::kBlind + kHost + kEvery);
  EXPECT_THAT(to_words(rotor.watch.error()), HasSubstr("no speed reading"));
}

TEST(SpeedWatch, JudgesNothingWhileNobodyCommandsASpeed) {
  Watched rotor;
  rotor.show(1000, 100);
  rotor.expect_innocent();
  rotor.command(1000);
  EXPECT_GT(rotor.ms_until_found(0), 0);
  rotor.watch.release();
  rotor.expect_innocent();
  rotor.show(1000, 100);
  rotor.expect_innocent();
}

struct Clean {
  const char* propeller;
  double top_rpm;  ///< that 12 V reach
  int spin;
  unsigned seed;
};

class CleanMotor : public testing::TestWithParam<Clean> {};

/// What the simulated motor does with speeds that are drawn at random, and held for as long as chance will.
TEST_P(CleanMotor, IsNeverFoundGuilty) {
  profiles::BenchConfig config = test::deterministic_config(static_cast<int>(GetParam().seed));
  config.iq.spin = GetParam().spin;
  DeterministicBench bench(config);
  bench.mounted(GetParam().propeller, 0);
  SpeedWatch watch(GetParam().spin, kHost);
  std::mt19937 random(GetParam().seed);
  std::uniform_real_distribution<double> rpm(100, GetParam().top_rpm), dwell(0.1, 3);
  std::array<MotorReading, 512> readings;
  std::size_t judged = 0;
  for (const Instant end = bench.clock().now() + std::chrono::seconds(kBenchSeconds); bench.clock().now() < end;) {
    const RadPerSec speed = from_rpm(rpm(random));
    bench.motor().spin_at(RadPerSec(GetParam().spin * speed.value()));
    watch.command(bench.clock().now(), speed);
    bench.wait_until(bench.clock().now() + from_seconds(dwell(random)));
    while (const std::size_t n = bench.motor().take(readings)) {
      for (std::size_t i = 0; i < n; ++i) watch.take(readings[i]);
      judged += n;
    }
    ASSERT_EQ(watch.error().kind, Kind::none) << to_words(watch.error());
  }
  EXPECT_GT(judged, 90u * kBenchSeconds);
}

INSTANTIATE_TEST_SUITE_P(SpeedWatch, CleanMotor,
                         testing::Values(Clean{"5x2", 19100, +1, 1}, Clean{"5x3", 19100, +1, 2},
                                         Clean{"5x3", 19100, -1, 3}, Clean{"6x2", 17000, +1, 4},
                                         Clean{"6x3", 16000, +1, 5}));

TEST(SpeedWatch, SaysWhatIsMeasuredAndWhatWasCommanded) {
  Watched rotor;
  rotor.command(from_rpm(6000).value());
  EXPECT_EQ(to_words(rotor.watch.error()), "");
  rotor.show(from_rpm(6000).value(), 100);
  (void)rotor.ms_until_found(from_rpm(-30).value());
  EXPECT_THAT(to_words(rotor.watch.error()),
              HasSubstr("speed off target for 0.1 s: -30 of 6000 RPM; check for a blocked rotor"));
}

}  // namespace speed_error_test
}  // namespace kphi::daq
