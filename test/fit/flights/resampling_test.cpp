// Channels on one grid, and the delay between two of them.
#include "fit/flights/resampling.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

namespace kphi::fit {
namespace resampling_test {

constexpr double kPi2 = 2 * M_PI;

FlightChannel sampled(double rate_hz, double seconds, const std::function<double(double)>& value, double jitter = 0) {
  std::mt19937 dice(7);
  std::uniform_real_distribution<double> shift(-jitter, jitter);
  FlightChannel channel;
  for (double k = 0; k < rate_hz * seconds; ++k) {
    channel.time_s.push_back((k + shift(dice)) / rate_hz);
    channel.values.push_back(value(channel.time_s.back()));
  }
  return channel;
}

double amplitude(const std::vector<double>& values) {
  double squares = 0, n = 0;
  for (const double value : values)
    if (!std::isnan(value)) squares += value * value, ++n;
  return std::sqrt(2 * squares / n);
}

TEST(Resampling, KeepsALineWhateverTheTimes) {
  const FlightChannel line = sampled(
      870, 2, [](double t) { return 3 - 2 * t; }, 0.4);
  for (const double step : {1e-4, 1e-3, 0.01}) {
    const TimeGrid grid{0.1, step, 100};
    const std::vector<double> values = resample(line, grid, 1);
    for (std::size_t i = 0; i < grid.count; ++i) EXPECT_NEAR(values[i], 3 - 2 * grid.time(i), 1e-12);
  }
}

TEST(Resampling, TakesAwayWhatWouldAlias) {
  const TimeGrid grid{0.05, 0.01, 990};  // 100 Hz
  const auto of = [&](double hertz) {
    return amplitude(resample(sampled(2000, 10, [&](double t) { return std::sin(kPi2 * hertz * t); }), grid, 1));
  };
  EXPECT_NEAR(of(10), 0.967, 0.002);
  EXPECT_LT(of(90), 0.013) << "would be seen as 10 Hz";
  EXPECT_LT(of(110), 0.011);
  EXPECT_LT(of(403), 0.001);
}

TEST(Resampling, SaysNothingInGapsAndBeyondTheEnds) {
  FlightChannel channel = sampled(1000, 1, [](double) { return 1.0; });
  channel.time_s.erase(channel.time_s.begin() + 400, channel.time_s.begin() + 500);
  channel.values.erase(channel.values.begin() + 400, channel.values.begin() + 500);
  const TimeGrid grid{-0.1, 0.01, 130};
  const std::vector<double> values = resample(channel, grid, 0.02);
  for (std::size_t i = 0; i < grid.count; ++i) {
    const double t = grid.time(i);
    const bool known = (t > 0.0101 && t < 0.388) || (t > 0.512 && t < 0.988);
    const bool unknown = t < -1e-9 || (t > 0.401 && t < 0.499) || t > 1;
    if (known) {
      EXPECT_NEAR(values[i], 1, 1e-12) << t;
    } else if (unknown) {
      EXPECT_TRUE(std::isnan(values[i])) << t;
    }
  }
}

TEST(Resampling, FindsTheTimesThatChannelsShare) {
  const FlightChannel a{{0, 1, 2}, {1, 1, 1}}, b{{0.5, 3}, {1, 1}}, none;
  EXPECT_EQ(common_grid(std::vector{&a, &b}, 0.25).count, 7u);
  EXPECT_EQ(common_grid(std::vector{&a, &b}, 0.25).start_s, 0.5);
  EXPECT_EQ(common_grid(std::vector{&a, &none}, 0.25).count, 0u);
}

/// Seconds of noise below 20 Hz.
std::vector<double> band(unsigned seed, std::size_t size) {
  std::mt19937 dice(seed);
  std::normal_distribution<double> noise;
  std::vector<double> values(size);
  double slow = 0, slower = 0;
  for (double& value : values) {
    slow += 0.1 * (noise(dice) - slow), slower += 0.1 * (slow - slower);
    value = slower;
  }
  return values;
}

double at(const std::vector<double>& x, double place) {
  const auto i = static_cast<std::size_t>(place);
  const double s = place - static_cast<double>(i);
  // Six points of Lagrange: another formula than that which is tested.
  double sum = 0;
  for (int j = -2; j <= 3; ++j) {
    double weight = 1;
    for (int k = -2; k <= 3; ++k)
      if (k != j) weight *= (s - k) / (j - k);
    sum += weight * x[static_cast<std::size_t>(static_cast<int>(i) + j)];
  }
  return sum;
}

TEST(Delay, IsFoundToAFractionOfAStepWithinItsUncertainty) {
  constexpr double kStep = 2e-3, kTrue = 0.0371;
  int covered = 0;
  constexpr int kSeeds = 200;
  for (unsigned seed = 0; seed < kSeeds; ++seed) {
    const std::vector<double> x = band(seed, 3000);
    std::mt19937 dice(seed + 1000);
    std::normal_distribution<double> noise(0, 0.05);
    std::vector<double> y(x.size(), NAN);
    double coloured = 0;
    for (std::size_t i = 30; i + 10 < x.size(); ++i) {
      coloured = 0.9 * coloured + 0.436 * noise(dice);
      if (i < 1000 || i > 1200) y[i] = 2.5 * at(x, static_cast<double>(i) - kTrue / kStep) + 1 + coloured;
    }
    const auto delay = delay_between(x, y, kStep, 0.1);
    ASSERT_TRUE(delay);
    EXPECT_NEAR(delay->seconds, kTrue, 0.25 * kStep);
    EXPECT_NEAR(delay->scale, 2.5, 0.2);
    covered += std::abs(delay->seconds - kTrue) < 2.05 * delay->u_s ? 1 : 0;
  }
  EXPECT_GE(covered, 0.90 * kSeeds);
  EXPECT_LE(covered, 0.99 * kSeeds);
}

TEST(Delay, IsNotToldWhereNothingTells) {
  const std::vector<double> x = band(1, 500), flat(500, 1.0), none(500, NAN);
  EXPECT_FALSE(delay_between(x, flat, 0.01, 0.5));
  EXPECT_FALSE(delay_between(flat, x, 0.01, 0.5));
  EXPECT_FALSE(delay_between(x, none, 0.01, 0.5));
  std::vector<double> late(500, 0.0);
  std::copy(x.begin(), x.end() - 80, late.begin() + 80);
  const Delay found = delay_between(x, late, 0.01, 1.0).value();
  EXPECT_NEAR(found.seconds, 0.8, 0.005);
  const auto too_short = delay_between(x, late, 0.01, 0.1);
  EXPECT_LT(too_short ? std::abs(too_short->correlation) : 0, found.correlation - 0.2)
      << "another peak is not taken for it";
}

}  // namespace resampling_test
}  // namespace kphi::fit
