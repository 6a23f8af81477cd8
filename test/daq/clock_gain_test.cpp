// A module whose clock is off by half a percent, and a bench file that knows it.
#include <gtest/gtest.h>

#include "daq/run/run.hpp"
#include "daq/virtual/deterministic_bench.hpp"
#include "results/reduction/reduction.hpp"
#include "results/run_reader.hpp"
#include "test/daq/bench_fixture.hpp"

namespace kphi::daq {
namespace clock_gain_test {

TEST(ClockGain, GivesTrueSpeedsFromAModuleWhoseClockIsFast) {
  std::string text = test::deterministic_config(3).text;
  text.replace(text.find("speed_max_rpm: 19300"), 20, "speed_max_rpm: 19300, clock_gain: {factor: 1.005, u: 1e-5}");
  const profiles::BenchConfig config = profiles::parse_bench(text, "bench.yaml");
  std::string profile = test::short_campaign_text("0", 1, 3);
  profile.replace(profile.find("dwell_s: 0.6"), 12, "dwell_s: 3.0");
  const profiles::Campaign campaign = profiles::parse_campaign(profile, "slow.yaml");
  sim::BenchSettings fast;
  fast.oscillator_gain = 0.005;
  DeterministicBench bench(config, fast);
  bench.mounted("5x3", 0);
  std::vector<std::pair<double, double>> truth;  // time and the simulator's own speed at every tick of the runner
  test::SaidLines said;
  said.at_tick = [&](const Position&, const Observation&) {
    truth.emplace_back(to_seconds(bench.clock().now()), bench.simulation().plant().motor().speed);
  };
  const test::TemporaryFolder folder;
  const auto file = folder.path() / "run.h5";
  (void)record_run(bench, test::first_run(campaign, config, file), said, test::never);
  const auto steps = reduce(results::read_run(file));
  ASSERT_EQ(steps.size(), 3u);
  for (const auto& step : steps) {
    double sum = 0;
    int n = 0;
    for (const auto& [time, speed] : truth) {
      if (time < step.window_begin_s || time >= step.window_end_s) continue;
      sum += speed;
      ++n;
    }
    const double true_mean = sum / n;
    EXPECT_NEAR(step.speed_rad_s, true_mean, 2e-4 * true_mean);
    EXPECT_NEAR(true_mean, 1.005 * step.commanded_speed_rad_s, 1e-3 * true_mean) << "it holds what it reports";
    EXPECT_EQ(step.quality_flags, 0u);
  }
}

}  // namespace clock_gain_test
}  // namespace kphi::daq
