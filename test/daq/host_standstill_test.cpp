// The host stands still in the middle of a run: short enough, and what it finds afterwards is older than anything may
// be, yet all of it waits to be taken; too long, and nobody knows what the motor did meanwhile.
#include <gmock/gmock.h>

#include "daq/guard/interlock.hpp"
#include "daq/run/run.hpp"
#include "results/run_reader.hpp"
#include "test/daq/bench_fixture.hpp"
#include "test/daq/wrapped_bench.hpp"

namespace kphi::daq {
namespace host_standstill_test {

using std::chrono::milliseconds;

/// The deterministic bench under a host whose threads all stand still once.
class SleepyBench final : public WrappedBench {
 public:
  explicit SleepyBench(const profiles::BenchConfig& config) : WrappedBench(config) { bench.mounted("5x3", 0); }

  void wait_until(Instant when) override {
    if (clock().now() >= sleeps_at && !slept_) {
      slept_ = asleep_ = true;
      bench.wait_until(clock().now() + sleeps_for);
      asleep_ = false;
      return;
    }
    if (slept_ && !woken_) {  // the other threads wake as soon as the runner's
      woken_ = true;
      for (const auto& work : work_) (*work)();
    }
    bench.wait_until(when);
  }
  [[nodiscard]] std::shared_ptr<void> run_periodically(const ThreadRole& role, std::function<void()> work) override {
    work_.push_back(std::make_shared<std::function<void()>>(std::move(work)));
    return bench.run_periodically(role, [this, work = work_.back()] {
      if (!asleep_) (*work)();
    });
  }

  Instant sleeps_at = std::chrono::seconds(2);
  Duration sleeps_for{0};

 private:
  std::vector<std::shared_ptr<std::function<void()>>> work_;
  bool slept_ = false, asleep_ = false, woken_ = false;
};

class HostStandstill : public testing::Test {
 protected:
  RunResult record(Duration sleeps_for) {
    bench_.sleeps_for = sleeps_for;
    return record_run(bench_, test::first_run(campaign_, config_, folder_.path() / "run.h5"), progress_, test::never);
  }

  test::TemporaryFolder folder_;
  profiles::Campaign campaign_ = test::short_campaign();
  profiles::BenchConfig config_ = test::deterministic_config(1);
  SleepyBench bench_{config_};
  Progress progress_;
};

TEST_F(HostStandstill, OfAQuarterOfASecondIsSeenTwiceAndBorneSinceAllOfItWaits) {
  const RunResult result = record(milliseconds(250));
  EXPECT_EQ(result.account.lost_network + result.account.lost_host, 0u);
  EXPECT_EQ(results::read_run(result.file).outcome, results::Outcome::complete);
}

TEST_F(HostStandstill, OfHalfASecondEndsTheRunWithTheMotorCoasting) {
  EXPECT_THAT([&] { (void)record(milliseconds(500)); },
              testing::ThrowsMessage<SafetyStop>(testing::HasSubstr("for 0.5")));
  bench_.bench.wait_until(bench_.clock().now() + std::chrono::seconds(1));
  EXPECT_EQ(bench_.bench.simulation().motor().stage().mode, sim::PowerStage::Mode::coast);
}

TEST_F(HostStandstill, BeforeTheMotorTurnsHarmsNothing) {
  bench_.sleeps_at = milliseconds(400);
  EXPECT_EQ(results::read_run(record(milliseconds(450)).file).outcome, results::Outcome::complete);
}

}  // namespace host_standstill_test
}  // namespace kphi::daq
