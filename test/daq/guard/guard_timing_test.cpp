// Every row of the guard's table, and what devices say of themselves, each by itself on the deterministic bench: how
// long after the data exceed the limit does the motor coast? Virtual time, looked at every millisecond.
//
// "The data exceed the limit" is the stamp of the sample or reading that shows it for the first time (a supply is read
// eight times a second: the 50 ms count from the reading); where a patience belongs to the limit, its end.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <fstream>
#include <functional>
#include <optional>
#include <set>

#include "daq/guard/guard_limits.hpp"
#include "daq/guard/speed_error.hpp"
#include "daq/run/run.hpp"
#include "results/run_reader.hpp"
#include "test/daq/bench_fixture.hpp"
#include "test/daq/coasting_bench.hpp"

namespace kphi::daq {
namespace guard_timing_test {

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::HasSubstr;

constexpr Duration kPrompt = milliseconds(50);
constexpr Duration kHost = milliseconds(60);          // see Guard: how late a command may leave and a reading come
constexpr Duration kModuleLease = milliseconds(500);  // without a word from the host the module coasts by itself

/// When the file has it for the first time.
using Found = std::optional<Instant>;

Found first_reading(const results::RunRecording& run, MotorChannel channel, const std::function<bool(double)>& beyond,
                    Instant from = Instant(0)) {
  for (const auto& reading : run.motor) {
    if (reading.channel == channel && Instant(reading.time_ns) >= from && beyond(reading.value))
      return Instant(reading.time_ns);
  }
  return std::nullopt;
}

Found first_reading(const results::RunRecording& run, const std::function<bool(const SupplyReading&)>& beyond) {
  const auto found = std::find_if(run.supply.begin(), run.supply.end(), beyond);
  return found == run.supply.end() ? std::nullopt : Found(Instant(found->time_ns));
}

/// `limit` in N or N m, beside what the axis showed first; 0: beyond 110 % of its range, whatever it showed first.
Found first_sample(const results::RunRecording& run, std::size_t axis, double limit = 0) {
  const auto& cell = run.header.load_cell;
  const double scale = axis < 3 ? cell.counts_per_newton : cell.counts_per_newton_metre;
  const double zero = limit > 0 ? run.load_cell.front().counts[axis] / scale : 0;
  for (const auto& sample : run.load_cell) {
    if (std::abs(sample.counts[axis] / scale - zero) > (limit > 0 ? limit : kRangeBorne * cell.range[axis]))
      return Instant(sample.arrival_ns);
  }
  return std::nullopt;
}

Instant last_reading(const results::RunRecording& run, std::optional<MotorChannel> channel = std::nullopt) {
  Instant last{0};
  for (const auto& reading : run.motor) {
    if (!channel || reading.channel == *channel) last = std::max(last, Instant(reading.time_ns));
  }
  return last;
}

constexpr Duration kFrozen = milliseconds(50) + kPrompt;

/// What a test does to the bench when its time has come.
using Act = void (*)(CoastingBench&, Instant now);

/// `acted`: when a test did.
using Exceeded = std::function<Found(const results::RunRecording&, Instant acted)>;

struct Case {
  const char* name;
  Watched watched;
  std::string faults;
  std::function<void(profiles::Campaign&)> tighten;
  Exceeded exceeded;
  std::string words;  ///< a regular expression that the reason begins with
  EventKind event = EventKind::guard_trip;
  Act act = nullptr;
  bool with_supply = false;
  Duration bound = kPrompt;
};

std::ostream& operator<<(std::ostream& out, const Case& tested) { return out << tested.name; }

class GuardTiming : public testing::TestWithParam<Case> {
 protected:
  /// What the run was stopped with; a cell shows more than its range at the end of the range of its gages. The third
  /// step is that of 1.9 s to 2.5 s; of a bench with a supply it begins 1.2 s after twice its dwell.
  std::string record(const Case& tested) {
    const auto script = folder_.path() / "faults.yaml";
    std::ofstream(script) << "format: kphi-faults/1\nfaults:" << (tested.faults.empty() ? " []\n" : "\n")
                          << tested.faults;
    profiles::BenchConfig config = test::deterministic_config(4, script.string());
    if (tested.with_supply) {
      config = test::with_supply(config);
      campaign_.profile.dwell = Seconds(1.2);
    }
    if (tested.tighten) tested.tighten(campaign_);
    bench_.emplace(config);
    bench_->mounted("5x3", 0);
    if (tested.watched <= Watched::torque_z) test::shift_cell(bench_->bench, static_cast<std::size_t>(tested.watched));
    Progress progress;
    const Instant due =
        milliseconds(tested.with_supply ? 1500 : 1000) + 2 * from_seconds(campaign_.profile.dwell.value());
    const auto act = [&] {
      const Instant now = bench_->clock().now();
      if (tested.act != nullptr && !acted_ && now >= due) {
        acted_ = now;
        tested.act(*bench_, now);
      }
      return false;
    };
    return test::words_of<SafetyStop>([&] {
      return record_run(*bench_, test::first_run(campaign_, config, folder_.path() / "run.h5"), progress, act);
    });
  }

  test::TemporaryFolder folder_;
  profiles::Campaign campaign_ = test::short_campaign();
  std::optional<CoastingBench> bench_;
  Found acted_;
};

TEST_P(GuardTiming, CoastsTheMotorSoonAfterTheDataExceedTheLimit) {
  const Case& tested = GetParam();
  const std::string why = record(tested);
  EXPECT_THAT(why, testing::ContainsRegex("^" + tested.words));
  const results::RunRecording run = results::read_run(folder_.path() / "run.aborted.h5");
  const Found exceeded = tested.exceeded(run, acted_.value_or(Instant(0)));
  ASSERT_TRUE(exceeded) << why;
  const Duration after = bench_->coasts_at - *exceeded;
  fmt::print("{:<20} coasts {:5.1f} ms after the data exceed the limit\n", tested.name, 1e3 * to_seconds(after));
  EXPECT_GE(after, Duration(0)) << why;
  EXPECT_LE(after, tested.bound) << why;

  ASSERT_FALSE(run.events.empty());
  const auto stop = std::find_if(run.events.begin(), run.events.end(),
                                 [&](const StreamEvent& event) { return event.kind == tested.event; });
  ASSERT_NE(stop, run.events.end());
  EXPECT_THAT(stop->text, HasSubstr("step 3: "));
  EXPECT_THAT(run.outcome_reason, testing::ContainsRegex("^" + tested.words));
  if (bench_->supply() != nullptr) {
    EXPECT_FALSE(bench_->bench.simulation().supply()->circuit().output()) << "it is cut with the motor";
  }
}

/// From the middle of the third step on.
std::string lasting(const std::string& fault) { return "  - {at_s: 2.2, for_s: 9, kind: " + fault + "}\n"; }

Case range(std::size_t axis) {
  constexpr const char* kNames[] = {"Fx", "Fy", "Fz", "Tx", "Ty", "Tz"};
  return {kNames[axis],
          static_cast<Watched>(axis),
          lasting(fmt::format("saturation, axes: {}", 1 << axis)),
          nullptr,
          [axis](const auto& run, Instant) { return first_sample(run, axis); },
          fmt::format("load cell: {} carries 120 % of its range of {}", kNames[axis],
                      axis < 2    ? "20 N"
                      : axis == 2 ? "60 N"
                                  : "1 N m"),
          EventKind::range_trip};
}

Exceeded reading_of(MotorChannel channel, bool (*beyond)(double)) {
  return [=](const results::RunRecording& run, Instant) { return first_reading(run, channel, beyond); };
}
Exceeded supply_reading_of(bool (*beyond)(const SupplyReading&)) {
  return [=](const results::RunRecording& run, Instant) { return first_reading(run, beyond); };
}

/// In the third step, of 14,000 RPM; the rotor may stray for a while.
Exceeded stray_from(Instant begin) {
  return [begin](const auto& run, Instant) -> Found {
    const auto is_stray = [](double speed) { return speed < 0.85 * 1466 - SpeedWatch::kFloor; };
    const auto off = first_reading(run, MotorChannel::speed, is_stray, begin);
    return off ? first_reading(run, MotorChannel::speed, is_stray, *off + SpeedWatch::kPatience + kHost) : off;
  };
}

/// In truth. The box sets its status with the sample of that time, which waits there until its datagram is full.
Exceeded at(Instant when) {
  return [when](const auto&, Instant) { return Found(when); };
}
Exceeded as_acted(Duration later) {
  return [later](const auto&, Instant acted) { return Found(acted + later); };
}

const Case kCases[] = {
    range(0),
    range(1),
    range(2),
    range(3),
    range(4),
    range(5),
    {"Thrust", Watched::thrust, "  - {at_s: 2.2, kind: zero_drift, axis: 2, amount: 30, tau_s: 0.001}\n", nullptr,
     [](const auto& run, Instant) { return first_sample(run, 2, 20); },
     "thrust .* N is above 20 N .campaign limits.thrust_max_n"},
    {"PushingThrust", Watched::thrust, "  - {at_s: 2.2, kind: zero_drift, axis: 2, amount: -40, tau_s: 0.001}\n",
     nullptr, [](const auto& run, Instant) { return first_sample(run, 2, 20); }, "thrust "},
    {"ShaftTorque", Watched::shaft_torque, "  - {at_s: 2.2, kind: zero_drift, axis: 5, amount: 0.6, tau_s: 0.001}\n",
     [](auto& campaign) { campaign.limits["torque_max_nm"] = 0.4; },
     [](const auto& run, Instant) { return first_sample(run, 5, 0.4); }, "torque about the shaft "},
    {"Speed", Watched::speed, lasting("motor_value, type: 50, sub: 13, value: 2150"), nullptr,
     reading_of(MotorChannel::speed, [](double v) { return v > 2101; }),
     "speed 20531 RPM is above 20055 RPM .campaign limits.speed_max_rpm"},
    {"SpeedGlitch", Watched::speed, "  - {at_s: 2.2, count: 1, kind: motor_value, type: 50, sub: 13, value: 3000}\n",
     nullptr, reading_of(MotorChannel::speed, [](double v) { return v > 2101; }), "speed 28648 RPM is above"},
    {"SpeedStrays", Watched::speed_error, lasting("motor_value, type: 50, sub: 13, value: 1000"), nullptr,
     stray_from(seconds(2)), "motor: speed off target for .* s: 9549 of 14000 RPM"},
    {"RotorHeld", Watched::speed_error, lasting("motor_locked"), nullptr, stray_from(milliseconds(2200)),
     "motor: speed off target"},
    {"SpeedUnseen", Watched::speed_error, "  - {at_s: 2.05, for_s: 9, kind: motor_drop, type: 50, sub: 13}\n", nullptr,
     [](const auto& run, Instant) -> Found {
       return last_reading(run, MotorChannel::speed) + SpeedWatch::kBlind + kHost;
     },
     "motor: no speed reading for 0.3"},
    {"SupplyCurrent", Watched::supply_current, lasting("motor_value, type: 69, sub: 1, value: 36"), nullptr,
     reading_of(MotorChannel::supply_current, [](double v) { return v > 35; }),
     "supply current 36 A is above 35 A .campaign limits.supply_current_max_a"},
    {"OutputCurrent", Watched::output_current, "", nullptr,
     supply_reading_of([](const SupplyReading& shown) { return shown.current_a > 35; }),
     "output current of the supply 36 A is above 35 A .campaign limits.supply_current_max_a", EventKind::guard_trip,
     [](CoastingBench& bench, Instant) {
       bench.spoilt_supply->spoil = [](SupplyReading& shown) { shown.current_a = 36; };
     },
     true},
    {"MotorCurrent", Watched::motor_current, lasting("motor_value, type: 50, sub: 36, value: -61"), nullptr,
     reading_of(MotorChannel::motor_current, [](double v) { return v < -60; }),
     "motor current 61 A is above 60 A .device motor power_safety.motor_current_high"},
    {"Sag", Watched::supply_voltage_low, lasting("motor_sag, volts: 2"),
     [](auto& campaign) { campaign.limits["supply_voltage_min_v"] = 10.5; },
     reading_of(MotorChannel::supply_voltage, [](double v) { return v < 10.5; }), "supply voltage 9"},
    {"OverVoltage", Watched::supply_voltage_high, lasting("motor_over_voltage, volts: 3"),
     [](auto& campaign) { campaign.limits["supply_voltage_max_v"] = 13.5; },
     reading_of(MotorChannel::supply_voltage, [](double v) { return v > 13.5; }), "supply voltage 14"},
    {"CoilTemperature", Watched::coil_temperature, lasting("motor_hot, coil_celsius: 100"), nullptr,
     reading_of(MotorChannel::coil_temperature, [](double v) { return v > 110; }), "coil temperature 1"},
    {"LoadCellSilent", Watched::load_cell_age, lasting("hold"), nullptr,
     [](const auto& run, Instant) -> Found { return Instant(run.load_cell.back().arrival_ns) + milliseconds(145); },
     "age of the newest load-cell sample"},
    {"MotorSilent", Watched::motor_age, lasting("motor_mute"), nullptr,
     [](const auto& run, Instant) -> Found { return last_reading(run) + milliseconds(145); },
     "age of the newest motor reading"},
    {"SupplySilent", Watched::supply_age, "", [](auto& campaign) { campaign.profile.dwell = Seconds(3); },
     [](const auto& run, Instant) -> Found { return Instant(run.supply.back().time_ns) + seconds(2); },
     "age of the newest supply reading", EventKind::guard_trip,
     [](CoastingBench& bench, Instant now) { bench.spoilt_supply->silent_from = now; }, true},
    {"ProgramSilent", Watched::pause, "", nullptr, as_acted(milliseconds(400 - 10)), "kphi was blocked for 0.4",
     EventKind::guard_trip, [](CoastingBench& bench, Instant now) { bench.wait_until(now + milliseconds(600)); }},
    {"RecorderSilent", Watched::recorder_pause, "", [](auto& campaign) { campaign.profile.dwell = Seconds(7); },
     as_acted(seconds(5) - milliseconds(10)), "kphi could not write to the run file for 5 s", EventKind::guard_trip,
     [](CoastingBench& bench, Instant) { bench.recorder_hangs = true; }},
    {"BoxError", Watched::state, "  - {at_s: 2.2, kind: status, bits: 0x88000000}\n", nullptr, at(milliseconds(2200)),
     "load cell: the Net Box reports .serial link communication error. .status 0x88000000. for 5.9 ms, so its samples "
     "cannot be trusted; check the cell's cable"},
    {"BoxErrorLatched", Watched::state, "  - {at_s: 2.2, for_s: 0.02, kind: status, bits: 0x90000000, latched: 1}\n",
     nullptr, at(milliseconds(2200)), "load cell: the Net Box reports .analog board error."},
    {"AxiaError", Watched::state, "  - {at_s: 2.2, kind: status, bits: 0x80000004}\nquirks: {axia: true}\n", nullptr,
     at(milliseconds(2200)), "load cell: the Axia reports .broken gage. .status 0x80000004. for 5.9 ms"},
    {"Frozen", Watched::frozen, lasting("frozen, axes: 63"), nullptr, at(milliseconds(2200)),
     "load cell: .. repeats one value, 350 samples so far, which its noise in the zero cannot do",
     EventKind::guard_trip, nullptr, false, kFrozen},
    {"FrozenThrustAxis", Watched::frozen, lasting("frozen, axes: 4"), nullptr, at(milliseconds(2200)),
     "load cell: Fz repeats one value", EventKind::guard_trip, nullptr, false, kFrozen},
    {"FrozenBesideAMonitorCondition", Watched::frozen,
     "  - {at_s: 0, kind: status, bits: 0x80010000}\n" + lasting("frozen, axes: 4"), nullptr, at(milliseconds(2200)),
     "load cell: Fz repeats one value", EventKind::guard_trip, nullptr, false, kFrozen},
    {"Sleep", Watched::sleep, "", nullptr, as_acted(milliseconds(300)), "this computer slept for 0.3 s",
     EventKind::guard_trip, [](CoastingBench& bench, Instant) { bench.bench.sleep(milliseconds(300)); }},
    {"Derates", Watched::state, lasting("motor_redline, speed_rad_s: 800"), nullptr,
     reading_of(MotorChannel::derate, [](double v) { return v < 0.9999; }), "motor: the module derates to"},
    {"ModuleFault", Watched::state, "", nullptr, reading_of(MotorChannel::fault_now, [](double v) { return v != 0; }),
     "motor: the module reports a fault .power_safety.fault_now 0x42", EventKind::guard_trip,
     [](CoastingBench& bench, Instant) {
       bench.spoilt_motor.spoil = [](auto& reading) {
         if (reading.channel == MotorChannel::fault_now) reading.value = 0x42;
       };
     }},
    // No order reaches a module without its adapter: a supply that can be cut takes the power from it, or its own
    // timeout opens the bridge.
    {"MotorUnplugged", Watched::state, lasting("motor_unplug"), nullptr, at(milliseconds(2200)),
     "motor: the serial port is gone", EventKind::guard_trip, nullptr, false, kModuleLease + kPrompt},
    {"MotorUnpluggedBesideASupply", Watched::state, "  - {at_s: 4.2, for_s: 9, kind: motor_unplug}\n", nullptr,
     at(milliseconds(4200)), "motor: the serial port is gone", EventKind::guard_trip, nullptr, true},
    {"SupplyUnplugged", Watched::state, "", nullptr, as_acted(Duration(0)), "supply: the serial port is gone",
     EventKind::supply_stop,
     [](CoastingBench& bench, Instant) { bench.spoilt_supply->lost = "supply: the serial port is gone"; }, true},
    {"SupplyTripped", Watched::state, "", nullptr,
     supply_reading_of([](const SupplyReading& shown) { return shown.protection != SupplyProtection::none; }),
     "supply: over-current protection switched the output off", EventKind::supply_stop,
     [](CoastingBench& bench, Instant) {
       bench.spoilt_supply->spoil = [](auto& shown) { shown.protection = SupplyProtection::over_current; };
     },
     true},
    {"SupplyKnob", Watched::state, "", nullptr,
     supply_reading_of([](const SupplyReading& shown) { return shown.current_limit_a < 50; }),
     "supply: current limit is 40 A, kphi set 50 A", EventKind::supply_stop,
     [](CoastingBench& bench, Instant) { bench.bench.simulation().supply()->circuit().controls().amps = 40; }, true},
};
// Patience of half a second: what may pass by itself.
const Case kLasting[] = {
    {"Saturated", Watched::state, "  - {at_s: 1.5, kind: saturation, axes: 1}\n", nullptr, at(milliseconds(2000)),
     "load cell: the Net Box reports .transducer saturation or A/D error. .status 0x80020000. for 500.1 ms"},
    {"AxiaSaturated", Watched::state, "  - {at_s: 1.5, kind: saturation, axes: 1}\nquirks: {axia: true}\n", nullptr,
     at(milliseconds(2000)),
     "load cell: the Axia reports .force or torque out of range. .status 0xC0000000. for 500.1 ms"},
    {"RdtTrouble", Watched::state, "  - {at_s: 1.5, kind: status, bits: 0x80100000}\n", nullptr, at(milliseconds(2000)),
     "load cell: the Net Box reports .RDT communication error. .status 0x80100000. for 500.1 ms"},
};
const auto kNameOfCase = [](const testing::TestParamInfo<Case>& tested) { return std::string(tested.param.name); };
INSTANTIATE_TEST_SUITE_P(OfWhatLasts, GuardTiming, testing::ValuesIn(kLasting), kNameOfCase);
INSTANTIATE_TEST_SUITE_P(Of, GuardTiming, testing::ValuesIn(kCases), kNameOfCase);

TEST(GuardTimings, LeaveNoRowOfTheTableOut) {
  std::set<Watched> timed;
  for (const Case& tested : kCases) timed.insert(tested.watched);
  EXPECT_TRUE(timed.count(Watched::state) && timed.count(Watched::sleep));
  for (std::size_t row = 0; row < kWatchedCount; ++row) {
    EXPECT_TRUE(timed.count(static_cast<Watched>(row))) << "row " << row;
  }
}

}  // namespace guard_timing_test
}  // namespace kphi::daq
