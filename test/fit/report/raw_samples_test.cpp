#include "fit/report/raw_samples.hpp"

#include <gtest/gtest.h>

#include <numeric>

#include "test/fit/campaign_steps.hpp"
#include "test/temporary_folder.hpp"

namespace kphi::fit {
namespace raw_samples_test {

using test::TemporaryFolder;

/// 1 kHz for 4 s; Fz reads −(second) N in counts, so every second has its own level.
results::RunRecording recording() {
  results::RunRecording run;
  run.header.thrust_sign = -1;
  run.header.load_cell.counts_per_newton = 1e6;
  for (int i = 0; i < 4000; ++i) {
    LoadCellRecord record;
    record.arrival_ns = std::int64_t{i} * 1'000'000;
    record.counts[2] = -1'000'000 * (i / 1000) - (i % 2) * 1000;
    run.load_cell.push_back(record);
  }
  return run;
}

std::vector<double> samples_of(const results::StepMean& step, std::size_t most) {
  return thrust_samples(recording(), recording().load_cell, step, most);
}

results::StepMean step() {
  results::StepMean result;
  result.window_begin_s = 2;
  result.window_end_s = 2.9995;
  result.thrust_n = 1.75;  // with a zero taken off, whatever its sign
  return result;
}

TEST(RawSamples, ScatterAboutTheStepsMeanInsideItsWindow) {
  const auto samples = samples_of(step(), 10000);
  ASSERT_EQ(samples.size(), 1000u);
  EXPECT_NEAR(std::accumulate(samples.begin(), samples.end(), 0.0) / 1000, 1.75, 1e-9);
  EXPECT_NEAR(samples[1] - samples[0], 0.001, 1e-12) << "the sign of the axis is applied";
}

TEST(RawSamples, AreAsManyAsWantedAndNoneOutsideTheRun) {
  for (const std::size_t most : {100u, 666u}) EXPECT_EQ(samples_of(step(), most).size(), most);
  auto late = step();
  late.window_begin_s = 10;
  late.window_end_s = 11;
  EXPECT_TRUE(samples_of(late, 100).empty());
}

TEST(RawSamples, OfAWholeRunAreMeansFromItsBeginningToItsEndWithTheZeroOfTheStep) {
  results::RunRecording run = recording();
  run.phases = {{results::Phase::zero_before, -1, 0, 0}};
  for (int i = 0; i < 200; ++i) run.motor.push_back({MotorChannel::speed, std::int64_t{i} * 20'000'000, 0, -100.0 - i});
  const Settling whole = whole_run(run, run.load_cell, step()).value();
  ASSERT_NEAR(static_cast<double>(whole.thrust_n.size()), 800, 2);
  EXPECT_LT(whole.thrust_n.front().time_s, 0.01);
  EXPECT_GT(whole.thrust_n.back().time_s, 3.99);
  const auto at_2_5_s = whole.thrust_n.at(500).value;
  EXPECT_NEAR(at_2_5_s, 1.75, 0.001);
  EXPECT_NEAR(whole.thrust_n.back().value - at_2_5_s, 1, 0.001);
  ASSERT_EQ(whole.speed_rad_s.size(), 200u);
  EXPECT_NEAR(whole.speed_rad_s.back().value, 299, 1e-9) << "unsigned";
}

TEST(RawSamples, AreNotShownWhenARunIsMissing) {
  const TemporaryFolder folder;
  const RawSamples raw =
      read_raw_samples(identify(campaign_steps()), {{"runs/5x3_phi000_rep1.h5", "", "", std::nullopt}}, folder.path());
  EXPECT_TRUE(raw.shares.empty());
  ASSERT_EQ(raw.runs.size(), 1u);
  EXPECT_FALSE(raw.runs[0].account);
}

}  // namespace raw_samples_test
}  // namespace kphi::fit
