// Every flag that a step can carry: what raises it, and what does not.
#include <gmock/gmock.h>

#include "results/reduction/reduction.hpp"
#include "results/steps_csv.hpp"
#include "test/results/synthetic_run.hpp"

namespace kphi::results::quality_flags_test {

using namespace test;

/// A run whose module says `value` of `channel` once in the middle of each step.
RunRecording with_readings(MotorChannel channel, double value) {
  auto run = make_run(Truth{});
  run.header.supply_voltage_v = 16;
  run.header.coil_temperature_max_degc = 110;
  for (std::size_t i = 0; i + 1 < run.phases.size(); ++i) {
    if (run.phases[i].phase != Phase::step) continue;
    const auto end = run.phases[i + 1].time_ns;
    run.motor.push_back({channel, end - 1'000'000, 0, value});
  }
  std::stable_sort(run.motor.begin(), run.motor.end(), [](const auto& a, const auto& b) {
    return a.channel != b.channel ? a.channel < b.channel : a.time_ns < b.time_ns;
  });
  return run;
}

TEST(QualityFlags, JudgesWhatTheMotorModuleReports) {
  const auto flags = [](MotorChannel channel, double value) {
    return quality_flag_names(reduce(with_readings(channel, value)).at(1).quality_flags);
  };
  EXPECT_EQ(flags(MotorChannel::drive_pwm, 0.97), "");
  EXPECT_EQ(flags(MotorChannel::drive_pwm, 0.98), "drive_saturated");
  EXPECT_EQ(flags(MotorChannel::drive_pwm, -0.99), "drive_saturated");
  EXPECT_EQ(flags(MotorChannel::fault_now, 0), "");
  EXPECT_EQ(flags(MotorChannel::fault_now, 2), "motor_fault");
  EXPECT_EQ(flags(MotorChannel::supply_voltage, 14.5), "");
  EXPECT_EQ(flags(MotorChannel::supply_voltage, 14.3), "supply_out_of_band");
  EXPECT_EQ(flags(MotorChannel::supply_voltage, 17.7), "supply_out_of_band");
  EXPECT_EQ(flags(MotorChannel::coil_temperature, 109), "");
  EXPECT_EQ(flags(MotorChannel::coil_temperature, 110), "coil_hot");
  EXPECT_EQ(flags(MotorChannel::coil_temperature, std::nan("")), "coil_hot") << "what is not a number is not good";
  EXPECT_EQ(flags(MotorChannel::fault_now, std::nan("")), "motor_fault");
}

TEST(QualityFlags, ChecksVoltageAndCoilOnlyAgainstLimitsThatTheRunHas) {
  for (const auto& [channel, value] :
       {std::pair{MotorChannel::supply_voltage, 5.0}, std::pair{MotorChannel::coil_temperature, 500.0}}) {
    auto run = with_readings(channel, value);
    run.header.supply_voltage_v = run.header.coil_temperature_max_degc = 0;
    EXPECT_EQ(reduce(run).at(1).quality_flags, 0u);
  }
}

TEST(QualityFlags, ASupplyMayLimitBeforeTheStepIsSettledButNotBeOff) {
  RunRecording run = make_run({});
  const Nanoseconds begin = run.phases[2].time_ns, late = begin + 1'900'000'000;
  run.supply = {{begin + 1'000'000, 0, 14, 9, 16, 9, SupplyRegulation::constant_current, SupplyProtection::none, 1},
                {late, 0, 16, 1, 16, 9, SupplyRegulation::constant_voltage, SupplyProtection::none, 1},
                {late + 1'000'000, 0, 15.5, 3, 16, 9, SupplyRegulation::constant_voltage, SupplyProtection::none, 1}};
  const StepMean step = reduce(run).at(1);
  EXPECT_EQ(quality_flag_names(step.quality_flags), "");
  EXPECT_DOUBLE_EQ(step.supply_w, (16 + 46.5) / 2) << "the mean of the products";
  run.supply[0].output = 0;
  EXPECT_EQ(quality_flag_names(reduce(run).at(1).quality_flags), "supply_off");
  run.supply[0].output = 1, run.supply[0].protection = SupplyProtection::over_voltage, run.supply[1].voltage_v = 16.6;
  EXPECT_EQ(quality_flag_names(reduce(run).at(1).quality_flags), "supply_off+supply_rise");
}

TEST(QualityFlags, FlagsAStepThatDoesNotSettleAndDoesNotAverageItAsIfItHad) {
  Truth truth;
  truth.noise_n = 0.001;
  truth.thrust_tau_s = 1.5;  // of the cell; the speed is there at once
  const auto steps = reduce(make_run(truth));
  EXPECT_TRUE(has(steps[1], QualityFlag::unsettled));
  EXPECT_FALSE(has(steps[1], QualityFlag::speed_not_reached));
}

TEST(QualityFlags, CountsSpeedsThatNoRotorCanHaveAndLeavesThemOut) {
  RunRecording run = make_run({});
  for (auto& r : run.motor) {
    if (r.channel == MotorChannel::speed && r.time_ns > 4'500'000'000 && r.time_ns < 4'515'000'000) r.value *= 2;
  }
  const auto steps = reduce(run);
  EXPECT_EQ(steps[1].speed_glitches, 1u);
  EXPECT_EQ(quality_flag_names(steps[1].quality_flags), "speed_glitch");
  EXPECT_NEAR(steps[1].speed_rad_s, 800, 0.01);
  EXPECT_EQ(steps[0].speed_glitches, 0u);
}

TEST(QualityFlags, NoticesACellThatRepeatsOneValueWithinAStep) {
  RunRecording run = make_run({});
  for (std::size_t i = 4500; i < 4700; ++i) run.load_cell[i].counts = run.load_cell[4500].counts;
  EXPECT_THAT(steps_flagged(reduce(run), QualityFlag::frozen), testing::ElementsAre(1));
}

TEST(QualityFlags, NoticesASpeedThatIsRepeatedWithinAStep) {
  const auto repeated_for = [](Nanoseconds span) {
    RunRecording run = make_run({});
    for (auto& r : run.motor) {
      if (r.channel == MotorChannel::speed && r.time_ns >= 4'500'000'000 && r.time_ns <= 4'500'000'000 + span)
        r.value = std::copysign(801, r.value);
    }
    return reduce(run);
  };
  const auto steps = repeated_for(150'000'000);
  EXPECT_EQ(quality_flag_names(steps[1].quality_flags), "frozen");
  EXPECT_FALSE(has(steps[0], QualityFlag::frozen));
  EXPECT_FALSE(has(repeated_for(80'000'000)[1], QualityFlag::frozen)) << "less than a tenth of a second";
}

TEST(QualityFlags, AThrustThatFadesAtConstantSpeedDrifts) {
  RunRecording run = make_run({});
  for (std::size_t i = 3000; i < 5000; ++i) {
    run.load_cell[i].counts[2] += static_cast<std::int32_t>(40 * (static_cast<int>(i) - 3000));  // 80 mN of 770
  }
  EXPECT_THAT(steps_flagged(reduce(run), QualityFlag::drifted), testing::ElementsAre(1));
}

TEST(QualityFlags, AZeroThatMovesFurtherThanToleratedFlagsAllSteps) {
  Truth truth;  // 1.7 N at most: 0.02 N are tolerated; 10 s from zero to zero
  truth.noise_n = 0.001;
  truth.drift_n_per_s = 0.0018;
  for (const StepMean& step : reduce(make_run(truth))) EXPECT_EQ(quality_flag_names(step.quality_flags), "");
  truth.drift_n_per_s = 0.0024;
  const Reduced reduced = reduce_with_zeros(make_run(truth));
  EXPECT_NEAR(reduced.zero.moved_n, truth.sign * 0.0024 * 9.5, 0.002);
  EXPECT_EQ(reduced.zero.tolerated_n, 0.02);
  ASSERT_EQ(reduced.steps.size(), 3u);
  for (const StepMean& step : reduced.steps) EXPECT_EQ(quality_flag_names(step.quality_flags), "zero_drifted");
}

TEST(QualityFlags, ARunWithoutOneOfItsZerosIsFlaggedBecauseNobodyKnowsHowFarItMoved) {
  const Truth truth;
  RunRecording run = make_run(truth);
  const auto last = static_cast<Nanoseconds>(1e9 * spin_down_at(truth));
  std::erase_if(run.load_cell, [&](const auto& record) { return record.arrival_ns > last; });
  for (const StepMean& step : reduce(run)) {
    EXPECT_EQ(quality_flag_names(step.quality_flags), "zero_drifted");
    EXPECT_NEAR(k_of(step), truth.k, 0.02 * truth.k);
  }
  run.outcome = Outcome::aborted;
  EXPECT_EQ(quality_flag_names(reduce(run)[0].quality_flags), "lag_unknown")
      << "that it lacks the second zero is known";
}

TEST(QualityFlags, ALargeThrustToleratesHalfAPercentOfDrift) {
  Truth truth;
  truth.noise_n = 0.001;
  truth.k = 1.2e-5;  // 17.3 N
  truth.drift_n_per_s = 0.0072;
  const Reduced tolerated = reduce_with_zeros(make_run(truth));
  EXPECT_NEAR(tolerated.zero.tolerated_n, 0.0864, 0.0002);
  EXPECT_EQ(quality_flag_names(tolerated.steps[0].quality_flags), "");
  truth.drift_n_per_s = 0.0105;
  EXPECT_EQ(quality_flag_names(reduce(make_run(truth))[0].quality_flags), "zero_drifted");
}

TEST(QualityFlags, ANoisyZeroFlagsAllSteps) {
  Truth truth;
  truth.noise_n = 0.14;
  for (const StepMean& step : reduce(make_run(truth))) EXPECT_FALSE(has(step, QualityFlag::zero_noisy));
  truth.noise_n = 0.16;
  for (const StepMean& step : reduce(make_run(truth))) EXPECT_TRUE(has(step, QualityFlag::zero_noisy));
}

TEST(QualityFlags, ASpeedThatNeverArrivesIsFlagged) {
  Truth truth;
  truth.motor_tau_s = 20;
  const auto steps = reduce(make_run(truth));
  EXPECT_TRUE(has(steps[0], QualityFlag::speed_not_reached));
  EXPECT_EQ(steps[0].window_begin_s, truth.zero_s + 1);
}

TEST(QualityFlags, AnUnsteadySpeedIsFlagged) {
  RunRecording run = make_run({});
  int n = 0;
  for (auto& reading : run.motor) {
    if (reading.channel == MotorChannel::speed) reading.value += (n++ % 2 == 0 ? 30 : -30);
  }
  EXPECT_TRUE(has(reduce(run)[2], QualityFlag::speed_unsteady));
}

TEST(QualityFlags, ARotorThatIsHeldAtTheVeryEndOfAStepIsFlaggedThoughItsMeanSpeedEndsBefore) {
  Truth truth;
  truth.thrust_delay_s = 0.05;
  RunRecording run = make_run(truth);
  const auto end = static_cast<Nanoseconds>(1e9 * spin_down_at(truth));
  for (auto& reading : run.motor) {
    if (reading.channel == MotorChannel::speed && reading.time_ns >= end - 45'000'000) reading.value = 0;
  }
  const auto steps = reduce(run);
  EXPECT_FALSE(has(steps[1], QualityFlag::speed_unsteady));
  EXPECT_TRUE(has(steps.back(), QualityFlag::speed_unsteady));
  EXPECT_NEAR(steps.back().speed_rad_s, steps.back().commanded_speed_rad_s, 1);
}

TEST(QualityFlags, LostSamplesAreFlaggedWhereTheyWereLost) {
  Truth truth;
  truth.lose = [](std::uint64_t n) { return n >= 4500 && n < 4510; };  // second step: 4 s to 5 s
  const auto steps = reduce(make_run(truth));
  EXPECT_THAT(steps_flagged(steps, QualityFlag::lost_samples), testing::ElementsAre(1));
  EXPECT_NEAR(k_of(steps[1]), truth.k, 5e-3 * truth.k);

  truth.lose = [](std::uint64_t n) { return n >= 3100 && n < 3200; };  // in the discarded second of a step
  for (const StepMean& step : reduce(make_run(truth))) EXPECT_FALSE(has(step, QualityFlag::lost_samples));

  truth.lose = [](std::uint64_t n) { return n >= 3900 && n < 4300; };  // across the begin of a window
  EXPECT_TRUE(has(reduce(make_run(truth))[1], QualityFlag::lost_samples));
}

TEST(QualityFlags, AlmostNoSamplesAreFlagged) {
  Truth truth;
  truth.lose = [](std::uint64_t n) { return n >= 4050 && n < 5000; };
  EXPECT_TRUE(has(reduce(make_run(truth))[1], QualityFlag::few_samples));
  truth.lose = [](std::uint64_t n) { return n >= 3500 && n < 5500; };
  const StepMean step = reduce(make_run(truth))[1];
  EXPECT_TRUE(has(step, QualityFlag::few_samples));
  EXPECT_TRUE(has(step, QualityFlag::lost_samples));
  EXPECT_TRUE(std::isnan(step.thrust_n));
}

TEST(QualityFlags, StepsWhoseUncertaintyNobodyKnowsAreFlagged) {
  Truth truth;
  truth.reading_s = 0.25;  // four readings of the speed in a window
  for (const StepMean& step : reduce(make_run(truth))) {
    EXPECT_GE(step.speed_n, 3u);
    EXPECT_TRUE(std::isnan(step.speed_u_rad_s));
    EXPECT_TRUE(has(step, QualityFlag::few_samples));
  }
}

TEST(QualityFlags, StatusWordsBecomeFlags) {
  const auto flags_with = [](std::uint32_t word, std::uint32_t saturation_bits = 1u << 17) {
    Truth truth;
    truth.status = [word](double t) { return t > 4.5 && t < 4.51 ? word : 0u; };
    RunRecording run = make_run(truth);
    run.header.load_cell.saturation_bits = saturation_bits;
    const auto steps = reduce(run);
    EXPECT_EQ(steps[0].quality_flags, 0u);
    return quality_flag_names(steps[1].quality_flags);
  };
  EXPECT_EQ(flags_with(0x80020000u), "saturated");
  EXPECT_EQ(flags_with(0x80010000u), "");  // a monitor condition is no error
  EXPECT_EQ(flags_with(0x80000010u), "bad_status");
  EXPECT_EQ(flags_with(0x80000000u), "bad_status") << "an error without a cause";
  EXPECT_EQ(flags_with(0x80020010u), "saturated+bad_status");
  constexpr std::uint32_t kAxia = 1u << 27 | 1u << 30;
  EXPECT_EQ(flags_with(0xC0000000u, kAxia), "saturated");
  EXPECT_EQ(flags_with(0x88000000u, kAxia), "saturated");
  EXPECT_EQ(flags_with(0x80000004u, kAxia), "bad_status");
  EXPECT_EQ(flags_with(0xC0000004u, kAxia), "saturated+bad_status");
}

/// The box starts anew at 4 s, in the second step, with another bias.
RunRecording rebooted_run(double shift_n) {
  Truth truth;
  truth.drift_n_per_s = 0;
  RunRecording run = make_run(truth);
  for (std::size_t i = 4000; i < run.load_cell.size(); ++i) {
    run.load_cell[i].ft_sequence = static_cast<std::uint32_t>(7 * (i - 4000));
    run.load_cell[i].counts[2] += static_cast<std::int32_t>(1e6 * shift_n);
  }
  return run;
}

TEST(QualityFlags, AZeroHoldsForOnePowerUpOfTheBox) {
  const Truth truth;
  const auto steps = reduce(rebooted_run(0.5));
  EXPECT_EQ(quality_flag_names(steps[0].quality_flags), "zero_drifted") << "nobody knows how far";
  EXPECT_NEAR(k_of(steps[0]), truth.k, 0.02 * truth.k) << "the zero after the run is that of another bias";
  EXPECT_TRUE(has(steps[1], QualityFlag::rebooted));
  EXPECT_EQ(quality_flag_names(steps[2].quality_flags), "rebooted+zero_drifted");
  EXPECT_NEAR(k_of(steps[2]), truth.k, 0.005 * truth.k) << "the zero after the run is of the same power-up";
}

TEST(QualityFlags, AGapThatARestartOfTheBoxHidesIsLostAllTheSame) {
  RunRecording run = rebooted_run(0);
  const auto cut = [&](std::ptrdiff_t from, std::ptrdiff_t to) {
    run.load_cell.erase(run.load_cell.begin() + from, run.load_cell.begin() + to);
  };
  cut(4000, 4050);
  EXPECT_FALSE(has(reduce(run)[1], QualityFlag::lost_samples)) << "a twentieth of the window";
  cut(4000, 4250);
  EXPECT_TRUE(has(reduce(run)[1], QualityFlag::lost_samples)) << "nearly a third";
}

TEST(QualityFlags, AZeroAfterARestartOfTheBoxIsAGoodZero) {
  RunRecording run = make_run({});
  for (std::size_t i = 0; i < run.load_cell.size(); ++i) {
    run.load_cell[i].ft_sequence = static_cast<std::uint32_t>(7 * (i < 300 ? i : i - 300));
    if (i < 300) run.load_cell[i].counts[2] += 900'000;
  }
  for (const StepMean& step : reduce(run)) {
    EXPECT_EQ(quality_flag_names(step.quality_flags), "");
    EXPECT_NEAR(step.thrust_n, 1.2e-6 * step.speed_rad_s * step.speed_rad_s, 0.01);
  }
}

TEST(QualityFlags, EventsOfTheStreamAreFlaggedWhereTheyHappened) {
  RunRecording run = make_run({});
  run.events.push_back({EventKind::restarted, 4'000'000'000, 0, ""});
  const auto steps = reduce(run);
  EXPECT_EQ(quality_flag_names(steps[0].quality_flags), "");
  EXPECT_EQ(quality_flag_names(steps[1].quality_flags), "stream_restarted");
  EXPECT_EQ(quality_flag_names(steps[2].quality_flags), "");
}

TEST(QualityFlags, ACountAtTheEndOfItsRangeIsSaturation) {
  RunRecording run = make_run({});
  run.load_cell[4500].counts[2] = 120000000;
  EXPECT_THAT(steps_flagged(reduce(run), QualityFlag::saturated), testing::ElementsAre(1));
}

TEST(QualityFlags, ADeratingModuleIsFlagged) {
  RunRecording run = make_run({});
  for (auto& r : run.motor) {
    if (r.channel == MotorChannel::derate && r.time_ns > 4200000000 && r.time_ns < 4300000000) r.value = 0.9;
  }
  EXPECT_THAT(steps_flagged(reduce(run), QualityFlag::derated), testing::ElementsAre(1));
}

}  // namespace kphi::results::quality_flags_test
