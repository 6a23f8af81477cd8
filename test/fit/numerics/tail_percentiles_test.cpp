#include "fit/numerics/tail_percentiles.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>

namespace kphi::fit {
namespace {

TailPercentiles by_sorting(std::vector<double> samples, double level) {
  std::sort(samples.begin(), samples.end());
  const auto at = [&](double share) {
    return samples[static_cast<std::size_t>(share * static_cast<double>(samples.size() - 1) + 0.5)];
  };
  return {at((1 - level) / 2), at((1 + level) / 2)};
}

void expect_as_sorted(const std::vector<double>& samples, double level) {
  std::vector<double> room;
  const TailPercentiles found = tail_percentiles(samples, scatter_of(samples), level, room);
  const TailPercentiles sorted = by_sorting(samples, level);
  EXPECT_EQ(found.lower, sorted.lower) << samples.size() << " samples, level " << level;
  EXPECT_EQ(found.upper, sorted.upper) << samples.size() << " samples, level " << level;
}

constexpr double kLevels[] = {0, 0.5, 0.68, 0.9, 0.95, 0.999, 1};

TEST(TailPercentiles, AreThoseOfTheSortedSamplesWhateverTheirDistribution) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal(3, 0.1);
  std::lognormal_distribution<double> skewed(0, 2);
  std::uniform_int_distribution<int> few(0, 3);
  for (const std::size_t n : {2u, 3u, 10u, 101u, 10'000u}) {
    std::vector<double> samples(n);
    for (const double level : kLevels) {
      for (double& sample : samples) sample = normal(random);
      expect_as_sorted(samples, level);
      for (double& sample : samples) sample = -skewed(random);
      expect_as_sorted(samples, level);
      for (double& sample : samples) sample = few(random);
      expect_as_sorted(samples, level);
      expect_as_sorted(std::vector<double>(n, 1.5), level);
    }
  }
}

TEST(TailPercentiles, OfTheWrongScatterAreTheSame) {
  std::vector<double> samples(1000), room;
  std::iota(samples.begin(), samples.end(), 0.0);
  for (const Scatter& scatter :
       {Scatter{0, 1}, Scatter{1e6, 1}, Scatter{-1e6, 0}, Scatter{500, 0}, Scatter{500, -300}}) {
    const TailPercentiles found = tail_percentiles(samples, scatter, 0.9, room);
    EXPECT_EQ(found.lower, 50);
    EXPECT_EQ(found.upper, 949);
  }
}

TEST(TailPercentiles, OfWhatIsNoNumberAreNone) {
  std::vector<double> samples(100, 1.0), room;
  samples[50] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(std::isnan(tail_percentiles(samples, scatter_of(samples), 0.95, room).lower));
  samples[50] = std::numeric_limits<double>::infinity();
  EXPECT_TRUE(std::isnan(tail_percentiles(samples, scatter_of(samples), 0.95, room).upper));
}

TEST(Scatter, IsTheMeanAndTheDeviationOfASample) {
  const std::vector<double> samples{1, 2, 3, 6};
  EXPECT_DOUBLE_EQ(scatter_of(samples).mean, 3);
  EXPECT_DOUBLE_EQ(scatter_of(samples).deviation, std::sqrt(14.0 / 3));
}

}  // namespace
}  // namespace kphi::fit
