#include "results/reduction/reduction.hpp"

#include <gtest/gtest.h>

#include "base/error.hpp"
#include "results/run_reader.hpp"
#include "results/steps_csv.hpp"
#include "test/results/synthetic_run.hpp"

namespace kphi::results::reduction_test {
using namespace test;

TEST(Reduction, FindsTheKnownCoefficientWithoutFlag) {
  const Truth truth;
  const auto steps = reduce(make_run(truth));
  ASSERT_EQ(steps.size(), truth.speeds.size());
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const StepMean& step = steps[i];
    EXPECT_EQ(step.step, static_cast<int>(i));
    EXPECT_EQ(step.commanded_speed_rad_s, truth.speeds[i]);
    EXPECT_NEAR(step.speed_rad_s, truth.speeds[i], 0.01);
    EXPECT_NEAR(step.thrust_n, truth.k * truth.speeds[i] * truth.speeds[i], 5 * truth.noise_n / std::sqrt(1000.0));
    EXPECT_NEAR(step.thrust_sd_n, truth.noise_n, 0.1 * truth.noise_n);
    EXPECT_NEAR(step.torque_nm, truth.torque_share * step.thrust_n, 2e-4);
    EXPECT_NEAR(static_cast<double>(step.thrust_samples), 850, 152) << "one slope in twenty looks like one by chance";
    EXPECT_EQ(step.supply_voltage_v, 16.0);
    EXPECT_TRUE(std::isnan(step.motor_current_a));
    EXPECT_EQ(step.propeller, "5x3");
    EXPECT_EQ(step.repetition, 2);
    EXPECT_EQ(quality_flag_names(step.quality_flags), "");
  }
}

TEST(Reduction, CorrectsSpeedsByTheGainOfTheModulesClock) {
  Truth truth;
  truth.speed_noise_rad_s = 0.2;
  auto run = make_run(truth);
  const auto reported = reduce(run);
  run.header.clock_gain = 1.005;
  const auto corrected = reduce(run);
  for (std::size_t i = 0; i < reported.size(); ++i) {
    EXPECT_DOUBLE_EQ(corrected[i].speed_rad_s, 1.005 * reported[i].speed_rad_s);
    EXPECT_DOUBLE_EQ(corrected[i].speed_sd_rad_s, 1.005 * reported[i].speed_sd_rad_s);
    EXPECT_GT(reported[i].speed_u_rad_s, 0.01);
    EXPECT_DOUBLE_EQ(corrected[i].speed_u_rad_s, 1.005 * reported[i].speed_u_rad_s);
    EXPECT_EQ(corrected[i].thrust_n, reported[i].thrust_n);
    EXPECT_EQ(corrected[i].window_begin_s, reported[i].window_begin_s);
    EXPECT_EQ(corrected[i].quality_flags, reported[i].quality_flags);
  }
  run.header.clock_gain = 1.02;
  EXPECT_EQ(reduce(run)[2].quality_flags, reported[2].quality_flags)
      << "the module holds what it reports, not what is true";
}

TEST(Reduction, RefusesAClockGainThatIsNotPositive) {
  for (const double gain : {0.0, -1.0, std::nan("")}) {
    auto run = make_run(Truth{});
    run.header.clock_gain = gain;
    EXPECT_THROW((void)reduce(run), RecordError) << gain;
  }
}

TEST(Reduction, TellsHowCertainItIs) {
  Truth truth;
  truth.thrust_delay_s = 0.05;
  for (const StepMean& step : reduce(make_run(truth))) {
    EXPECT_NEAR(step.thrust_u_n, truth.noise_n * std::sqrt(1 / 950.0 + 0.5 / 750.0), 0.0004) << "the step and its zero";
    EXPECT_NEAR(step.zero_u_n, truth.noise_n * std::sqrt(0.5 / 750.0), 0.0003);
    EXPECT_GT(step.thrust_n_eff, 400);
    EXPECT_GT(step.thrust_freedom, 5);
    EXPECT_NEAR(step.zero_moved_n, 0, 0.005);
    EXPECT_NEAR(step.lag_s, 0.05, 0.005);
    EXPECT_LT(step.lag_u_s, 0.01);
    EXPECT_EQ(quality_flag_names(step.quality_flags), "");
  }
}

TEST(Reduction, SignAndSpinOfTheMountingDoNotShow) {
  for (const int sign : {-1, 1}) {
    for (const int spin : {-1, 1}) {
      Truth truth;
      truth.sign = sign;
      truth.spin = spin;
      const auto steps = reduce(make_run(truth));
      EXPECT_NEAR(steps[2].thrust_n, 1.2e-6 * 1200 * 1200, 0.005);
      EXPECT_NEAR(steps[2].zero_n, sign * truth.zero_force_n, 0.005);
      EXPECT_GT(steps[2].torque_nm, 0);
      EXPECT_GT(steps[2].speed_rad_s, 0);
    }
  }
}

TEST(Reduction, ADriftingZeroIsInterpolatedInTime) {
  Truth truth;
  truth.noise_n = 0.001;
  truth.drift_n_per_s = 0.02;
  for (const StepMean& step : reduce(make_run(truth))) {
    EXPECT_NEAR(k_of(step), truth.k, 1e-3 * truth.k) << step.step;
    const double centre = 0.5 * (step.window_begin_s + step.window_end_s);
    EXPECT_NEAR(step.zero_n, truth.sign * (truth.zero_force_n + truth.drift_n_per_s * centre), 1e-3);
    EXPECT_NEAR(step.zero_moved_n, truth.sign * truth.drift_n_per_s * 10.25, 2e-3) << "from 0.5 to 10.75 s";
  }
}

TEST(Reduction, TheZeroOfTheTorqueIsSubtractedAndInterpolated) {
  RunRecording run = make_run({});
  const auto exact = reduce(run);
  for (auto& r : run.load_cell) r.counts[5] += 50000 + static_cast<std::int32_t>(r.arrival_ns / 1'000'000);  // 1 mN m/s
  const auto steps = reduce(run);
  for (std::size_t i = 0; i < steps.size(); ++i) EXPECT_NEAR(steps[i].torque_nm, exact[i].torque_nm, 1e-5) << i;
  run.header.load_cell.counts_per_newton_metre *= 2;
  EXPECT_NEAR(reduce(run)[2].torque_nm, exact[2].torque_nm / 2, 1e-5);
}

TEST(Reduction, FlagsAMeanOfUnknownUncertainty) {
  const auto too_few = [](double dwell_s, double reading_s) {
    Truth truth;
    truth.noise_n = 0.001;
    truth.motor_tau_s = 0.02;
    truth.dwell_s = dwell_s;
    truth.reading_s = reading_s;
    return has(reduce(make_run(truth)).at(1), QualityFlag::few_samples);
  };
  EXPECT_FALSE(too_few(1.2, 0.01));
  EXPECT_TRUE(too_few(1.05, 0.004)) << "five bins of thrust";
  EXPECT_TRUE(too_few(1.1, 0.02)) << "five readings of the speed";
}

TEST(Reduction, FlagsAStepWithoutSamples) {
  const Truth truth;
  RunRecording run = make_run(truth);
  std::erase_if(run.load_cell,
                [](const auto& r) { return r.arrival_ns > 3'100'000'000 && r.arrival_ns < 5'000'200'000; });
  const auto steps = reduce(run);
  EXPECT_TRUE(std::isnan(steps.at(1).thrust_n));
  EXPECT_TRUE(has(steps.at(1), QualityFlag::few_samples));
  EXPECT_NEAR(k_of(steps.at(2)), truth.k, 5e-3 * truth.k);
}

TEST(Reduction, ASlowMotorShrinksTheWindowInsteadOfSpoilingTheMean) {
  Truth truth;
  truth.noise_n = 0.001;
  truth.motor_tau_s = 0.3;
  truth.dwell_s = 3;
  const auto steps = reduce(make_run(truth));
  // 0 → 400 rad/s with 0.3 s is within 4 rad/s after 1.38 s; the thrust is within 0.1 % after 2.3 s.
  EXPECT_GE(steps[0].window_begin_s, truth.zero_s + 1.37);
  EXPECT_LE(steps[0].window_begin_s, truth.zero_s + 2.4);
  EXPECT_NEAR(steps[0].discarded_s, steps[0].window_begin_s - truth.zero_s, 1e-9);
  EXPECT_EQ(steps[0].window_end_s, truth.zero_s + truth.dwell_s);
  for (const StepMean& step : steps) {
    EXPECT_NEAR(k_of(step), truth.k, 2e-3 * truth.k);
    EXPECT_EQ(quality_flag_names(step.quality_flags), "");
  }
}

TEST(Reduction, TheZeroAfterIsOnlyTakenWhenTheMotorStands) {
  Truth truth;
  truth.noise_n = 0.001;
  RunRecording run = make_run(truth);
  const double after = spin_down_at(truth) + kSpinDown;
  for (auto& r : run.motor) {
    if (r.channel == MotorChannel::speed && 1e-9 * static_cast<double>(r.time_ns) > after) r.value = 100;
  }
  for (auto& r : run.load_cell) {
    if (1e-9 * static_cast<double>(r.arrival_ns) > after) r.counts[2] += 5000000;
  }
  for (const StepMean& step : reduce(run)) EXPECT_NEAR(k_of(step), truth.k, 5e-3 * truth.k);
}

TEST(Reduction, AnAbortedRunGivesTheStepsBeforeTheLast) {
  const Truth truth;
  RunRecording run = make_run(truth);
  const auto whole = reduce(run);
  run.outcome = Outcome::aborted;
  run.phases.resize(4);  // zero, three steps
  run.phases.push_back({Phase::spin_down, -1, 5500000000, 0});
  const auto steps = reduce(run);
  ASSERT_EQ(steps.size(), 2u);
  EXPECT_EQ(steps[0].step, 0);
  EXPECT_NEAR(steps[1].thrust_n, whole[1].thrust_n, 0.01);
}

TEST(Reduction, WithoutAZeroThereIsNoThrust) {
  RunRecording run = make_run({});
  std::erase_if(run.load_cell, [](const auto& r) { return r.arrival_ns < 1500000000 || r.arrival_ns > 7000000000; });
  EXPECT_THROW((void)reduce(run), RecordError);
  run = make_run({});
  run.header.load_cell.counts_per_newton = 0;
  EXPECT_THROW((void)reduce(run), RecordError);
}

TEST(Reduction, ARunWithoutStepsGivesNone) {
  RunRecording run = make_run({});
  run.phases.clear();
  run.load_cell.clear();
  EXPECT_TRUE(reduce(run).empty());
}

TEST(Reduction, GivesTheSameBytesFromMemoryAndFromTheFile) {
  const test::TemporaryFolder folder;
  Truth truth;
  truth.records_per_datagram = 40;
  const RunRecording run = make_run(truth);
  test::write_run(folder / "a.h5", run);
  EXPECT_EQ(format_steps(reduce(run)), format_steps(reduce(read_run(folder / "a.h5"))));
}

}  // namespace kphi::results::reduction_test
