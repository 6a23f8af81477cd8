// The guard's own cut of the supply, alone: no sequence, nobody who owns the power and lets go of it, and a motor that
// obeys no order. What dies in the motor dies of the cut.
#include <gtest/gtest.h>

#include "daq/guard/guard.hpp"
#include "test/daq/bench_fixture.hpp"
#include "test/daq/coasting_bench.hpp"

namespace kphi::daq {
namespace guard_cut_test {

using std::chrono::milliseconds;

constexpr double kTurning = 5;                  // A in the winding, at the least
constexpr Duration kPause = milliseconds(400);  // that a runner may stand still
constexpr Duration kCut = milliseconds(50);     // from the trip until no current flows

class GuardsCut : public testing::Test {
 protected:
  GuardsCut() {
    bench_.mounted("5x3", 0);
    scale_ = bench_.load_cell().start();
    bench_.bench.motor().spin_at(from_rpm(16000));
    while (clock().now() < milliseconds(3000)) bench_.wait_until(clock().now() + milliseconds(1));
    bench_.spoilt_motor.is_deaf = true;
  }
  [[nodiscard]] const Clock& clock() const { return bench_.clock(); }
  [[nodiscard]] double winding_amps() { return std::abs(bench_.bench.simulation().plant().motor().motor_amps); }
  [[nodiscard]] bool is_on() { return bench_.bench.simulation().supply()->circuit().output(); }
  /// The guard looks every 5 ms, as its thread would; nobody else does anything.
  void look_for(Guard& guard, Duration duration) {
    for (const Instant end = clock().now() + duration; clock().now() < end;) {
      guard.poll();
      bench_.wait_until(clock().now() + milliseconds(5));
    }
  }

  const profiles::BenchConfig config_ = test::with_supply(test::deterministic_config(4));
  const profiles::Campaign campaign_ = test::short_campaign();
  CoastingBench bench_{config_};
  results::LoadCellScale scale_;
};

TEST_F(GuardsCut, AloneTakesTheCurrentFromAMotorThatObeysNobodyWhoseRunnerHangs) {
  ASSERT_TRUE(is_on());
  ASSERT_GT(winding_amps(), kTurning);
  Guard guard(bench_, config_, scale_, combine_limits(campaign_, config_));
  guard.check(true);  // for the last time
  look_for(guard, kPause - milliseconds(20));
  ASSERT_EQ(guard.latch().trip(), nullptr) << guard.latch().trip()->reason;
  EXPECT_TRUE(is_on());
  EXPECT_GT(winding_amps(), kTurning);

  look_for(guard, milliseconds(40) + kCut);
  const Trip* trip = guard.latch().trip();
  ASSERT_NE(trip, nullptr);
  EXPECT_EQ(trip->watched, Watched::pause) << trip->reason;
  EXPECT_EQ(bench_.spoilt_motor.ignored, 1) << "the order to coast, which nobody obeys";
  EXPECT_FALSE(is_on());
  EXPECT_LT(winding_amps(), CoastingBench::kNothing);
  EXPECT_LE(bench_.coasts_at - trip->noticed, kCut);
}

TEST_F(GuardsCut, IsMissedByAMotorThatOnlyItsOrderReaches) {
  Guard guard(bench_, config_, scale_, combine_limits(campaign_, config_));
  guard.stand_down();
  guard.check(true);
  look_for(guard, 2 * kPause);
  EXPECT_TRUE(is_on());
  EXPECT_GT(winding_amps(), kTurning) << "nothing but the guard would end this";
}

}  // namespace guard_cut_test
}  // namespace kphi::daq
