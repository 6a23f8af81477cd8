// An hour of clean simulated running, in virtual time: the guard finds nothing.
#include <gtest/gtest.h>

#include "daq/run/run.hpp"
#include "daq/virtual/deterministic_bench.hpp"
#include "results/run_reader.hpp"
#include "test/daq/bench_fixture.hpp"

namespace kphi::daq {
namespace guard_long_test {

/// 30 minutes, 300 changes of speed. At 1 kHz, so that the file stays small; the physics and the noise go on at 7 kHz.
void run_clean(double first_rpm, double last_rpm, bool supply) {
  const test::TemporaryFolder folder;
  profiles::BenchConfig config = test::deterministic_config(11);
  config.netbox.rate_hz = 1000;
  config.netbox.records_per_datagram = 10;
  if (supply)
    config.supply = profiles::SupplyConfig{"modbus-rtu:/dev/null", Volts(12), Amperes(24), Volts(14), Amperes(24)};
  profiles::Campaign campaign = test::short_campaign();
  campaign.profile = {300, Seconds(6), from_rpm(first_rpm), from_rpm(last_rpm)};
  campaign.limits["torque_max_nm"] = 0.15;
  campaign.limits["supply_voltage_min_v"] = 10.5;
  campaign.limits["supply_voltage_max_v"] = 14;
  DeterministicBench bench(config);
  bench.mounted("5x3", 0);
  Progress progress;
  const RunResult result =
      record_run(bench, test::first_run(campaign, config, folder.path() / "run.h5"), progress, test::never);
  EXPECT_EQ(result.account.lost_network + result.account.lost_host, 0u);
  EXPECT_GT(bench.clock().now(), std::chrono::minutes(30));
}

TEST(AnHourOfCleanRunning, TripsNothingOnTheWayUp) { run_clean(100, 19100, true); }
TEST(AnHourOfCleanRunning, TripsNothingOnTheWayDown) { run_clean(19100, 100, false); }

}  // namespace guard_long_test
}  // namespace kphi::daq
