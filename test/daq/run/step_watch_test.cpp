#include "daq/run/step_watch.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "base/random.hpp"

namespace kphi::daq {
namespace step_watch_test {

constexpr double kRate = 7000, kTick = 0.01;  // Hz, s

/// Feeds a watch tick by tick and returns when it first knows the thrust to `u_n`; 0: never.
double ends_at(StepWatch& watch, const std::function<double(double)>& thrust_n, double noise_n, double u_n,
               double most_s, std::uint64_t seed = 1) {
  Random random(seed);
  double sum = 0;
  std::uint64_t records = 0;
  for (double since = kTick; since < most_s; since += kTick) {
    const auto n = static_cast<std::uint64_t>(kRate * kTick);
    sum += static_cast<double>(n) * thrust_n(since) + noise_n * std::sqrt(static_cast<double>(n)) * random.normal();
    records += n;
    watch.add(since, records, sum / static_cast<double>(records));
    if (watch.known().u_n <= u_n) return since;
  }
  return 0;
}

TEST(StepWatch, EndsAQuietStepHalfASecondBehindTheDiscard) {
  StepWatch watch(0.2, 4);
  EXPECT_NEAR(ends_at(
                  watch, [](double) { return 3.0; }, 0.03, 0.01, 4),
              0.7, 0.05);
  EXPECT_NEAR(watch.known().mean_n, 3, 0.003);
}

TEST(StepWatch, WaitsUntilTheThrustHasSettled) {
  StepWatch watch(0.2, 4);
  const double end = ends_at(
      watch, [](double t) { return 3 * (1 - std::exp(-t / 0.3)); }, 0.03, 0.01, 4);
  EXPECT_GT(end, 1.5) << "seven time constants until 0.1 %, and the window";
  EXPECT_NEAR(watch.known().mean_n, 3, 0.01);
}

TEST(StepWatch, HoldsALoudStepLonger) {
  StepWatch quiet(0.2, 4), loud(0.2, 4);
  const auto steady = [](double) { return 3.0; };
  const double u = 0.004;
  const double short_one = ends_at(quiet, steady, 0.03, u, 4), long_one = ends_at(loud, steady, 0.5, u, 4);
  EXPECT_GT(long_one, short_one + 0.5) << "0.006 N at 1 s";
}

// On every tick of a step of ten minutes, beside the guard's limit of 0.4 s for a pause of the program.
TEST(StepWatch, OfALongStepIsAsQuickAsOfAShortOne) {
  StepWatch watch(0.2, 600);
  EXPECT_EQ(ends_at(
                watch, [](double) { return 3.0; }, 0.03, 0, 600),
            0)
      << "never that certain";
  EXPECT_NEAR(watch.known().mean_n, 3, 1e-3);
  EXPECT_LT(watch.known().u_n, 1e-4) << "all of it counts";
}

TEST(StepWatch, DoesNotKnowWhatStillDrifts) {
  StepWatch watch(0.2, 4);
  EXPECT_EQ(ends_at(
                watch, [](double t) { return 3 + 0.2 * t; }, 0.03, 0.01, 4),
            0);
}

TEST(StepWatch, IsNotConfusedByRecordsOfThePhaseBefore) {
  StepWatch watch(0.2, 4);
  EXPECT_TRUE(std::isnan(watch.known().u_n)) << "nothing seen";
  watch.add(0.02, 20'000, 99);
  EXPECT_TRUE(std::isnan(watch.known().u_n));
  EXPECT_NEAR(ends_at(
                  watch, [](double) { return 3.0; }, 0.03, 0.01, 4),
              0.7, 0.1);
}

}  // namespace step_watch_test
}  // namespace kphi::daq
