#include "daq/guard/rest_guard.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "daq/guard/run_stopped.hpp"
#include "test/daq/queue_bench.hpp"

namespace kphi::daq {
namespace rest_guard_test {

using testing::HasSubstr;

/// A bench whose rotor shows what a test lets it show, read every 10 ms of its time.
class RestingBench final : public QueueBench {
 public:
  void wait_until(Instant when) override {
    time.set(when);
    if (speed) show(MotorChannel::speed, speed());
    if (work) work();
  }
  [[nodiscard]] std::shared_ptr<void> run_periodically(std::function<void()> called) override {
    work = std::move(called);
    return nullptr;
  }
  void show(MotorChannel channel, double value) { readings.push_back({channel, time.now().count(), 0, value}); }
  [[nodiscard]] double seconds() const { return to_seconds(time.now()); }

  std::function<double()> speed;
  std::function<void()> work;
};

std::string reason_of(const std::function<void()>& act) {
  try {
    act();
  } catch (const SafetyStop& stop) {
    return stop.what();
  }
  return "";
}

const auto kNoStop = [] { return false; };

TEST(RestGuard, WaitsUntilARotorThatCoastsIsSeenAtRest) {
  RestingBench bench;
  bench.speed = [&] { return 340 - 100 * bench.seconds(); };
  RestGuard guard(bench, true);
  guard.await_rest(kNoStop);
  EXPECT_NEAR(bench.seconds(), 3.36, 0.03);
  EXPECT_EQ(bench.queue_motor.coasted, 0);
}

TEST(RestGuard, BelievesNoReadingFromBefore) {
  RestingBench bench;
  for (int i = 0; i < 10; ++i) bench.show(MotorChannel::speed, 0);
  bench.time.advance(std::chrono::seconds(1));
  bench.speed = [&] { return bench.seconds() < 3 ? 341.0 : 0.0; };
  RestGuard(bench, true).await_rest(kNoStop);
  EXPECT_GE(bench.seconds(), 3);
}

TEST(RestGuard, AsksNobodyToComeNearARotorThatDoesNotComeToRest) {
  RestingBench bench;
  bench.speed = [] { return 341.0; };
  RestGuard guard(bench, true);
  EXPECT_THAT(reason_of([&] { guard.await_rest(kNoStop); }), HasSubstr("still turning at 3256 RPM after 30 s"));
}

TEST(RestGuard, AsksNobodyToComeNearARotorThatNobodySees) {
  RestingBench bench;
  RestGuard guard(bench, true);
  EXPECT_THAT(reason_of([&] { guard.await_rest(kNoStop); }), HasSubstr("it may be turning"));
}

TEST(RestGuard, HearsThatSomebodyWantsToStop) {
  RestingBench bench;
  bench.speed = [] { return 341.0; };
  RestGuard guard(bench, true);
  EXPECT_THROW(guard.await_rest([] { return true; }), Interrupted);
}

/// At rest, with a person near.
class AtAPrompt : public testing::Test {
 protected:
  AtAPrompt() {
    bench_.speed = [this] { return speed_; };
    bench_.supply_link = &supply_;
    guard_.emplace(bench_, true);
    guard_->await_rest(kNoStop);
  }
  void pass() { bench_.wait_until(bench_.time.now() + std::chrono::milliseconds(20)); }
  std::string reason() {
    return reason_of([&] { guard_->check(); });
  }
  void expect_safe() {
    EXPECT_EQ(bench_.queue_motor.coasted, 1);
    EXPECT_EQ(supply_.cuts, 1);
  }

  double speed_ = 0;
  RestingBench bench_;
  QueueSupply supply_;
  std::optional<RestGuard> guard_;
};

TEST_F(AtAPrompt, NothingTripsWhileTheRotorIsAtRest) {
  for (int i = 0; i < 100; ++i) pass();
  EXPECT_EQ(reason(), "");
}

TEST_F(AtAPrompt, ATurningRotorTrips) {
  speed_ = -20;
  pass();
  EXPECT_THAT(reason(), HasSubstr("turning at 191 RPM while somebody may be near"));
  expect_safe();
}

TEST_F(AtAPrompt, ASpeedThatIsNoNumberTrips) {
  speed_ = std::nan("");
  pass();
  EXPECT_NE(reason(), "");
  expect_safe();
}

TEST_F(AtAPrompt, AModuleThatDrivesTrips) {
  bench_.show(MotorChannel::drive_mode, 3);
  pass();
  EXPECT_THAT(reason(), HasSubstr("does not coast"));
  expect_safe();
}

TEST_F(AtAPrompt, ASleepOfTheComputerTrips) {
  bench_.time.suspend(std::chrono::seconds(5));
  pass();
  EXPECT_THAT(reason(), HasSubstr("this computer slept for 5 s"));
  expect_safe();
}

TEST_F(AtAPrompt, AModuleWhosePowerAPersonHasCutIsNoTrip) {
  bench_.speed = nullptr;
  bench_.queue_motor.lost = "the module stopped answering";
  for (int i = 0; i < 100; ++i) pass();
  EXPECT_EQ(reason(), "");
}

TEST_F(AtAPrompt, AnOutputThatComesOnUnaskedTripsButNoReadingFromBefore) {
  guard_.emplace(bench_, false);
  SupplyReading on;
  on.time_ns = bench_.time.now().count() - 1;
  on.output = 1;
  supply_.readings.push_back(on);
  pass();
  EXPECT_EQ(reason(), "");
  on.time_ns = bench_.time.now().count() + 1;
  supply_.readings.push_back(on);
  pass();
  EXPECT_THAT(reason(), HasSubstr("output is on while somebody may be near"));
  expect_safe();
}

}  // namespace rest_guard_test
}  // namespace kphi::daq
