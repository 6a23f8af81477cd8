// Raw samples of the simulated bench against what it was built with: torque, lag of the thrust, clock of the motor.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "daq/campaign/campaign_run.hpp"
#include "drivers/sim/physics/truth.hpp"
#include "fit/model/identification.hpp"
#include "fit/signal/blade_pass.hpp"
#include "fit/signal/dynamics.hpp"
#include "fit/uncertainty/torque_coefficient.hpp"
#include "results/reduction/reduction.hpp"
#include "results/run_reader.hpp"
#include "test/daq/bench_fixture.hpp"
#include "test/daq/wrapped_bench.hpp"

namespace kphi::fit {
namespace bench_truth_test {

constexpr double kClockError = 0.005;

struct TimedSample {
  double t_s = 0;  ///< bench time
  double value = 0;
};

/// The deterministic bench, which is looked at every half a millisecond while it runs.
class WatchedBench final : public daq::WrappedBench {
 public:
  using WrappedBench::WrappedBench;
  void wait_until(Instant when) override {
    constexpr Duration kLook = std::chrono::microseconds(500);
    for (Instant next = clock().now() + kLook; clock().now() < when; next += kLook) {
      bench.wait_until(std::min(next, when));
      shaft.push_back({to_seconds(clock().now()), bench.simulation().plant().motor().speed});
    }
  }
  std::vector<TimedSample> shaft;  ///< true speeds, rad/s
};

struct Recorded {
  std::vector<results::RunRecording> runs;
  std::vector<TimedSample> shaft;
};

/// A short campaign of 12 steps of 0.8 s.
Recorded record(const std::string& occlusions, int repetitions, const sim::PlantParameters& plant = {}) {
  test::TemporaryFolder folder;
  const profiles::BenchConfig config = test::deterministic_config(11);
  sim::BenchSettings settings;
  settings.oscillator_gain = kClockError;
  settings.plant = plant;
  WatchedBench bench(config, settings);
  auto text = test::short_campaign_text(occlusions, repetitions, 12);
  text.replace(text.find("dwell_s: 0.6"), 12, "dwell_s: 0.8");
  auto results = results::CampaignFolder::create(folder.path(), "20210530T000000Z", "short");
  daq::AutoConfirmOperator person;
  daq::Progress progress;
  (void)daq::run_campaign(bench, profiles::parse_campaign(text, "short.yaml"), config, results, person, progress,
                          [] { return false; });
  Recorded recorded{{}, std::move(bench.shaft)};
  for (const auto& file : results.complete_runs()) recorded.runs.push_back(results::read_run(file));
  return recorded;
}

/// For all tests but one.
const std::vector<results::RunRecording>& runs() {
  static const Recorded all = record("0, 90, 180", 2);
  return all.runs;
}

struct FirstOrder {
  double time_constant = 0, delay = 0;  // s
};

/// The first-order response with delay that comes nearest to what the shaft did after each command, by search.
FirstOrder true_response(const Recorded& recorded) {
  struct Point {
    double t, y, weight;
  };
  std::vector<Point> points;
  for (const results::RunRecording& run : recorded.runs) {
    for (std::size_t i = 1; i + 1 < run.phases.size(); ++i) {
      if (run.phases[i].phase != results::Phase::step || run.phases[i - 1].phase != results::Phase::step) continue;
      const double begin = 1e-9 * static_cast<double>(run.phases[i].time_ns);
      const double end = 1e-9 * static_cast<double>(run.phases[i + 1].time_ns);
      double before = 0, after = 0, settled = 0;
      std::vector<TimedSample> during;
      const std::vector<TimedSample>& shaft = recorded.shaft;
      const auto earlier = [](const TimedSample& at, double t) { return at.t_s < t; };
      for (auto it = std::lower_bound(shaft.begin(), shaft.end(), begin, earlier); it != shaft.end() && it->t_s < end;
           ++it) {
        const TimedSample& at = *it;
        if (at.t_s <= begin) before = at.value;
        if (at.t_s <= begin) continue;
        during.push_back(at);
        if (at.t_s > 0.5 * (begin + end)) after += at.value, ++settled;
      }
      const double change = after / settled - before;
      for (const TimedSample& at : during)
        points.push_back({at.t_s - begin, (at.value - before) / change, change * change});
    }
  }
  const auto cost = [&](const FirstOrder& guess) {
    double sum = 0;
    for (const auto& [t, y, weight] : points) {
      const double since = t - guess.delay, expected = since > 0 ? 1 - std::exp(-since / guess.time_constant) : 0;
      sum += weight * std::pow(y - expected, 2);
    }
    return sum;
  };
  FirstOrder best{0.05, 0.005};
  for (double width = 0.045; width > 1e-5; width *= 0.7) {
    const FirstOrder centre = best;
    for (int i = -4; i <= 4; ++i) {
      for (int j = -4; j <= 4; ++j) {
        const FirstOrder guess{std::max(1e-4, centre.time_constant + i * width / 4), centre.delay + j * width / 16};
        if (cost(guess) < cost(best)) best = guess;
      }
    }
  }
  return best;
}

TEST(BladePass, FindsTheErrorOfTheMotorsClock) {
  const auto check = check_by_blade_pass(runs());
  ASSERT_TRUE(check);
  EXPECT_GE(check->lines.size(), 48u) << "of 72 steps";
  EXPECT_NEAR(check->gain.value, 1 + kClockError, 2e-4);
  EXPECT_LT(check->gain.u, 1e-4);
  EXPECT_LE(check->lower, 1 + kClockError);
  EXPECT_GE(check->upper, 1 + kClockError);
  EXPECT_FALSE(check->against({1 + kClockError, 1.2e-5}).rejected());
  EXPECT_TRUE(check->against({1, 1.2e-5}).rejected()) << "a motor that believes its clock is found out";
}

TEST(BladePass, FindsNothingWithTheWrongNumberOfBlades) {
  auto other = runs();
  for (auto& run : other) run.header.blades = 4;
  const auto check = check_by_blade_pass(other);
  EXPECT_FALSE(check && check->lines.size() > 4);
}

TEST(Dynamics, FindTheLagOfTheThrust) {
  const auto found = identify_dynamics(runs());
  ASSERT_TRUE(found);
  const double truth = sim::LoadCellParameters{}.thrust_lag;
  EXPECT_NEAR(found->thrust_lag_s.value / truth, 1, 0.05);
  EXPECT_NEAR(found->thrust_lag_s.value, truth, 3 * found->thrust_lag_s.u);
  EXPECT_LT(found->thrust_lag_s.u, 0.008) << "the bench reads the speed at one distance from all commands";
  for (const auto& run : runs()) {
    const results::StepMean step = results::reduce(run).front();
    EXPECT_NEAR(step.lag_s, truth, 2.5 * step.lag_u_s) << "the reduction of each run finds the same lag";
  }
}

/// A rotor so heavy that the module's own speed filter, 0.3 ms, is small beside its time constant.
TEST(Dynamics, FindTheTimeConstantOfTheShaft) {
  sim::PlantParameters plant;
  plant.motor.rotor_inertia = 5e-5;
  const Recorded recorded = record("0", 3, plant);
  const auto found = identify_dynamics(recorded.runs);
  ASSERT_TRUE(found);
  const FirstOrder truth = true_response(recorded);
  EXPECT_NEAR(found->motor_time_constant_s.value / truth.time_constant, 1, 0.05) << truth.time_constant;
  EXPECT_NEAR(found->motor_delay_s.value, truth.delay, 0.001);
}

TEST(Torque, IsFoundToOnePercent) {
  std::vector<results::StepMean> steps;
  for (const auto& run : runs()) {
    for (auto step : results::reduce(run)) {
      step.speed_rad_s *= 1 + kClockError;  // what the bench file's clock gain does
      steps.push_back(step);
    }
  }
  const Identification found = identify(steps);
  const auto torque = torque_coefficients(found, {});
  ASSERT_EQ(torque.size(), 3u);
  for (const TorqueCoefficient& one : torque) {
    const double truth = sim::torque_coefficient(*sim::find_propeller("5x3"), one.phi_deg);
    EXPECT_NEAR(one.k_q.value / truth, 1, 0.01) << one.phi_deg;
  }
  EXPECT_NEAR(torque[2].share.value, 0.96, 0.01);
}

/// A motor of which every constant is known: 50 readings a second, at odd times.
results::RunRecording known_motor(double time_constant, double delay, double lag) {
  results::RunRecording run;
  run.header.blades = 3;
  run.header.load_cell.counts_per_newton = 1e6;
  const double k = 1.5e-6, tick = 1.0 / 7000;
  double commanded = 600, old = 600, speed = 600, thrust = k * speed * speed, since = 0;
  double next_command = 1, next_reading = 0.003;
  int step = 0;
  run.phases.push_back({results::Phase::step, step, 0, commanded});
  for (std::uint32_t i = 0; i < 21 * 7000; ++i) {
    const double t = i * tick;
    if (t >= next_command && step < 19) {
      old = commanded;
      commanded += 60;
      run.phases.push_back({results::Phase::step, ++step, static_cast<Nanoseconds>(1e9 * t), commanded});
      since = t;
      next_command += 1.0;
    }
    const double after = t - since - delay;
    speed = after > 0 ? commanded + (old - commanded) * std::exp(-after / time_constant) : old;
    thrust += tick / lag * (k * speed * speed - thrust);
    LoadCellRecord record;
    record.counts[2] = static_cast<std::int32_t>(1e6 * thrust);
    record.rdt_sequence = record.ft_sequence = i;
    record.arrival_ns = static_cast<Nanoseconds>(1e9 * t);
    run.load_cell.push_back(record);
    if (t >= next_reading) {
      run.motor.push_back({MotorChannel::speed, static_cast<Nanoseconds>(1e9 * t), 0, speed});
      next_reading += 0.0197 + 0.0006 * ((i * 2654435761u >> 16) % 100) / 100.0;
    }
  }
  run.phases.push_back({results::Phase::end, -1, static_cast<Nanoseconds>(21e9), 0});
  return run;
}

TEST(Dynamics, FindTimeConstantAndDelayOfAKnownMotor) {
  const std::vector<results::RunRecording> known{known_motor(0.045, 0.012, 0.08)};
  const auto found = identify_dynamics(known);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->motor_time_constant_s.value / 0.045, 1, 0.05);
  EXPECT_NEAR(found->motor_delay_s.value, 0.012, 0.0015);
  EXPECT_NEAR(found->thrust_lag_s.value / 0.08, 1, 0.05);
}

TEST(Dynamics, NeedSteps) {
  std::vector<results::RunRecording> known{known_motor(0.045, 0.012, 0.08)};
  known[0].phases.erase(known[0].phases.begin() + 2, known[0].phases.end() - 1);
  EXPECT_FALSE(identify_dynamics(known));
  EXPECT_FALSE(identify_dynamics({}));
}

}  // namespace bench_truth_test
}  // namespace kphi::fit
