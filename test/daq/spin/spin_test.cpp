// The motor turned by hand on the deterministic bench: every way out ends with it coasting.
#include "daq/spin/spin.hpp"

#include <gmock/gmock.h>

#include <fstream>

#include "daq/guard/interlock.hpp"
#include "results/run_reader.hpp"
#include "test/daq/bench_fixture.hpp"
#include "test/daq/coasting_bench.hpp"

namespace kphi::daq {
namespace spin_test {

using std::chrono::seconds;
using testing::ElementsAre;
using testing::HasSubstr;

/// What is said, and a key at a time of the bench.
class Person final : public Progress {
 public:
  void say(const std::string& line) override { said += line + "\n"; }
  std::string said;
};

class ByHand : public testing::Test {
 protected:
  /// Where the motor does not coast in the end.
  void TearDown() override { EXPECT_EQ(bench_->bench.simulation().motor().stage().mode, sim::PowerStage::Mode::coast); }
  void make(const std::string& faults = {}, const char* axis = nullptr) {
    std::string script;
    if (!faults.empty()) {
      script = (folder_.path() / "faults.yaml").string();
      std::ofstream(script) << "format: kphi-faults/1\nfaults:\n" << faults;
    }
    config_ = test::deterministic_config(4, script);
    if (axis != nullptr) config_.thrust_sign = -1;
    bench_.emplace(config_);
    bench_->mounted("5x3", 0);
    campaign_.profile.slew_rad_s2 = from_rpm(2000).value();
  }
  SpinResult spin(HandControl::Settings speeds, const std::function<bool()>& stop_asked = test::never) {
    AutoConfirmOperator person;
    test::PressedKeys keys([this]() -> std::optional<Key> {
      if (keys_.empty() || bench_->clock().now() < keys_.front().first) return std::nullopt;
      const Key key = keys_.front().second;
      keys_.erase(keys_.begin());
      return key;
    });
    return spin_by_hand(
        {*bench_, campaign_, config_, person, said_, stop_asked, speeds, keys, folder_.path() / "spin.h5"});
  }
  static std::vector<int> rpm(const SpinResult& result) {
    std::vector<int> speeds;
    for (const auto& step : result.held)
      speeds.push_back(static_cast<int>(std::lround(to_rpm(RadPerSec(step.commanded_speed_rad_s)))));
    return speeds;
  }
  static HandControl::Settings from(double start_rpm, std::optional<Duration> lasts = std::nullopt) {
    return {from_rpm(start_rpm), from_rpm(500), from_rpm(19100), lasts, seconds(30)};
  }

  test::TemporaryFolder folder_;
  profiles::Campaign campaign_ = test::short_campaign();
  profiles::BenchConfig config_;
  std::optional<CoastingBench> bench_;
  Person said_;
  std::vector<std::pair<Instant, Key>> keys_;
};

TEST_F(ByHand, HoldsItsSpeedForTheTimeAndRecordsIt) {
  make();
  const SpinResult result = spin(from(6000, seconds(3)));
  EXPECT_THAT(rpm(result), ElementsAre(6000));
  EXPECT_NEAR(result.held.at(0).thrust_n, 0.61, 0.02);
  EXPECT_THAT(said_.said, HasSubstr("stopping: 3 s are over"));
  EXPECT_EQ(results::read_run(result.run.file).outcome, results::Outcome::complete);
}

TEST_F(ByHand, FollowsTheKeysNoFasterThanItsSlew) {
  make();
  keys_ = {{seconds(6), Key::up},
           {seconds(9), Key::down},
           {std::chrono::milliseconds(9300), Key::down},
           {seconds(12), Key::stop}};
  const SpinResult result = spin(from(6000));
  EXPECT_THAT(rpm(result), ElementsAre(6000, 6500, 5500));
  const results::RunRecording run = results::read_run(result.run.file);
  double fastest = 0;
  std::optional<MotorReading> before;
  for (const MotorReading& reading : run.motor) {
    if (reading.channel != MotorChannel::speed) continue;
    const bool drives = reading.time_ns < bench_->coasts_at.count();
    if (before && drives)
      fastest = std::max(fastest,
                         std::abs(reading.value - before->value) / (1e-9 * double(reading.time_ns - before->time_ns)));
    before = reading;
  }
  EXPECT_LT(to_rpm(RadPerSec(fastest)), 2 * 2000) << "RPM/s, with the overshoot of the module's own loop";
}

TEST_F(ByHand, StopsAtAKeyDuringTheRamp) {
  make();
  keys_ = {{seconds(2), Key::stop}};
  const SpinResult result = spin(from(19000));
  EXPECT_THAT(rpm(result), ElementsAre());
  EXPECT_THAT(said_.said, HasSubstr("stopping: a key was pressed"));
}

TEST_F(ByHand, DoesNotBeginToTurnAfterAKeyDuringTheZero) {
  make();
  keys_ = {{std::chrono::milliseconds(300), Key::stop}};
  bench_->spoilt_motor.before_speed = [] { ADD_FAILURE() << "a speed"; };
  EXPECT_THROW((void)spin(from(6000)), Interrupted);
}

TEST_F(ByHand, DoesNotBeginToTurnAfterAKeyWhileThePowerComesBack) {
  make();
  keys_ = {{Instant(0), Key::up}, {Instant(0), Key::stop}};  // right after the answer
  bench_->spoilt_motor.before_speed = [] { ADD_FAILURE() << "a speed"; };
  EXPECT_THAT(test::words_of<Interrupted>([&] { return spin(from(6000)); }), HasSubstr("stopped by request before"));
  EXPECT_FALSE(std::filesystem::exists(folder_.path() / "spin.h5"));
}

TEST_F(ByHand, DoesNotRunAfterAKeyThatWasHeldDown) {
  make();
  keys_.assign(30, {seconds(7), Key::up});
  keys_.emplace_back(seconds(15), Key::stop);
  EXPECT_THAT(rpm(spin(from(6000))), ElementsAre(6000, 6500)) << "one step ahead of what is commanded, not thirty";
}

TEST_F(ByHand, StopsWhenNobodyIsAtTheKeys) {
  make();
  (void)spin(from(6000));
  EXPECT_THAT(said_.said, HasSubstr("stopping: no key for 30 s"));
}

TEST_F(ByHand, EndsAtARequestAsARunDoes) {
  make();
  EXPECT_THROW((void)spin(from(6000), [&] { return bench_->clock().now() > seconds(4); }), Interrupted);
}

TEST_F(ByHand, KeepsTheLimitsOfARun) {
  make();
  campaign_.limits["thrust_max_n"] = 1;
  for (int i = 0; i < 40; ++i) keys_.emplace_back(seconds(5) + i * std::chrono::milliseconds(300), Key::up);
  EXPECT_THAT(test::words_of<SafetyStop>([&] { return spin(from(6000)); }),
              testing::ContainsRegex("thrust .* N is above 1 N .campaign limits.thrust_max_n"));
}

TEST_F(ByHand, EndsWhenTheModuleFallsSilent) {
  make("  - {at_s: 4.5, for_s: 9, kind: motor_mute}\n");
  EXPECT_THAT(test::words_of<SafetyStop>([&] { return spin(from(6000)); }), HasSubstr("motor"));
}

TEST_F(ByHand, SaysThatTheAxisIsMirrored) {
  make({}, "-Fz");
  (void)spin(from(9000, seconds(3)));
  EXPECT_THAT(said_.said, HasSubstr("mirror thrust_axis"));
}

TEST_F(ByHand, TurnsNothingWithoutSomebodyWhoSaysThatTheStandIsClear) {
  make();
  class Nobody final : public Operator {
   protected:
    void mount(const profiles::Propeller&, double, const std::string&) override {}
  } nobody;
  test::PressedKeys keys([] { return std::nullopt; });
  EXPECT_THROW((void)spin_by_hand({*bench_, campaign_, config_, nobody, said_, test::never, from(6000), keys,
                                   folder_.path() / "spin.h5"}),
               NotMounted);
  EXPECT_FALSE(std::filesystem::exists(folder_.path() / "spin.h5"));
}

}  // namespace spin_test
}  // namespace kphi::daq
