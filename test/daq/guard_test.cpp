// Each limit and each silence by itself on the deterministic bench: the motor's bridge is open 50 ms after the sample
// that exceeds it, or after the patience with a stream. Then what the guard does without a runner, and without a
// recorder.
#include "daq/guard.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <optional>

#include "daq/run.hpp"
#include "results/run_reader.hpp"
#include "test/daq/bench_fixture.hpp"
#include "test/daq/coasting_bench.hpp"
#include "test/daq/queue_bench.hpp"

namespace kphi::daq {
namespace {

using results::EventKind;
using results::MotorChannel;
using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::HasSubstr;
using testing::StartsWith;

constexpr Duration kPrompt = milliseconds(50);

/// When the file has it for the first time.
using Found = std::optional<Instant>;

Found first_reading(const results::RunRecording& run, MotorChannel channel, const std::function<bool(double)>& beyond) {
  for (const auto& reading : run.motor) {
    if (reading.channel == channel && beyond(reading.value)) return Instant(reading.time_ns);
  }
  return std::nullopt;
}

Found first_sample(const results::RunRecording& run, std::size_t axis, double limit) {
  const double scale = axis < 3 ? run.header.load_cell.counts_per_newton : run.header.load_cell.counts_per_newton_metre;
  const double zero = run.load_cell.front().counts[axis] / scale;
  for (const auto& sample : run.load_cell) {
    if (std::abs(sample.counts[axis] / scale - zero) > limit) return Instant(sample.arrival_ns);
  }
  return std::nullopt;
}

struct Case {
  const char* name;
  const char* faults;
  std::function<void(profiles::Campaign&)> tighten;
  std::function<Found(const results::RunRecording&)> exceeded;
  const char* words;
  EventKind event = EventKind::guard_trip;
};

std::ostream& operator<<(std::ostream& out, const Case& tested) { return out << tested.name; }

class EachLimit : public testing::TestWithParam<Case> {
 protected:
  /// What the run was stopped with.
  std::string record(const std::string& faults) {
    const auto script = folder_.path() / "faults.yaml";
    std::ofstream(script) << "format: kphi-faults/1\nfaults:\n" << faults;
    place_ = test::deterministic_place(4, script.string());
    bench_.emplace(place_);
    bench_->mounted("5x3", 0);
    prepare();
    NoProgress progress;
    try {
      (void)record_run(*bench_, test::first_run(campaign_, place_, folder_.path() / "run.h5"), progress,
                       [] { return false; });
    } catch (const SafetyStop& stop) {
      return stop.what();
    }
    return "nothing stopped the run";
  }
  virtual void prepare() {}
  [[nodiscard]] results::RunRecording aborted() const { return results::read_run(folder_.path() / "run.aborted.h5"); }

  test::TemporaryFolder folder_;
  profiles::Campaign campaign_ = test::short_campaign();
  profiles::Bench place_;
  std::optional<CoastingBench> bench_;
};

TEST_P(EachLimit, CoastsTheMotorWithinFiftyMillisecondsOfTheSample) {
  if (GetParam().tighten) GetParam().tighten(campaign_);
  const std::string why = record(GetParam().faults);
  EXPECT_THAT(why, StartsWith(GetParam().words));
  const results::RunRecording run = aborted();
  const Found exceeded = GetParam().exceeded(run);
  ASSERT_TRUE(exceeded) << why;
  EXPECT_GE(bench_->coasts_at, *exceeded);
  EXPECT_LE(bench_->coasts_at - *exceeded, kPrompt) << why;
  fmt::print("{:<20} coasts {:4.1f} ms after the sample\n", GetParam().name,
             1e3 * to_seconds(bench_->coasts_at - *exceeded));

  ASSERT_FALSE(run.events.empty());
  EXPECT_EQ(run.events.back().kind, GetParam().event);
  EXPECT_THAT(run.events.back().text, HasSubstr("step 3: "));
  EXPECT_THAT(run.outcome_reason, StartsWith(GetParam().words));
  EXPECT_GE(run.load_cell.back().arrival_ns, exceeded->count()) << "the last samples are kept";
}

/// The third step is that of 1.9 s to 2.5 s.
const Case kLimits[] = {
    {"Thrust", "  - {at_s: 2.2, kind: zero_drift, axis: 2, amount: 30, tau_s: 0.001}\n", nullptr,
     [](const auto& run) { return first_sample(run, 2, 20); }, "thrust "},
    {"PushingThrust", "  - {at_s: 2.2, kind: zero_drift, axis: 2, amount: -40, tau_s: 0.001}\n", nullptr,
     [](const auto& run) { return first_sample(run, 2, 20); }, "thrust "},
    {"ShaftTorque", "  - {at_s: 2.2, kind: zero_drift, axis: 5, amount: 0.6, tau_s: 0.001}\n",
     [](auto& campaign) { campaign.limits.torque_max = NewtonMetres(0.4); },
     [](const auto& run) { return first_sample(run, 5, 0.4); }, "torque about the shaft "},
    {"Speed", "  - {at_s: 2.2, for_s: 9, kind: motor_value, type: 50, sub: 13, value: 2150}\n", nullptr,
     [](const auto& run) { return first_reading(run, MotorChannel::speed, [](double v) { return v > 2101; }); },
     "speed 20531 RPM is above 20055 RPM (campaign limits.speed_max_rpm"},
    {"SpeedGlitch", "  - {at_s: 2.2, count: 1, kind: motor_value, type: 50, sub: 13, value: 3000}\n", nullptr,
     [](const auto& run) { return first_reading(run, MotorChannel::speed, [](double v) { return v > 2101; }); },
     "speed 28648 RPM is above"},
    {"SupplyCurrent", "  - {at_s: 2.2, for_s: 9, kind: motor_value, type: 69, sub: 1, value: 36}\n", nullptr,
     [](const auto& run) { return first_reading(run, MotorChannel::supply_current, [](double v) { return v > 35; }); },
     "supply current 36 A is above 35 A (campaign limits.supply_current_max_a)"},
    {"MotorCurrent", "  - {at_s: 2.2, for_s: 9, kind: motor_value, type: 50, sub: 36, value: -61}\n", nullptr,
     [](const auto& run) { return first_reading(run, MotorChannel::motor_current, [](double v) { return v < -60; }); },
     "motor current 61 A is above 60 A (device motor power_safety.motor_current_high)"},
    {"OverVoltage", "  - {at_s: 2.2, for_s: 9, kind: motor_over_voltage, volts: 3}\n",
     [](auto& campaign) { campaign.limits.supply_voltage_max = Volts(13.5); },
     [](const auto& run) {
       return first_reading(run, MotorChannel::supply_voltage, [](double v) { return v > 13.5; });
     },
     "supply voltage 14"},
    {"Sag", "  - {at_s: 2.2, for_s: 9, kind: motor_sag, volts: 2}\n",
     [](auto& campaign) { campaign.limits.supply_voltage_min = Volts(10.5); },
     [](const auto& run) {
       return first_reading(run, MotorChannel::supply_voltage, [](double v) { return v < 10.5; });
     },
     "supply voltage 9"},
    {"CoilTemperature", "  - {at_s: 2.2, for_s: 9, kind: motor_hot, coil_celsius: 100}\n", nullptr,
     [](const auto& run) {
       return first_reading(run, MotorChannel::coil_temperature, [](double v) { return v > 110; });
     },
     "coil temperature 1"},
    {"Derate", "  - {at_s: 2.2, for_s: 9, kind: motor_redline, speed_rad_s: 800}\n", nullptr,
     [](const auto& run) { return first_reading(run, MotorChannel::derate, [](double v) { return v < 0.9999; }); },
     "motor: the module derates to"},
};
INSTANTIATE_TEST_SUITE_P(Guard, EachLimit, testing::ValuesIn(kLimits),
                         [](const testing::TestParamInfo<Case>& tested) { return std::string(tested.param.name); });

/// A gage bias shifts what the box shows: at the end of the range of the gages it then shows more than the range.
class ShiftedCell : public EachLimit {
  void prepare() override {
    sim::NetBoxSettings settings;
    settings.bias_vector[0] = -6554;  // a fifth of the range
    bench_->bench.simulation().netbox().configure(settings);
  }
};

TEST_P(ShiftedCell, CoastsTheMotorWhenTheCellIsInDanger) {
  EXPECT_THAT(record(GetParam().faults), StartsWith(GetParam().words));
  const results::RunRecording run = aborted();
  const Found exceeded = GetParam().exceeded(run);
  ASSERT_TRUE(exceeded);
  EXPECT_LE(bench_->coasts_at - *exceeded, kPrompt);
  EXPECT_EQ(run.events.back().kind, GetParam().event);
}

INSTANTIATE_TEST_SUITE_P(Guard, ShiftedCell,
                         testing::Values(Case{"Range", "  - {at_s: 2.2, for_s: 9, kind: saturation, axes: 1}\n",
                                              nullptr, [](const auto& run) { return first_sample(run, 0, 15); },
                                              "load cell: Fx carries 120 % of its range of 20 N",
                                              EventKind::range_trip}),
                         [](const testing::TestParamInfo<Case>& tested) { return std::string(tested.param.name); });

class EachSilence : public EachLimit {};

TEST_P(EachSilence, CoastsTheMotorWithinFiftyMillisecondsOfThePatience) {
  EXPECT_THAT(record(GetParam().faults), StartsWith(GetParam().words));
  const results::RunRecording run = aborted();
  const Found last = GetParam().exceeded(run);
  ASSERT_TRUE(last);
  const Duration after = bench_->coasts_at - *last - spin_patience(place_);
  fmt::print("{:<20} coasts {:4.1f} ms after the patience\n", GetParam().name, 1e3 * to_seconds(after));
  EXPECT_GE(after, Duration(0));
  EXPECT_LE(after, kPrompt);
}

INSTANTIATE_TEST_SUITE_P(Guard, EachSilence,
                         testing::Values(Case{"LoadCell", "  - {at_s: 2.2, for_s: 9, kind: hold}\n", nullptr,
                                              [](const auto& run) -> Found {
                                                return Instant(run.load_cell.back().arrival_ns);
                                              },
                                              "age of the newest load-cell sample"},
                                         Case{"Motor", "  - {at_s: 2.2, for_s: 9, kind: motor_mute}\n", nullptr,
                                              [](const auto& run) -> Found {
                                                Instant last{0};
                                                for (const auto& reading : run.motor)
                                                  last = std::max(last, Instant(reading.time_ns));
                                                return last;
                                              },
                                              "age of the newest motor reading"}),
                         [](const testing::TestParamInfo<Case>& tested) { return std::string(tested.param.name); });

/// A bench with a supply of its own.
class GuardedSupply : public testing::Test {
 protected:
  GuardedSupply() {
    place_.supply = profiles::SupplyPlace{"modbus-rtu:/dev/null", Volts(12), Amperes(50), Volts(13.5), Amperes(60)};
    campaign_.profile.dwell = Seconds(1.2);
    bench_.emplace(place_);
    bench_->mounted("5x3", 0);
  }
  std::string record(const std::function<void(Instant)>& act) {
    NoProgress progress;
    try {
      (void)record_run(*bench_, test::first_run(campaign_, place_, folder_.path() / "run.h5"), progress, [&] {
        act(bench_->clock().now());
        return false;
      });
    } catch (const SafetyStop& stop) {
      return stop.what();
    }
    return "nothing stopped the run";
  }
  [[nodiscard]] results::RunRecording aborted() const { return results::read_run(folder_.path() / "run.aborted.h5"); }

  test::TemporaryFolder folder_;
  profiles::Campaign campaign_ = test::short_campaign();
  profiles::Bench place_ = test::deterministic_place(4);
  std::optional<CoastingBench> bench_;
};

TEST_F(GuardedSupply, IsCutWithTheMotorWhenItFallsSilent) {
  bench_->silent_supply->silent_from = seconds(3);
  EXPECT_THAT(record([](Instant) {}), HasSubstr("age of the newest supply reading"));
  const Duration after = bench_->coasts_at - Instant(aborted().supply.back().time_ns) - seconds(2);
  EXPECT_GE(after, Duration(0));
  EXPECT_LE(after, kPrompt);
  EXPECT_FALSE(bench_->bench.simulation().supply()->circuit().output());
}

TEST_F(GuardedSupply, IsCutWithTheMotorWhenItsCurrentIsTooLarge) {
  campaign_.limits.supply_current_max = Amperes(6);
  EXPECT_THAT(record([](Instant) {}), testing::ContainsRegex("current .* A is above 6 A"));
  const results::RunRecording run = aborted();
  Instant exceeded = kNever;
  for (const auto& reading : run.supply) {
    if (reading.current_a > 6) exceeded = std::min(exceeded, Instant(reading.time_ns));
  }
  if (const auto of_motor = first_reading(run, MotorChannel::supply_current, [](double v) { return v > 6; }))
    exceeded = std::min(exceeded, *of_motor);
  ASSERT_NE(exceeded, kNever);
  EXPECT_GE(bench_->coasts_at, exceeded);
  EXPECT_LE(bench_->coasts_at - exceeded, kPrompt);
  EXPECT_FALSE(bench_->bench.simulation().supply()->circuit().output());
}

TEST_F(GuardedSupply, IsCutWithTheMotorWhenSomebodyTurnsAKnob) {
  auto& circuit = bench_->bench.simulation().supply()->circuit();
  const std::string why = record([&](Instant now) {
    if (now > milliseconds(3600)) circuit.controls().amps = 40;
  });
  EXPECT_THAT(why, StartsWith("supply: its current limit is 40 A where 50 A was set"));
  const results::RunRecording run = aborted();
  const auto turned = std::find_if(run.supply.begin(), run.supply.end(),
                                   [](const auto& reading) { return reading.current_limit_a < 50; });
  ASSERT_NE(turned, run.supply.end());
  EXPECT_LE(bench_->coasts_at - Instant(turned->time_ns), kPrompt);
  EXPECT_EQ(run.events.back().kind, EventKind::supply_stop);
  EXPECT_THAT(run.events.back().text, HasSubstr("step 3: supply: "));
}

/// The guard by itself, on a bench of queues.
class GuardAlone : public testing::Test {
 protected:
  void sample(double fz_n, Instant at) {
    results::LoadCellRecord record;
    record.counts[2] = static_cast<std::int32_t>(1e6 * fz_n);
    record.arrival_ns = at.count();
    bench_.records.push_back(record);
  }
  void samples(double fz_n, int n) {
    for (int i = 0; i < n; ++i) {
      bench_.time.set(bench_.time.now() + milliseconds(1) / 7);
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
    guard_.look();
  }
  [[nodiscard]] std::string reason() const { return guard_.latch().trip() ? guard_.latch().trip()->reason : ""; }

  QueueBench bench_;
  profiles::Campaign campaign_ = test::short_campaign();
  profiles::Bench place_ = test::deterministic_place(1);
  Guard guard_{bench_, place_, mini40(), combine_limits(campaign_, place_)};
};

TEST_F(GuardAlone, NeedsNeitherRunnerNorRecorderToLetTheMotorGo) {
  guard_.take_zero({});
  samples(6, 100);
  guard_.look();
  EXPECT_EQ(bench_.queue_motor.coasted, 0);
  samples(21, 100);
  guard_.look();
  EXPECT_EQ(bench_.queue_motor.coasted, 1);
  const Trip* trip = guard_.latch().trip();
  ASSERT_NE(trip, nullptr);
  EXPECT_EQ(trip->watched, Watched::thrust);
  EXPECT_EQ(trip->limit.source, "campaign limits.thrust_max_n");
  EXPECT_GT(trip->value, 20);
  EXPECT_THROW(guard_.check(true), SafetyStop);
}

TEST_F(GuardAlone, MissesNothingThatCameAndWentBetweenTwoLooks) {
  guard_.take_zero({});
  samples(6, 100);
  samples(25, 60);
  samples(6, 1000);
  guard_.look();
  EXPECT_THAT(reason(), StartsWith("thrust"));
}

TEST_F(GuardAlone, TakesTheTareOffThrust) {
  netbox::ZeroMeasurement zero;
  zero.mean[2] = 18;
  guard_.take_zero(zero);
  samples(24, 100);
  guard_.look();
  EXPECT_EQ(reason(), "");
  samples(39, 100);
  guard_.look();
  EXPECT_THAT(reason(), StartsWith("thrust"));
}

TEST_F(GuardAlone, PassesEverythingOnInOrderAlsoAfterATrip) {
  guard_.take_zero({});
  samples(30, 3000);
  reading(MotorChannel::coil_temperature, 200);
  reading(MotorChannel::speed, 100);
  bench_.events.push_back({EventKind::restarted, 5, 0, "the stream began anew"});
  guard_.look();
  std::vector<results::LoadCellRecord> records(5000);
  ASSERT_EQ(guard_.take(std::span(records)), 3000u);
  EXPECT_TRUE(std::is_sorted(records.begin(), records.begin() + 3000,
                             [](const auto& a, const auto& b) { return a.arrival_ns < b.arrival_ns; }));
  std::vector<results::MotorReading> readings(10);
  EXPECT_EQ(guard_.take(std::span(readings)), 2u);
  EXPECT_EQ(guard_.take_events().at(0).text, "the stream began anew");
  EXPECT_EQ(bench_.queue_motor.coasted, 1) << "once";
}

TEST_F(GuardAlone, LeavesWithTheDevicesWhatARecorderThatIsStuckCannotTake) {
  for (int i = 0; i < 80'000; ++i) sample(6, bench_.time.now());
  guard_.look();
  EXPECT_EQ(bench_.records.size(), 10'000u) << "10 s of 7 kHz are on their way";
  std::vector<results::LoadCellRecord> records(100'000);
  EXPECT_EQ(guard_.take(std::span(records)), 70'000u);
  guard_.look();
  EXPECT_EQ(guard_.take(std::span(records)), 10'000u);
}

TEST_F(GuardAlone, TripsAtValuesThatAreNoNumbers) {
  reading(MotorChannel::speed, std::nan(""));
  guard_.look();
  EXPECT_THAT(reason(), StartsWith("speed"));
}

TEST_F(GuardAlone, TripsAtAnyFaultThatTheModuleReports) {
  reading(MotorChannel::fault_now, 0);
  guard_.look();
  EXPECT_EQ(reason(), "");
  reading(MotorChannel::fault_now, 0x42);
  reading(MotorChannel::fault_now, 0);
  guard_.look();
  EXPECT_EQ(reason(), "motor: the module reports a fault (power_safety.fault_now 0x42)");
}

TEST_F(GuardAlone, SeesThatTheRotorDoesNotDoWhatItIsToldUntilTheStepsEnd) {
  guard_.mark({results::Phase::step, 0, bench_.time.now().count(), 500});
  guard_.look();
  guard_.mark({results::Phase::spin_down, -1, bench_.time.now().count(), 0});
  stand_still_for_a_second();
  EXPECT_EQ(reason(), "");
  guard_.mark({results::Phase::step, 1, bench_.time.now().count(), 500});
  stand_still_for_a_second();
  EXPECT_THAT(reason(), HasSubstr("the rotor does not do what it is told: 0 RPM"));
  EXPECT_EQ(guard_.latch().trip()->watched, Watched::speed_error);
  EXPECT_EQ(guard_.latch().trip()->step, 1);
}

TEST_F(GuardAlone, LooksTwiceBeforeItBelievesASilence) {
  guard_.check(true);
  bench_.time.set(milliseconds(300));
  guard_.look();
  EXPECT_EQ(reason(), "") << "this host may have stood still, and all of it waits";
  sample(6, milliseconds(300));
  reading(MotorChannel::speed, 100);
  bench_.time.set(milliseconds(320));
  guard_.check(true);
  guard_.look();
  EXPECT_EQ(reason(), "");
  while (bench_.time.now() <= milliseconds(300) + spin_patience(place_)) {
    guard_.look();
    bench_.time.set(bench_.time.now() + milliseconds(50));
    guard_.check(true);
  }
  guard_.look();
  EXPECT_EQ(reason(), "");
  bench_.time.set(bench_.time.now() + milliseconds(20));
  guard_.look();
  EXPECT_THAT(reason(), StartsWith("age of the newest load-cell sample"));
}

TEST_F(GuardAlone, HasMorePatienceWhileNothingTurns) {
  bench_.time.set(milliseconds(490));
  guard_.look();
  bench_.time.set(milliseconds(499));
  guard_.look();
  EXPECT_EQ(reason(), "");
  bench_.time.set(milliseconds(530));
  guard_.look();
  bench_.time.set(milliseconds(550));
  guard_.look();
  EXPECT_THAT(reason(), StartsWith("age of the newest load-cell sample"));
}

TEST_F(GuardAlone, LetsTheMotorGoWhenTheRunnerLooksNoMore) {
  guard_.check(true);
  bench_.time.set(milliseconds(390));
  sample(6, bench_.time.now());
  reading(MotorChannel::speed, 100);
  guard_.look();
  EXPECT_EQ(bench_.queue_motor.coasted, 0);
  bench_.time.set(milliseconds(410));
  guard_.look();
  EXPECT_EQ(bench_.queue_motor.coasted, 1);
  EXPECT_EQ(reason(), "this program stood still for 0.41 s while the motor turned");
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

TEST_F(GuardAlone, LetsTheMotorGoWhenItsLinkIsDead) {
  bench_.queue_motor.lost = "motor: the serial port is gone";
  guard_.look();
  EXPECT_EQ(bench_.queue_motor.coasted, 1);
  EXPECT_EQ(reason(), "motor: the serial port is gone");
}

TEST_F(GuardAlone, StandsDownWhenTheRunIsOver) {
  guard_.stand_down();
  guard_.take_zero({});
  samples(30, 100);
  guard_.look();
  EXPECT_EQ(bench_.queue_motor.coasted, 0);
  EXPECT_EQ(reason(), "");
}

}  // namespace
}  // namespace kphi::daq
