#include "daq/run/run.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

#include "daq/guard/interlock.hpp"
#include "daq/guard/run_stopped.hpp"
#include "daq/virtual/deterministic_bench.hpp"
#include "results/reduction/reduction.hpp"
#include "results/run_reader.hpp"
#include "test/daq/bench_fixture.hpp"
#include "test/daq/coasting_bench.hpp"

namespace kphi::daq {
namespace run_test {

using results::Outcome;
using results::Phase;
using testing::HasSubstr;
using testing::ThrowsMessage;

double to_rad_per_sec(double rpm) { return from_rpm(rpm).value(); }

class OneRun : public testing::Test {
 protected:
  explicit OneRun(int seed = 1) : config_(test::deterministic_config(seed)), bench_(config_) {
    bench_.mounted("5x3", 0);
  }

  RunResult record(const std::function<bool()>& stop_asked = test::never) {
    return record_run(bench_, test::first_run(campaign_, config_, file()), said_, stop_asked);
  }
  [[nodiscard]] results::RunRecording recorded() { return results::read_run(record().file); }
  [[nodiscard]] std::filesystem::path file() const { return folder_.path() / "5x3_phi000_rep1.h5"; }
  [[nodiscard]] std::filesystem::path aborted_file() const { return folder_.path() / "5x3_phi000_rep1.aborted.h5"; }

  bool motor_is_let_go() { return test::motor_is_let_go(bench_); }

  test::TemporaryFolder folder_;
  profiles::Campaign campaign_ = test::short_campaign();
  profiles::BenchConfig config_;
  DeterministicBench bench_;
  test::SaidLines said_;
};

/// Tells whether real-time priority is held.
class PromptBench final : public WrappedBench {
 public:
  using WrappedBench::WrappedBench;
  [[nodiscard]] std::shared_ptr<void> keep_prompt(std::string&) override {
    auto handle = std::make_shared<int>();
    prompt = handle;
    ++asked;
    return handle;
  }
  [[nodiscard]] results::FileLayer& files() override { return layer_; }
  std::weak_ptr<void> prompt;
  int asked = 0, finished = 0;

 private:
  /// A file is renamed once it is finished.
  struct Layer final : results::FileLayer {
    explicit Layer(PromptBench& bench) : owner(bench) {}
    void rename(const std::filesystem::path& from, const std::filesystem::path& to) override {
      EXPECT_TRUE(owner.prompt.expired()) << "it may compute for longer than the kernel allows";
      ++owner.finished;
      FileLayer::rename(from, to);
    }
    PromptBench& owner;
  } layer_{*this};
};

TEST_F(OneRun, HasPriorityWhileItRunsAndNoneWhileItsFileIsFinished) {
  PromptBench bench(config_);
  bench.mounted("5x3", 0);
  bool held = false;
  (void)record_run(bench, test::first_run(campaign_, config_, file()), said_, [&] {
    held = held || !bench.prompt.expired();
    return false;
  });
  EXPECT_TRUE(held);
  EXPECT_EQ(bench.asked, 1);
  EXPECT_EQ(bench.finished, 1);
}

TEST_F(OneRun, RecordsZeroStepsSpinDownAndZeroInThisOrder) {
  const results::RunRecording run = recorded();
  std::vector<Phase> phases;
  for (const auto& mark : run.phases) phases.push_back(mark.phase);
  EXPECT_THAT(phases, testing::ElementsAre(Phase::zero_before, Phase::step, Phase::step, Phase::step, Phase::step,
                                           Phase::spin_down, Phase::zero_after, Phase::end));
  EXPECT_EQ(run.outcome, Outcome::complete);
}

TEST_F(OneRun, HoldsNothingThatWasReadBeforeItBegan) {
  bench_.wait_until(bench_.clock().now() + std::chrono::seconds(2));
  const Instant began = bench_.clock().now();
  const results::RunRecording run = recorded();
  ASSERT_FALSE(run.motor.empty());
  for (const auto& reading : run.motor) ASSERT_GE(Instant(reading.time_ns), began - std::chrono::milliseconds(20));
  for (const auto& sample : run.load_cell) ASSERT_GE(Instant(sample.arrival_ns), began);
}

TEST_F(OneRun, LosesNoSampleAndSaysSo) {
  const RunResult result = record();
  EXPECT_EQ(result.account.received, result.account.expected);
  EXPECT_EQ(result.account.lost_network + result.account.lost_host, 0u);
  EXPECT_EQ(results::read_run(result.file).load_cell.size(), result.account.received);
  EXPECT_TRUE(results::verify_run(result.file).whole());
}

TEST_F(OneRun, MeasuresTheThrustThatTheBenchWasBuiltWith) {
  const auto steps = reduce(recorded());
  ASSERT_EQ(steps.size(), 4u);
  for (const auto& step : steps) {
    EXPECT_EQ(step.quality_flags, 0u) << step.step;
    EXPECT_NEAR(step.speed_rad_s, step.commanded_speed_rad_s, 0.005 * step.commanded_speed_rad_s);
    EXPECT_NEAR(step.thrust_n, test::kTrueK5x3 * step.speed_rad_s * step.speed_rad_s, 0.01 + 0.01 * step.thrust_n);
  }
}

TEST_F(OneRun, EndsWithACoastThatFeedsNothingBack) {
  double highest_v = 0;
  bench_.let_watch(
      {.stepped = [&] { highest_v = std::max(highest_v, bench_.simulation().plant().motor().supply_volts); },
       .stream_began = {},
       .heard = {}});
  const RunResult result = record();
  EXPECT_EQ(result.stop->outcome, iq::StopReport::Outcome::standing);
  EXPECT_LT(to_seconds(result.stop->time_to_coast.value()), 0.05);
  EXPECT_LT(highest_v, 12.1) << "the supply cannot sink";
  EXPECT_TRUE(motor_is_let_go());
}

TEST_F(OneRun, RampsDownOnASupplyThatSinksCurrent) {
  config_.supply_sinks_current = true;
  const RunResult result = record();
  ASSERT_TRUE(result.stop);
  EXPECT_EQ(result.stop->outcome, iq::StopReport::Outcome::standing);
  EXPECT_NEAR(result.stop->speed_at_start, to_rad_per_sec(18000), 20);
  // 1000 rad/s² down to 500 rad/s, then it coasts.
  EXPECT_NEAR(to_seconds(result.stop->time_to_coast.value()), 1.39, 0.05);
  const results::RunRecording run = results::read_run(result.file);
  const auto spin_down = std::find_if(run.phases.begin(), run.phases.end(),
                                      [](const auto& mark) { return mark.phase == Phase::spin_down; });
  for (const auto& reading : run.motor) {
    const double since = 1e-9 * static_cast<double>(reading.time_ns - spin_down->time_ns);
    if (reading.channel != MotorChannel::speed || since < 0.1 || since > 1.3) continue;
    EXPECT_NEAR(reading.value, to_rad_per_sec(18000) - 1000 * since, 60) << since;
  }
}

TEST_F(OneRun, DelaysARampThatItServesLateInsteadOfJumping) {
  constexpr double kRate = 200;  // rad/s²
  constexpr int kLateEvery = 7;  // ticks
  campaign_.profile.slew_rad_s2 = kRate;
  int tick = 0;
  const auto late_now_and_then = [&] {
    if (++tick % kLateEvery == 0) bench_.wait_until(bench_.clock().now() + std::chrono::milliseconds(120));
    return false;
  };
  const results::RunRecording run = results::read_run(record(late_now_and_then).file);
  const auto last_ramp =
      std::find_if(run.phases.rbegin(), run.phases.rend(), [](const auto& mark) { return mark.phase == Phase::ramp; });
  ASSERT_NE(last_ramp, run.phases.rend());
  const MotorReading* before = nullptr;
  for (const auto& reading : run.motor) {
    if (reading.channel != MotorChannel::speed || reading.time_ns > last_ramp->time_ns) continue;
    if (before && before->value > 600) {
      const double lasts = 1e-9 * static_cast<double>(reading.time_ns - before->time_ns);
      ASSERT_LT(reading.value - before->value, kRate * (lasts + 0.02) + 3) << 1e-9 * reading.time_ns;
    }
    before = &reading;
  }
}

TEST_F(OneRun, NeverOverwritesAnEarlierRun) {
  (void)record();
  const std::string before = test::bytes_of(file());
  EXPECT_ANY_THROW((void)record());
  EXPECT_EQ(test::bytes_of(file()), before);
  EXPECT_TRUE(motor_is_let_go());
}

TEST_F(OneRun, StopsOnRequestAtAnyTickLetsTheMotorGoAndKeepsWhatItHas) {
  // The run has about 370 ticks; these cover every phase.
  for (const int last_tick : {0, 1, 30, 60, 90, 150, 200, 280, 300, 340}) {
    int ticks = 0;
    try {
      (void)record([&] { return ticks++ >= last_tick; });
      ADD_FAILURE() << "was not stopped at tick " << last_tick;
    } catch (const Interrupted& e) {
      EXPECT_THAT(e.words().data, HasSubstr("rep1.aborted"));
      EXPECT_THAT(e.words().state, testing::StartsWith("motor: "));
      EXPECT_THAT(e.words().state,
                  testing::ContainsRegex(e.words().at_rest ? "at rest after|was not turning|at rest, now without power"
                                                           : "slowing down at|ordered to coast, now without power"));
    }
    EXPECT_TRUE(motor_is_let_go()) << "after tick " << last_tick;
  }
  EXPECT_EQ(results::read_run(aborted_file()).outcome, Outcome::aborted);
  EXPECT_FALSE(std::filesystem::exists(file()));
}

TEST_F(OneRun, StopsAtOnceWhenALimitIsPassedNamesItAndSaysWhatBecameOfTheMotor) {
  campaign_.limits["thrust_max_n"] = 2.0;
  EXPECT_THAT(test::words_of<SafetyStop>([&] { return record(); }),
              AllOf(HasSubstr("is above 2 N"),
                    testing::ContainsRegex("motor: coast confirmed after 0[.]0.*(at rest after|slowing down at)")));
  EXPECT_TRUE(motor_is_let_go());
  EXPECT_THAT(results::read_run(aborted_file()).outcome_reason, HasSubstr("is above 2 N"));
}

/// A disk that is full after so many bytes.
class FullDisk final : public results::FileLayer {
 public:
  explicit FullDisk(std::uint64_t room) : room_(room) {}
  void before_write(std::uint64_t bytes) override {
    if (bytes > room_) throw std::system_error(ENOSPC, std::generic_category());
    room_ -= bytes;
  }

 private:
  std::uint64_t room_;
};

TEST_F(OneRun, StopsWhenTheDiskIsFullAndLosesNothingWritten) {
  FullDisk disk(600'000);
  bench_.use_files(disk);
  EXPECT_THAT([&] { (void)record(); }, ThrowsMessage<RecordError>(HasSubstr("disk full")))
      << "a full disk went unnoticed";
  EXPECT_TRUE(motor_is_let_go());
  std::filesystem::path left;
  for (const auto& entry : std::filesystem::directory_iterator(folder_.path())) left = entry.path();
  const results::RunRecording run = results::read_run(left);
  EXPECT_GT(run.load_cell.size(), 3000u);
  EXPECT_EQ(results::check_sequence(run.load_cell, 1).lost, 0u);
}

TEST_F(OneRun, StopsWhenAnExceptionComesFromTheProgressDisplay) {
  said_.at_tick = [](const Position& position, const Observation&) {
    if (position.step == 2) throw std::runtime_error("the terminal went away");
  };
  EXPECT_THROW((void)record(), std::runtime_error);
  EXPECT_TRUE(motor_is_let_go());
}

/// The link hangs at the second speed while the guard looks, and fails then.
class FailingLink : public testing::Test {
 protected:
  FailingLink() { bench_.mounted("5x3", 0); }

  StopWords record_until_it_fails(const std::function<void()>& trouble) {
    int speeds = 0;
    bench_.spoilt_motor.before_speed = [&] {
      if (++speeds != 2) return;
      trouble();
      bench_.wait_until(bench_.clock().now() + std::chrono::milliseconds(50));
      throw DeviceError("motor", "set the speed", "the port is gone", "plug it in");
    };
    Progress progress;
    try {
      (void)record_run(bench_, test::first_run(test::short_campaign(), config_, folder_.path() / "run.h5"), progress,
                       test::never);
    } catch (const SafetyStop& stop) {
      return stop.words();
    }
    ADD_FAILURE() << "it went on";
    return {};
  }

  test::TemporaryFolder folder_;
  profiles::BenchConfig config_ = test::deterministic_config(1);
  CoastingBench bench_{config_};
};

TEST_F(FailingLink, IsAConsequenceOfWhatTheGuardHadSeenBefore) {
  const StopWords words = record_until_it_fails([&] {
    bench_.spoilt_motor.spoil = [](MotorReading& reading) {
      if (reading.channel == MotorChannel::speed) reading.value = to_rad_per_sec(25000);
    };
  });
  EXPECT_THAT(words.cause, HasSubstr("speed 25000 RPM is above"));
  EXPECT_THAT(words.consequences, HasSubstr("the port is gone"));
}

TEST_F(FailingLink, IsToldOnceWhenTheGuardSawItTooAndIsTheCauseWhenTheGuardSawNothing) {
  EXPECT_THAT(record_until_it_fails([] {}).cause, HasSubstr("the port is gone"));
  const StopWords words = record_until_it_fails([&] { bench_.spoilt_motor.lost = "unplugged"; });
  EXPECT_THAT(words.cause, HasSubstr("unplugged"));
  EXPECT_THAT(words.line(), testing::Not(HasSubstr("the port is gone")));
}

TEST(RunFromASeed, GivesTheSameBytesTwiceAndOthersFromAnotherSeed) {
  class SeededRun final : public OneRun {
   public:
    explicit SeededRun(int seed) : OneRun(seed) {}
    void TestBody() override {}
    std::string bytes() { return test::bytes_of(record().file); }
  };
  const std::string once = SeededRun(7).bytes();
  EXPECT_GT(once.size(), 500'000u);
  EXPECT_TRUE(once == SeededRun(7).bytes());
  EXPECT_FALSE(once == SeededRun(8).bytes());
}

TEST(UtcText, IsIso8601) {
  EXPECT_EQ(utc_text(ManualClock(), Instant(std::chrono::seconds(61))), "2021-05-30T00:01:01Z");
}

}  // namespace run_test
}  // namespace kphi::daq
