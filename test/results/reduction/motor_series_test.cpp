#include "results/reduction/motor_series.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace kphi::results::motor_series_test {

std::vector<MotorReading> speeds(std::initializer_list<double> values) {
  std::vector<MotorReading> readings;
  for (const double value : values) {
    readings.push_back({MotorChannel::speed, static_cast<Nanoseconds>(20'000'000 * readings.size()), 0, value});
  }
  return readings;
}

constexpr Window kAll{0, 1'000'000'000};

TEST(MotorSeries, LeavesOutSpeedsThatNoRotorCanHaveAndCountsThem) {
  const auto readings = speeds({800, 801, 1600, 799, 800, 800, 200, 150, 800, 801});
  const MotorSeries series(readings);
  EXPECT_EQ(series.glitches(kAll), 3u);
  EXPECT_NEAR(series.statistics(MotorChannel::speed, kAll).mean, 800, 1);
  EXPECT_EQ(series.statistics(MotorChannel::speed, kAll).n, 7u);
  EXPECT_EQ(series.glitches({100'000'000, 1'000'000'000}), 2u);
}

TEST(MotorSeries, KeepsEveryChangeThatGoesOneWay) {
  for (const auto& readings : {speeds({0, 0, 0, 600, 620, 628, 628}), speeds({900, 900, 500, 100, 0, 0, 0}),
                               speeds({0, 30, 900, 905, 910, 2000})}) {
    EXPECT_EQ(MotorSeries(readings).glitches(kAll), 0u);
  }
}

TEST(MotorSeries, IsFrozenWhereEightReadingsOfATurningRotorAreTheSame) {
  const auto frozen = [](std::initializer_list<double> values) {
    const auto readings = speeds(values);
    return MotorSeries(readings).speed_frozen(kAll);
  };
  const double nan = std::nan("");
  EXPECT_TRUE(frozen({799, 800, 800, 800, 800, 800, 800, 800, 800, 801}));
  EXPECT_TRUE(frozen({nan, 799, 800, 800, 800, 800, 800, 800, 800, 800}));
  EXPECT_FALSE(frozen({800, 800, 800, 800, 800, 800, 800, 801, 800, 800}));
  EXPECT_FALSE(frozen({0, 0, 0, 0, 0, 0, 0, 0, 0, 0})) << "it stands";
  EXPECT_FALSE(frozen({nan, nan, nan, nan, nan, nan, nan, nan, nan}));
  EXPECT_FALSE(frozen({}));
}

TEST(MotorSeries, TellsMeanDeviationAndLeastOfAWindow) {
  const auto readings = speeds({1, 2, 3, 4, 5, 6, 7});
  const Statistics s = MotorSeries(readings).statistics(MotorChannel::speed, {20'000'000, 100'000'000}, -1);
  EXPECT_EQ(s.n, 4u);
  EXPECT_EQ(s.mean, -3.5);
  EXPECT_EQ(s.least, -5);
  EXPECT_NEAR(s.deviation, std::sqrt(5.0 / 3), 1e-12);
  EXPECT_EQ(MotorSeries(readings).statistics(MotorChannel::derate, kAll).n, 0u);
}

}  // namespace kphi::results::motor_series_test
