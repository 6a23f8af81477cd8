// Whether the figures of a step are what they claim: runs of known truth through the whole reduction.
#include <gtest/gtest.h>

#include "results/reduction/bin_statistics.hpp"
#include "results/reduction/reduction.hpp"
#include "results/reduction/zeros.hpp"
#include "results/steps_csv.hpp"
#include "test/results/synthetic_run.hpp"

namespace kphi::results::step_study_test {
using namespace test;

constexpr double kRpm = M_PI / 30;

/// The paper's staircase, with every other of its 40 steps, on a drifting cell: 0.1 N per run.
Truth staircase(double motor_s, double delay_s) {
  Truth truth;
  truth.k = 1.55e-6;
  truth.speeds.clear();
  for (int i = 1; i < 40; i += 2) truth.speeds.push_back(kRpm * (100 + 19000.0 * i / 39));
  truth.zero_s = 2;
  truth.dwell_s = 2;
  truth.motor_tau_s = motor_s;
  truth.thrust_delay_s = delay_s;
  truth.drift_n_per_s = 0.1 / 47;
  truth.noise_n = 0.01;  // at 1 kHz; 0.03 N at 7 kHz
  truth.correlated_n = 0.004;
  truth.speed_noise_rad_s = 0.2;
  truth.reading_phase_s = 0.007;
  truth.ft_stride = 1;
  return truth;
}

struct Sums {
  double tx = 0, xx = 0;
  void add(double thrust, double speed) {
    tx += thrust * speed * speed;
    xx += std::pow(speed, 4);
  }
  [[nodiscard]] double k() const { return tx / xx; }
};

/// k of the steps that are settled.
double k_of(const std::vector<StepMean>& steps) {
  Sums sums;
  for (const StepMean& step : steps) {
    if (!has(step, QualityFlag::unsettled)) sums.add(step.thrust_n, step.speed_rad_s);
  }
  return sums.k();
}

/// What averaging the whole of each step over the commanded speed gives, with a zero taken before.
double k_of_fixed_windows(const RunRecording& run, const Truth& truth) {
  double zero = 0, zero_n = 0;
  std::vector<double> thrust(truth.speeds.size()), n(truth.speeds.size());
  for (const auto& record : run.load_cell) {
    const double t = 1e-9 * static_cast<double>(record.arrival_ns);
    const double step = std::floor((t - truth.zero_s) / truth.dwell_s);
    if (step < 0) {
      zero += record.counts[2];
      ++zero_n;
    } else if (step < static_cast<double>(thrust.size())) {
      thrust[static_cast<std::size_t>(step)] += record.counts[2];
      ++n[static_cast<std::size_t>(step)];
    }
  }
  Sums sums;
  for (std::size_t i = 0; i < thrust.size(); ++i) {
    sums.add(truth.sign * 1e-6 * (thrust[i] / n[i] - zero / zero_n), truth.speeds[i]);
  }
  return sums.k();
}

TEST(StepStudy, FindsTheCoefficientToATenthOfAPercentWhereFixedWindowsMissItByMoreThanOne) {
  for (const double motor : {0.02, 0.1, 0.4}) {
    for (const double delay : {0.0, 0.1, 0.3}) {
      const Truth truth = staircase(motor, delay);
      const auto run = make_run(truth);
      const auto steps = reduce(run);
      EXPECT_LT(std::abs(k_of(steps) / truth.k - 1), 0.001) << "motor " << motor << " s, delay " << delay << " s";
      EXPECT_NEAR(steps[0].lag_s, delay, 0.005) << "motor " << motor << " s, delay " << delay << " s";
      int settled = 0;
      for (const StepMean& step : steps) settled += !has(step, QualityFlag::unsettled);
      EXPECT_GE(settled, motor < 0.4 ? 17 : 10) << "of 20; the others are flagged";
      if (motor + delay < 0.2) continue;
      EXPECT_GT(std::abs(k_of_fixed_windows(run, truth) / truth.k - 1), 0.01) << motor << " " << delay;
    }
  }
}

TEST(StepStudy, ALagThatIsNotAppliedWouldShow) {
  // A motor so slow that it is still on its way: what the two channels show at the same time does not belong together.
  Truth truth = staircase(0.4, 0.3);
  truth.noise_n = 0.001;
  truth.correlated_n = 0;
  Sums aligned, at_once;
  const auto run = make_run(truth);
  for (const StepMean& step : reduce(run)) {
    aligned.add(step.thrust_n, step.speed_rad_s);
    double sum = 0, n = 0;
    for (const auto& r : run.motor) {
      const double t = 1e-9 * static_cast<double>(r.time_ns);
      if (r.channel != MotorChannel::speed || t < step.window_begin_s || t >= step.window_end_s) continue;
      sum += truth.spin * r.value;
      ++n;
    }
    at_once.add(step.thrust_n, sum / n);
  }
  EXPECT_LT(std::abs(aligned.k() / truth.k - 1), 0.0005);
  EXPECT_GT(std::abs(at_once.k() / truth.k - 1), 0.001);
}

struct Shares {
  double inside = 0;   ///< steps whose 95 % interval holds the true thrust
  double flagged = 0;  ///< called unsettled or drifted, which none of them is
};

/// Of 1,000 steps.
Shares shares(double correlated_n, double correlation_s) {
  Shares found;
  std::mt19937 random(5);
  std::uniform_real_distribution<double> drift(-0.1, 0.1);
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    Truth truth;
    truth.seed = seed;
    truth.speeds.clear();
    for (int i = 0; i < 10; ++i) truth.speeds.push_back(600 + 100.0 * i);
    truth.zero_s = 8;  // all steps of a run share its error: the less of it, the more are independent
    truth.motor_tau_s = 0.03;
    truth.thrust_delay_s = 0.04;
    truth.drift_n_per_s = drift(random) / 30;
    truth.noise_n = 0.01;
    truth.correlated_n = correlated_n;
    truth.correlation_s = correlation_s;
    const auto steps = reduce(make_run(truth));
    for (std::size_t i = 0; i < steps.size(); ++i) {
      const double expected = truth.k * truth.speeds[i] * truth.speeds[i];
      const bool inside =
          std::abs(steps[i].thrust_n - expected) <= student_95(steps[i].thrust_freedom) * steps[i].thrust_u_n;
      found.inside += inside ? 0.001 : 0;
      found.flagged += has(steps[i], QualityFlag::unsettled) || has(steps[i], QualityFlag::drifted) ? 0.001 : 0;
    }
    EXPECT_EQ(steps.size(), 10u);
  }
  return found;
}

TEST(StepStudy, StandardErrorsAreHonestForWhiteNoise) {
  const Shares found = shares(0, 1);
  EXPECT_GE(found.inside, 0.93);
  EXPECT_LE(found.inside, 0.97);
  EXPECT_LE(found.flagged, 0.0015) << "one of a thousand";
}

TEST(StepStudy, StandardErrorsAreHonestForCorrelatedNoise) {
  double flagged = 0;
  for (const double correlation_s : {0.003, 0.01, 0.03}) {
    const Shares found = shares(0.02, correlation_s);
    flagged += found.flagged / 3;
    EXPECT_GE(found.inside, 0.93) << correlation_s;
    EXPECT_LE(found.inside, 0.97) << correlation_s;
  }
  EXPECT_LE(flagged, 0.002) << "of both verdicts together";
}

TEST(StepStudy, ADeviationOverTheRootOfTheNumberWouldBeFiveTimesTooSmall) {
  Truth truth;
  truth.correlated_n = 0.02;
  truth.correlation_s = 0.03;
  truth.noise_n = 0.001;
  for (const StepMean& step : reduce(make_run(truth))) {
    const double white = step.thrust_sd_n / std::sqrt(static_cast<double>(step.thrust_samples));
    EXPECT_GT(step.thrust_u_n, 4 * white);
    EXPECT_LT(step.thrust_n_eff, 0.06 * static_cast<double>(step.thrust_samples));
  }
}

}  // namespace kphi::results::step_study_test
