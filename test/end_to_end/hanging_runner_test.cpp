// A runner that hangs in the middle of a step, on a bench over its true transports: the guard's thread lets the motor
// go.
#include <gmock/gmock.h>

#include <atomic>
#include <future>

#include "daq/guard/interlock.hpp"
#include "daq/run/run.hpp"
#include "test/end_to_end/running_bench.hpp"
#include "test/soon.hpp"

namespace kphi::test::hanging_runner_test {

using testing::HasSubstr;

constexpr double kSoonerThanByPause = 300;  // ms; a runner that hangs is let go after 400 ms for that alone

class HangingRunner : public testing::Test {
 protected:
  HangingRunner() : place_(profiles::load_bench(simulation_.path("bench.yaml"))), bench_(daq::connect(place_)) {
    bench_->mounted("5x3", 0);
    campaign_.profile.dwell = Seconds(1.5);
  }
  ~HangingRunner() override { release(); }

  /// Records a run whose runner hangs once the motor turns, until release().
  void record() {
    run_ = std::async(std::launch::async, [this]() -> std::string {
      daq::Progress progress;
      try {
        (void)daq::record_run(*bench_, test::first_run(campaign_, place_, simulation_.path("run.h5")), progress,
                              [this] {
                                if (turns_) {
                                  hangs_ = true;
                                  go_on_.get_future().wait();
                                  turns_ = false;
                                }
                                return false;
                              });
      } catch (const daq::SafetyStop& stop) {
        return stop.what();
      }
      return "nothing stopped the run";
    });
  }
  void hang() {
    ASSERT_TRUE(simulation_.await_speed(500));
    turns_ = true;
    ASSERT_TRUE(soon([&] { return hangs_.load(); }));
  }
  void release() {
    if (!std::exchange(released_, true)) go_on_.set_value();
  }
  [[nodiscard]] bool coasts() const { return simulation_.status()["drive"]["mode"] == "coast"; }

  RunningBench simulation_{Manner{1, 7000, "  []\n", true}};
  profiles::Campaign campaign_ = short_campaign();
  profiles::BenchConfig place_;
  std::unique_ptr<daq::Bench> bench_;
  std::atomic<bool> turns_{false}, hangs_{false};
  std::promise<void> go_on_;
  bool released_ = false;
  std::future<std::string> run_;
};

TEST_F(HangingRunner, DoesNotKeepTheGuardFromLettingTheMotorGo) {
  record();
  hang();
  EXPECT_TRUE(soon([&] { return coasts(); })) << "while the runner hangs";
  release();
  EXPECT_THAT(run_.get(), HasSubstr("kphi was blocked for"));
}

/// What the supply shows is read eight times a second.
TEST_F(HangingRunner, DoesNotKeepTheGuardFromSeeingThatAKnobIsTurned) {
  record();
  hang();
  const double turned_ms = simulation_.fault("kind=supply_panel register=9 value=2000");
  EXPECT_TRUE(soon([&] { return coasts(); })) << "while the runner hangs";
  release();
  EXPECT_THAT(run_.get(), HasSubstr("changed on the front panel"));
  const double after_ms = simulation_.account().coasts_at() - turned_ms;
  fmt::print("coasts {:.1f} ms after the knob was turned, its runner hanging\n", after_ms);
  EXPECT_LT(after_ms, kSoonerThanByPause);
}

}  // namespace kphi::test::hanging_runner_test
