#include <gtest/gtest.h>

#include "compensation/flight/flight.hpp"

namespace kphi::flight {
namespace noise_test {

TEST(Random, IsSplitMix64WhoseStreamsDiffer) {
  Random random(1234567);
  EXPECT_EQ(random.bits(), 6457827717110365317u);
  EXPECT_EQ(random.bits(), 3203168211198807973u);
  EXPECT_NE(Random(1, 0).bits(), Random(1, 1).bits());
  EXPECT_NE(Random(1, 0).bits(), Random(2, 0).bits());
  EXPECT_EQ(Random(7, 3).bits(), Random(7, 3).bits());
}

TEST(Random, HasTheMomentsOfItsDistributions) {
  Random random(5);
  const int count = 200000;
  double sum = 0, squares = 0, fourth = 0, flat = 0;
  for (int i = 0; i < count; ++i) {
    const double z = random.normal(0, 1), u = random.uniform(2, 4);
    ASSERT_TRUE(u >= 2 && u < 4);
    sum += z;
    squares += z * z;
    fourth += z * z * z * z;
    flat += u;
  }
  EXPECT_NEAR(sum / count, 0, 0.01);
  EXPECT_NEAR(squares / count, 1, 0.015);
  EXPECT_NEAR(fourth / count, 3, 0.1);
  EXPECT_NEAR(flat / count, 3, 0.01);
}

TEST(Estimator, WandersWithTheStatedDeviationAndMemory) {
  const EstimatorNoise noise;
  const double period = 0.01;
  Estimator estimator(noise, period, Random(9));
  const BodyMotion truth{{1, 2, 3}, {4, 5, 6}};
  const int count = 400000, lag = 20;  // 0.2 s
  std::vector<double> position, velocity;
  for (int i = 0; i < count; ++i) {
    const BodyMotion told = estimator.estimate(truth);
    position.push_back(told.position.x() - 1);
    velocity.push_back(told.velocity.z() - 6);
  }
  const auto correlation = [&](const std::vector<double>& noise_of, int apart) {
    double sum = 0;
    for (int i = apart; i < count; ++i) sum += noise_of[i] * noise_of[i - apart];
    return sum / (count - apart);
  };
  EXPECT_NEAR(std::sqrt(correlation(position, 0)), 0.008, 0.0004);
  EXPECT_NEAR(std::sqrt(correlation(velocity, 0)), 0.03, 0.001);
  EXPECT_NEAR(correlation(position, lag) / correlation(position, 0), std::exp(-0.2), 0.02);
  EXPECT_NEAR(correlation(velocity, lag) / correlation(velocity, 0), std::exp(-1), 0.03);
}

TEST(Estimator, TellsTheTruthWithoutNoise) {
  EstimatorNoise none;
  none.position = none.velocity = 0;
  Estimator estimator(none, 0.01, Random(1));
  const BodyMotion told = estimator.estimate({{1, 2, 3}, {4, 5, 6}});
  EXPECT_EQ(told.position, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(told.velocity, Eigen::Vector3d(4, 5, 6));
}

}  // namespace noise_test
}  // namespace kphi::flight
