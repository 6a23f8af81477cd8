#include "daq/guard/rest_guard.hpp"

#include <gmock/gmock.h>

#include "daq/guard/run_stopped.hpp"
#include "test/daq/bench_fixture.hpp"
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
  [[nodiscard]] std::shared_ptr<void> run_periodically(const ThreadRole&, std::function<void()> called) override {
    work = std::move(called);
    return nullptr;
  }
  void show(MotorChannel channel, double value) { readings.push_back({channel, time.now().count(), 0, value}); }
  [[nodiscard]] double seconds() const { return to_seconds(time.now()); }

  std::function<double()> speed;
  std::function<void()> work;
};

template <class Call>
std::string reason_of(Call&& act) {
  return test::words_of<SafetyStop>(act);
}

TEST(RestGuard, WaitsUntilARotorThatCoastsIsSeenAtRest) {
  RestingBench bench;
  bench.speed = [&] { return 340 - 100 * bench.seconds(); };
  RestGuard guard(bench, true);
  guard.await_rest(test::never);
  EXPECT_NEAR(bench.seconds(), 3.36, 0.03);
  EXPECT_EQ(bench.queue_motor.coasted, 0);
}

TEST(RestGuard, BelievesNoReadingFromBefore) {
  RestingBench bench;
  for (int i = 0; i < 10; ++i) bench.show(MotorChannel::speed, 0);
  bench.time.advance(std::chrono::seconds(1));
  bench.speed = [&] { return bench.seconds() < 3 ? 341.0 : 0.0; };
  RestGuard(bench, true).await_rest(test::never);
  EXPECT_GE(bench.seconds(), 3);
}

TEST(RestGuard, AsksNobodyToComeNearARotorThatDoesNotComeToRestOrThatNobodySees) {
  RestingBench turning, unseen;
  turning.speed = [] { return 341.0; };
  for (const auto& [bench, words] :
       {std::pair(&turning, "still turning at 3256 RPM after 30 s"), std::pair(&unseen, "it may be turning")}) {
    RestGuard guard(*bench, true);
    EXPECT_THAT(reason_of([&] { guard.await_rest(test::never); }), HasSubstr(words));
  }
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
    guard_->await_rest(test::never);
  }
  void pass() { bench_.wait_until(bench_.time.now() + std::chrono::milliseconds(20)); }
  std::string reason() {
    return reason_of([&] { guard_->check(); });
  }
  /// Next.
  void expect_trip(const std::string& words) {
    pass();
    EXPECT_THAT(reason(), HasSubstr(words));
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
  expect_trip("turning at 191 RPM while somebody may be near");
}

TEST_F(AtAPrompt, ASpeedThatIsNoNumberTrips) {
  speed_ = std::nan("");
  expect_trip("turning");
}

TEST_F(AtAPrompt, AModuleThatDrivesTrips) {
  bench_.show(MotorChannel::drive_mode, 3);
  expect_trip("does not coast");
}

TEST_F(AtAPrompt, ASleepOfTheComputerTrips) {
  bench_.time.suspend(std::chrono::seconds(5));
  expect_trip("this computer slept for 5 s");
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
  expect_trip("output is on while somebody may be near");
}

}  // namespace rest_guard_test
}  // namespace kphi::daq
