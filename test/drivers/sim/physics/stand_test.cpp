#include "drivers/sim/physics/stand.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/statistics.hpp"
#include "drivers/sim/physics/plant.hpp"

namespace kphi::sim::stand_test {

const PropellerTruth& propeller() { return *find_propeller("5x3"); }

/// Thrust that the cell would show at a held speed, once its lag is over, N.
double thrust_at(double speed, const PlantParameters& parameters, std::uint64_t seed = 1) {
  Plant plant(parameters, seed);
  plant.mount(&propeller(), 90);
  for (int i = 0; i < kTicksPerSecond; ++i) {
    const double error = speed - plant.motor().speed;
    plant.step({PowerStage::Mode::drive, std::clamp(0.0043 * speed / 12 + 0.02 * error, -1.0, 1.0)});
  }
  const double turning = plant.motor().speed;
  return plant.thrust() * std::pow(speed / turning, 2);
}

TEST(Stand, WithoutAnythingIsTheNominalPropeller) {
  const StandParameters stand;
  for (const double phi : {0.0, 45.0, 270.0})
    EXPECT_EQ(stand.k(propeller(), phi), thrust_coefficient(propeller(), phi));
  EXPECT_EQ(stand.true_deg(90), 90);
}

TEST(Stand, HasTheLawItIsGiven) {
  StandParameters stand;
  stand.law = {1.55e-6, 1.6e-6, -4.5e-9};
  EXPECT_EQ(stand.k(propeller(), 0), 1.55e-6);
  EXPECT_DOUBLE_EQ(stand.k(propeller(), 100), 1.15e-6);
  EXPECT_EQ(stand.k(propeller(), 359), 0) << "an occlusion does not push";
}

TEST(Stand, BendsBetweenItsEnds) {
  StandParameters bent, straight;
  bent.law = straight.law = {1.55e-6, 1.6e-6, -4.5e-9};
  bent.bend = 0.01;
  EXPECT_NEAR(bent.k(propeller(), 135) - straight.k(propeller(), 135), 0.01 * 1.55e-6, 1e-20);
  EXPECT_DOUBLE_EQ(bent.k(propeller(), 270), straight.k(propeller(), 270));
  EXPECT_EQ(bent.k(propeller(), 0), straight.k(propeller(), 0));
}

TEST(Stand, ExchangesPlates) {
  PlantParameters exchanged;
  exchanged.stand.plates = {{90, 180}, {180, 90}};
  PlantParameters law;
  law.stand.law = {1.55e-6, thrust_coefficient(propeller(), 180), 0};
  EXPECT_NEAR(thrust_at(1000, exchanged), thrust_at(1000, law), 1e-3);
}

TEST(Stand, PullsMoreAtSpeed) {
  PlantParameters rising;
  rising.stand.rise_per_krad_s = 0.1;
  EXPECT_NEAR(thrust_at(1500, rising) / thrust_at(1500, {}), 1.05, 1e-3);
  EXPECT_NEAR(thrust_at(1000, rising) / thrust_at(1000, {}), 1, 1e-3);
}

TEST(Stand, IsMountedALittleDifferentlyEachTime) {
  PlantParameters scattering;
  scattering.stand.mounting = 0.01;
  std::vector<double> shares;
  for (std::uint64_t seed = 1; seed <= 40; ++seed)
    shares.push_back(thrust_at(1000, scattering, seed) / thrust_at(1000, {}, seed));
  EXPECT_NEAR(mean(shares), 1, 0.006);
  EXPECT_NEAR(std::sqrt(variance(shares)), 0.01, 0.004);
}

/// Readings of Fz at rest, one per 10 ms, without the white noise.
std::vector<double> at_rest(PlantParameters parameters, double seconds) {
  parameters.load_cell.noise = {};
  Plant plant(parameters, 3);
  std::vector<double> readings;
  for (int i = 0; i < 100 * seconds; ++i) {
    for (int tick = 0; tick < kTicksPerSecond / 100; ++tick) plant.step({});
    readings.push_back(plant.reading()[2]);
  }
  return readings;
}

TEST(Stand, HasNoiseThatRemembers) {
  PlantParameters parameters;
  parameters.load_cell.drift_per_minute = parameters.load_cell.walk_per_root_minute = {};
  parameters.load_cell.slow_noise = 0.01;
  parameters.load_cell.slow_noise_seconds = 0.5;
  const std::vector<double> readings = at_rest(parameters, 400);
  const double middle = mean(readings);
  double own = 0, later = 0;
  for (std::size_t i = 0; i + 50 < readings.size(); ++i) {
    own += std::pow(readings[i] - middle, 2);
    later += (readings[i] - middle) * (readings[i + 50] - middle);
  }
  EXPECT_NEAR(std::sqrt(variance(readings)), 0.01, 0.001);
  EXPECT_NEAR(later / own, std::exp(-1), 0.1);
}

TEST(Stand, TellsItsTruth) {
  StandParameters stand;
  stand.law = {1.55e-6, 1.6e-6, -4.5e-9};
  const std::string truth = truth_yaml(1, stand);
  EXPECT_NE(truth.find("K_T: 1.55e-06"), std::string::npos) << truth;
  EXPECT_NE(truth.find("line: {intercept: 1.6e-06, slope_per_deg: -4.5e-09}"), std::string::npos) << truth;
}

}  // namespace kphi::sim::stand_test
