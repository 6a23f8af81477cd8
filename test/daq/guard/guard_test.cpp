// What the guard does without a runner, and without a recorder. How soon: guard_timing_test.cpp.
#include "daq/guard/guard.hpp"

#include <gmock/gmock.h>

#include <algorithm>

#include "test/daq/bench_fixture.hpp"
#include "test/daq/queue_bench.hpp"

namespace kphi::daq {
namespace guard_test {

using std::chrono::milliseconds;
using testing::HasSubstr;
using testing::StartsWith;

/// The guard by itself, on a bench of queues.
class GuardAlone : public testing::Test {
 protected:
  void sample(double fz_n, Instant at) {
    LoadCellRecord record = load_of(fz_n);
    record.status = status_;
    record.arrival_ns = at.count();
    bench_.records.push_back(record);
  }
  void samples(double fz_n, int n) {
    for (int i = 0; i < n; ++i) {
      bench_.time.set(bench_.time.now() + std::chrono::microseconds(1000) / 7);
      sample(fz_n, bench_.time.now());
    }
  }
  void reading(MotorChannel channel, double value) {
    bench_.readings.push_back({channel, bench_.time.now().count(), 0, value});
  }
  void stand_still_for_a_second() {
    for (int i = 0; i < 50; ++i) {
      bench_.time.set(bench_.time.now() + milliseconds(20));
      reading(MotorChannel::speed, 0);
      sample(0, bench_.time.now());
    }
    guard_.poll();
  }
  void expect_no_trip() {
    guard_.poll();
    EXPECT_EQ(reason(), "");
    EXPECT_EQ(bench_.queue_motor.coasted, 0);
  }
  void expect_trip(const testing::Matcher<std::string>& told) {
    guard_.poll();
    EXPECT_THAT(reason(), told);
    EXPECT_EQ(bench_.queue_motor.coasted, 1);
  }
  [[nodiscard]] std::string reason() const { return guard_.latch().trip() ? guard_.latch().trip()->reason : ""; }

  std::uint32_t status_ = 0;  ///< of the next samples
  QueueBench bench_;
  profiles::Campaign campaign_ = test::short_campaign();
  profiles::BenchConfig config_ = test::deterministic_config(1);
  Guard guard_{bench_, config_, mini40(), combine_limits(campaign_, config_)};
};

TEST_F(GuardAlone, NeedsNeitherRunnerNorRecorderToLetTheMotorGo) {
  guard_.take_zero({});
  samples(6, 100);
  expect_no_trip();
  samples(21, 100);
  expect_trip(HasSubstr("is above 20 N (campaign limits.thrust_max_n)"));
  EXPECT_EQ(guard_.latch().trip()->watched, Watched::thrust);
  EXPECT_THROW(guard_.check(true), SafetyStop);
}

TEST_F(GuardAlone, MissesNothingThatCameAndWentBetweenTwoLooks) {
  guard_.take_zero({});
  samples(6, 100);
  samples(25, 60);
  samples(6, 1000);
  expect_trip(StartsWith("thrust"));
}

TEST_F(GuardAlone, TakesTheTareOffThrust) {
  guard_.take_zero({0, 0, 18, 0, 0, 0});
  samples(24, 100);
  expect_no_trip();
  samples(39, 100);
  expect_trip(StartsWith("thrust"));
}

TEST_F(GuardAlone, PassesEverythingOnInOrderAlsoAfterATrip) {
  guard_.take_zero({});
  samples(30, 3000);
  reading(MotorChannel::coil_temperature, 200);
  reading(MotorChannel::speed, 100);
  bench_.events.push_back({EventKind::restarted, 5, 0, "the stream began anew"});
  guard_.poll();
  std::vector<LoadCellRecord> records(5000);
  ASSERT_EQ(guard_.take(std::span(records)), 3000u);
  EXPECT_TRUE(std::is_sorted(records.begin(), records.begin() + 3000,
                             [](const auto& a, const auto& b) { return a.arrival_ns < b.arrival_ns; }));
  std::vector<MotorReading> readings(10);
  EXPECT_EQ(guard_.take(std::span(readings)), 2u);
  EXPECT_EQ(guard_.take_events().at(0).text, "the stream began anew");
  EXPECT_EQ(bench_.queue_motor.coasted, 1) << "once";
}

TEST_F(GuardAlone, LeavesWithTheDevicesWhatARecorderThatIsStuckCannotTake) {
  for (int i = 0; i < 80'000; ++i) sample(6, bench_.time.now());
  guard_.poll();
  EXPECT_EQ(bench_.records.size(), 10'000u) << "10 s of 7 kHz are on their way";
  std::vector<LoadCellRecord> records(100'000);
  EXPECT_EQ(guard_.take(std::span(records)), 70'000u);
  guard_.poll();
  EXPECT_EQ(guard_.take(std::span(records)), 10'000u);
}

TEST_F(GuardAlone, TripsAtOverSpeedWhicheverWayTheRotorTurnsAndAtWhatIsNoNumber) {
  for (const double speed : {+2150.0, -2150.0, std::nan("")}) {
    Guard guard(bench_, config_, mini40(), combine_limits(campaign_, config_));
    reading(MotorChannel::speed, std::copysign(2000, speed));
    guard.poll();
    EXPECT_EQ(guard.latch().trip(), nullptr);
    reading(MotorChannel::speed, speed);
    guard.poll();
    ASSERT_NE(guard.latch().trip(), nullptr) << speed;
    EXPECT_EQ(guard.latch().trip()->watched, Watched::speed);
    EXPECT_THAT(guard.latch().trip()->reason, StartsWith("speed"));
  }
}

TEST_F(GuardAlone, TripsAtTheLeastDeratingButNotAtOneCountOfTheModule) {
  reading(MotorChannel::derate, 1 - 1.0 / 65536);
  expect_no_trip();
  reading(MotorChannel::derate, 0.999);
  expect_trip(StartsWith("motor: the module derates to 100 %"));
}

TEST_F(GuardAlone, JudgesNoSupplyReadingFromBeforeTheRun) {
  QueueSupply supply;
  bench_.supply_link = &supply;
  config_ = test::with_supply(config_);
  const SupplyReading off{1, 0, 0, 0, 12, 50, {}, SupplyProtection::over_current, 0};
  supply.readings.assign(100, off);
  Guard guard(bench_, config_, mini40(), combine_limits(campaign_, config_));
  guard.poll();
  EXPECT_EQ(guard.latch().trip(), nullptr);
  supply.readings.push_back(off);
  guard.poll();
  ASSERT_NE(guard.latch().trip(), nullptr);
  EXPECT_EQ(guard.latch().trip()->protection, SupplyProtection::over_current);
  EXPECT_EQ(supply.cuts, 1);
}

TEST_F(GuardAlone, TripsAtAnyFaultThatTheModuleReports) {
  reading(MotorChannel::fault_now, 0);
  expect_no_trip();
  reading(MotorChannel::fault_now, 0x42);
  reading(MotorChannel::fault_now, 0);
  expect_trip("motor: the module reports a fault (power_safety.fault_now 0x42)");
}

TEST_F(GuardAlone, SeesThatTheRotorDoesNotDoWhatItIsToldUntilTheStepsEnd) {
  guard_.mark({results::Phase::step, 0, bench_.time.now().count(), 500});
  guard_.poll();
  guard_.mark({results::Phase::spin_down, -1, bench_.time.now().count(), 0});
  stand_still_for_a_second();
  EXPECT_EQ(reason(), "");
  guard_.mark({results::Phase::step, 1, bench_.time.now().count(), 500});
  stand_still_for_a_second();
  EXPECT_THAT(reason(), HasSubstr(": 0 of 4775 RPM; "));
  EXPECT_EQ(guard_.latch().trip()->watched, Watched::speed_error);
  EXPECT_EQ(guard_.latch().trip()->step, 1);
}

TEST_F(GuardAlone, LetsTheMotorGoWhenTheBoxReportsAnErrorForMoreThanADatagram) {
  status_ = 0x88000000;
  samples(6, 1);
  expect_no_trip();  // this box sends one sample per datagram
  samples(6, 1);
  expect_trip(
      StartsWith("load cell: the Net Box reports \"serial link communication error\" (status 0x88000000) for "
                 "0.3 ms, so its samples cannot be trusted; "));
  ASSERT_TRUE(guard_.event());
  EXPECT_EQ(guard_.latch().trip()->watched, Watched::state);
  EXPECT_EQ(guard_.event()->kind, EventKind::guard_trip);
}

TEST_F(GuardAlone, TellsOnceWhatTheBoxReportedAndWhenThatEnded) {
  for (int hiccup = 0; hiccup < 3; ++hiccup) {
    status_ = 0x80000004;
    samples(6, 1);
    status_ = 0;
    samples(6, 50);
  }
  expect_no_trip();
  const auto events = guard_.take_events();
  ASSERT_EQ(events.size(), 2u);
  EXPECT_EQ(events[0].kind, EventKind::box_error);
  EXPECT_THAT(events[0].text, HasSubstr("the Net Box reports \"internal temperature error\" (status 0x80000004)"));
  EXPECT_EQ(events[1].kind, EventKind::box_error_ended);
}

TEST_F(GuardAlone, BearsASaturatedCellAtRestButTurnsNoMotorOnIt) {
  status_ = 0x80020000;
  samples(6, 7000);
  expect_no_trip();  // the zero that is taken of nothing is refused by itself
  guard_.check(true);
  samples(6, 1);
  expect_trip(HasSubstr("\"transducer saturation or A/D error\""));
}

TEST_F(GuardAlone, BearsALatchedMonitorCondition) {
  guard_.check(true);
  status_ = 0x80010000;
  samples(6, 2000);
  expect_no_trip();
  EXPECT_TRUE(guard_.take_events().empty());
}

TEST_F(GuardAlone, LooksTwiceBeforeItBelievesASilence) {
  guard_.check(true);
  bench_.time.set(milliseconds(300));
  expect_no_trip();  // this host may have stood still, and all of it waits
  sample(6, milliseconds(300));
  reading(MotorChannel::speed, 100);
  bench_.time.set(milliseconds(320));
  guard_.check(true);
  expect_no_trip();
  while (bench_.time.now() <= milliseconds(300) + spin_patience(config_)) {
    guard_.poll();
    bench_.time.set(bench_.time.now() + milliseconds(50));
    guard_.check(true);
  }
  expect_no_trip();
  bench_.time.set(bench_.time.now() + milliseconds(20));
  expect_trip(HasSubstr("age of the newest load-cell sample"));
}

TEST_F(GuardAlone, HasMorePatienceWhileNothingTurns) {
  bench_.time.set(milliseconds(490));
  guard_.poll();
  bench_.time.set(milliseconds(499));
  expect_no_trip();
  bench_.time.set(milliseconds(530));
  guard_.poll();
  bench_.time.set(milliseconds(550));
  expect_trip(HasSubstr("age of the newest load-cell sample"));
}

TEST_F(GuardAlone, LetsTheMotorGoWhenTheRunnerLooksNoMore) {
  guard_.check(true);
  bench_.time.set(milliseconds(390));
  sample(6, bench_.time.now());
  reading(MotorChannel::speed, 100);
  expect_no_trip();
  bench_.time.set(milliseconds(410));
  expect_trip("kphi was blocked for 0.41 s while the motor was turning");
}

TEST_F(GuardAlone, TellsTheComputerThatDidNotRunFromTheRunnerThatHangs) {
  guard_.check(true);
  bench_.time.set(milliseconds(5000));
  expect_trip("this computer did not run kphi for 5 s");
}

TEST_F(GuardAlone, LetsTheMotorGoWhenTheComputerSleptThoughItsClockStoodStillMeanwhile) {
  guard_.check(true);
  bench_.time.suspend(milliseconds(200));
  expect_trip("this computer slept for 0.2 s");
}

TEST_F(GuardAlone, LetsTheMotorGoWhenAStretchOfSamplesIsMissing) {
  const auto sample_number = [&](std::uint32_t number) {
    sample(6, bench_.time.now());
    bench_.records.back().ft_sequence = number;
    guard_.poll();
  };
  guard_.check(true);
  sample_number(1000);
  sample_number(1900);
  EXPECT_EQ(bench_.queue_motor.coasted, 0) << "0.129 s";
  sample_number(400);
  EXPECT_EQ(bench_.queue_motor.coasted, 0) << "the box started again: others tell";
  sample_number(1500);
  expect_trip(StartsWith("gap in the load cell's samples 0.1571 s is above 0.145 s"));
}

TEST_F(GuardAlone, IsMissedByTheRunnerWhenItLooksNoMore) {
  for (int ms = 0; ms <= 400; ms += 10) {
    bench_.time.set(milliseconds(ms));
    EXPECT_NO_THROW(guard_.check(true));
  }
  bench_.time.set(milliseconds(410));
  EXPECT_THROW(guard_.check(true), SafetyStop);
  EXPECT_EQ(bench_.queue_motor.coasted, 1);
}

TEST_F(GuardAlone, NamesTheComputerThatDidNotRunItAsTheCauseOfWhatSeemsLate) {
  guard_.check(true);
  for (int ms = 0; ms <= 20; ms += 5) {
    bench_.time.set(milliseconds(ms));
    guard_.poll();
  }
  bench_.time.set(milliseconds(220));  // not run for 0.2 s; nothing waits in the sockets either
  guard_.poll();
  EXPECT_EQ(reason(), "");
  bench_.time.set(milliseconds(241));
  expect_trip(StartsWith("this computer did not run kphi for 0.2 s; then: age of the newest load-cell sample 0.241 s"));
  EXPECT_EQ(guard_.latch().trip()->source, Source::computer);
  EXPECT_THAT(next_move(*guard_.latch().trip()), StartsWith("close other programs"));
}

TEST_F(GuardAlone, NamesADeviceThatIsLateLongAfterTheComputerWas) {
  guard_.check(true);
  bench_.time.set(milliseconds(200));
  guard_.poll();
  for (int ms = 205; ms <= 1500; ms += 5) {
    bench_.time.set(milliseconds(ms));
    if (ms < 1300) {
      guard_.check(true);
      sample(6, bench_.time.now());
    }
    reading(MotorChannel::speed, 0);
    guard_.poll();
  }
  EXPECT_THAT(reason(), StartsWith("age of the newest load-cell sample"));
}

TEST_F(GuardAlone, MissesTheRecorderOnlyWhileTheMotorTurns) {
  const auto run = [&](int from_ms, int to_ms, bool spinning) {
    for (int ms = from_ms; ms <= to_ms; ms += 10) {
      bench_.time.set(milliseconds(ms));
      sample(6, bench_.time.now());
      reading(MotorChannel::speed, 0);
      guard_.check(spinning);
      guard_.poll();
    }
  };
  run(0, 9000, false);
  EXPECT_EQ(bench_.queue_motor.coasted, 0);
  std::array<LoadCellRecord, 1> taken;
  (void)guard_.take(taken);
  run(9010, 14'000, true);
  EXPECT_EQ(bench_.queue_motor.coasted, 0);
  bench_.time.set(milliseconds(14'010));
  EXPECT_THROW(guard_.check(true), SafetyStop) << "the runner finds it, too";
  EXPECT_THAT(guard_.latch().trip()->reason, StartsWith("kphi could not write to the run file for 5 s"));
  EXPECT_EQ(bench_.queue_motor.coasted, 1);
}

TEST_F(GuardAlone, LetsTheMotorGoWhenItsLinkIsDead) {
  bench_.queue_motor.lost = "motor: the serial port is gone";
  expect_trip("motor: the serial port is gone");
  EXPECT_EQ(guard_.latch().trip()->source, Source::motor);
}

TEST_F(GuardAlone, PublishesWhatItJudged) {
  guard_.take_zero({0, 0, 1, 0, 0, 0});
  samples(6, 100);
  reading(MotorChannel::speed, 1000);
  guard_.poll();
  const Observation seen = guard_.observe(bench_.time.now());
  EXPECT_DOUBLE_EQ(seen.judged[Watched::thrust], 5);
  EXPECT_DOUBLE_EQ(seen.judged[Watched::force_z], 6);
  EXPECT_NEAR(seen.judged[Watched::speed], to_rpm(RadPerSec(1000)), 1e-9);
  EXPECT_TRUE(seen.load_cell_is_fresh());
}

TEST_F(GuardAlone, PublishesThePauseOfTheRunnerWhileTheMotorTurns) {
  EXPECT_TRUE(std::isnan(guard_.observe(bench_.time.now()).judged[Watched::pause]));
  guard_.check(true);
  bench_.time.set(milliseconds(30));
  guard_.check(true);
  EXPECT_DOUBLE_EQ(guard_.observe(bench_.time.now()).judged[Watched::pause], 0.03);
  guard_.check(false);
  EXPECT_TRUE(std::isnan(guard_.observe(bench_.time.now()).judged[Watched::pause]));
}

TEST_F(GuardAlone, StandsDownWhenTheRunIsOver) {
  guard_.stand_down();
  guard_.take_zero({});
  samples(30, 100);
  expect_no_trip();
  EXPECT_TRUE(std::isnan(guard_.observe(bench_.time.now()).judged[Watched::speed_error]))
      << "a coasting rotor has no wanted speed";
}

}  // namespace guard_test
}  // namespace kphi::daq
