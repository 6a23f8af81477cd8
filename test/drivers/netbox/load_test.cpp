// More records than any box sends, and a host that has other things to do: shorter than the benchmarks of the same
// name.
#include <gtest/gtest.h>

#include "test/drivers/netbox/busy_loops.hpp"
#include "test/drivers/netbox/receivers.hpp"

namespace kphi::netbox::load_test {

using namespace std::chrono_literals;
using namespace test;

/// One undisturbed pair out of ten is enough: what else the machine does makes the receiver dearer, the median and the
/// worst of many pairs are the benchmark's.
void expect_cheap(bool buffered) {
  const BoxProcess box({.records_per_datagram = buffered ? 40u : 1u, .speed = kHasteHz / 7000});
  std::vector<double> ratios;
  for (int i = 0; i < 10 && (ratios.empty() || ratios.back() > 1.5); ++i) {
    const std::optional<Pair> pair = measure_pair(box, buffered, 0.3);
    if (!pair) continue;
    EXPECT_EQ(pair->driver.lost, 0u);
    ratios.push_back(pair->ratio());
  }
  ASSERT_FALSE(ratios.empty()) << "in ten trials this computer did not send 200 000 records per second";
  EXPECT_LE(ratios.back(), 1.5) << "median of " << ratios.size() << " pairs: " << median(ratios);
}

TEST(Load, ABufferedRecordCostsAtMostHalfAsMuchAgainAsInABareLoop) { expect_cheap(true); }
TEST(Load, ASingleRecordCostsAtMostHalfAsMuchAgainAsInABareLoop) { expect_cheap(false); }

TEST(Load, BesideTwoBusyLoopsNothingIsLostAndNothingIsOld) {
  const BoxProcess box({});
  const BusyLoops busy(2);
  const SteadyClock clock;
  Driver driver(box.ports(), clock);
  driver.keep_ages = true;
  const Cost cost = driver.run(3, Driver::Consumer::waits);
  EXPECT_EQ(cost.lost, 0u);
  EXPECT_TRUE(driver.in_order);
  EXPECT_GT(cost.records, 15'000u);
  EXPECT_LT(driver.age(99), 20ms);
}

}  // namespace kphi::netbox::load_test
