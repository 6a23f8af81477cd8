#include "daq/live/replayed_run.hpp"

#include <gmock/gmock.h>

#include "daq/live/live_session.hpp"
#include "results/run_reader.hpp"
#include "test/source_dir.hpp"

namespace kphi::daq::live {
namespace replayed_run_test {

const results::RunRecording& recording() {
  static const results::RunRecording kRecording =
      results::read_run(kphi::test::source_dir() + "/results/reference/runs/5x3_phi090_rep1.h5");
  return kRecording;
}

struct Seen final : Progress {
  void tick(const Position& position, const Observation& seen) override { ticks.emplace_back(position, seen); }
  void step_done(const Position& position, const Observation& seen) override { steps.emplace_back(position, seen); }
  std::vector<std::pair<Position, Observation>> ticks, steps;
};

Seen shown() {
  Seen seen;
  ManualClock clock;
  ReplayedRun run(recording(), clock);
  for (Instant when = run.begin(); when < run.end(); when += std::chrono::milliseconds(10)) run.show(when, seen, 1);
  run.show(run.end(), seen, 1);
  return seen;
}

TEST(ReplayedRun, GoesThroughEveryStepAtItsCommandedSpeed) {
  const Seen seen = shown();
  std::vector<double> commanded;
  for (const auto& mark : recording().phases)
    if (mark.phase == results::Phase::step) commanded.push_back(mark.speed_rad_s);
  ASSERT_EQ(seen.steps.size(), commanded.size());
  for (std::size_t i = 0; i < commanded.size(); ++i) {
    EXPECT_EQ(seen.steps[i].first.step, static_cast<int>(i));
    EXPECT_DOUBLE_EQ(seen.steps[i].first.commanded.value(), commanded[i]);
    EXPECT_NEAR(seen.steps[i].second.speed_rad_s, commanded[i], 0.05 * commanded[i] + 5);
  }
}

TEST(ReplayedRun, SubtractsTheZeroAndCountsEverySample) {
  const Seen seen = shown();
  double zero_sum = 0;
  int zeros = 0;
  for (const auto& [position, observation] : seen.ticks) {
    if (position.phase == "zero" && seen.steps.empty() == false && position.remaining_s > 1) {
      zero_sum += observation.thrust_n;
      ++zeros;
    }
  }
  ASSERT_GT(zeros, 0);
  EXPECT_NEAR(zero_sum / zeros, 0, 0.05);
  EXPECT_GT(seen.steps.back().second.thrust_n, 0.5);
  EXPECT_GT(seen.steps.back().second.judged[Watched::force_z], 0.5);
  EXPECT_GT(seen.steps.back().second.judged[Watched::motor_current], 0.5);
  EXPECT_EQ(seen.ticks.back().second.account.received, recording().load_cell.size());
  EXPECT_EQ(seen.ticks.back().first.remaining_s, 0);
}

TEST(ReplayedRun, HasTheLimitsOfItsCampaignAndCannotBeStopped) {
  results::RunRecording told = recording();
  told.header.motor_parameters = "power_safety.motor_current_high: 60  # A\n";  // of a run file since format 3
  const Subject subject = subject_of(told);
  EXPECT_TRUE(subject.replay);
  const auto source_of = [&](Watched watched) {
    for (const GuardLimit& limit : subject.limits)
      if (limit.watched == watched) return limit.source;
    return std::string();
  };
  EXPECT_EQ(source_of(Watched::thrust), "campaign limits.thrust_max_n");
  EXPECT_EQ(source_of(Watched::force_z), "device load cell, 110 % of its range");
  EXPECT_EQ(source_of(Watched::motor_current), "device motor power_safety.motor_current_high");
  EXPECT_EQ(source_of(Watched::pause), "") << "nobody recorded it";
  results::RunRecording older = recording();
  older.header.campaign_text = "of another time";
  EXPECT_TRUE(subject_of(older).limits.empty());
  EXPECT_EQ(subject_of(older).propeller, recording().header.propeller_name);
}

TEST(ReplayedRun, IsPlayedToItsEndOrUntilAsked) {
  ManualClock clock;
  Progress nobody;
  EXPECT_TRUE(play(recording(), clock, nobody, 1000, [] { return false; }));
  EXPECT_EQ(clock.now().count(), recording().load_cell.back().arrival_ns);
  EXPECT_FALSE(play(recording(), clock, nobody, 1, [] { return true; }));
}

TEST(LiveView, TellsHowTheWorkEndedAndLetsItsErrorPass) {
  LiveSession view({}, subject_of(recording()));
  EXPECT_EQ(view.url(), "");
  EXPECT_EQ(view.tell_the_end([] { return 7; }), 7);
  EXPECT_THROW(view.tell_the_end([]() -> int { throw std::runtime_error("no"); }), std::runtime_error);
  EXPECT_FALSE(view.stop_asked());
}

}  // namespace replayed_run_test
}  // namespace kphi::daq::live
