#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include "compensation/units.hpp"
#include "drivers/sim/physics/stand.hpp"

namespace kphi::sim::truth_test {

double k_rpm(std::string_view id, double phi) {
  return to_newtons_per_rpm2(ThrustCoefficient(thrust_coefficient(*find_propeller(id), phi)));
}

TEST(Truth, UnoccludedCoefficientIsExactlyKT) {
  for (const auto& propeller : kPropellers) {
    EXPECT_EQ(thrust_coefficient(propeller, 0), from_newtons_per_rpm2(propeller.thrust_n_rpm2).value());
  }
}

TEST(Truth, FiveInchThreeBladesLosesWhatThePaperSays) {
  const double full = k_rpm("5x3", 0);
  EXPECT_NEAR(full, 1.7e-8, 1e-20);
  EXPECT_NEAR(k_rpm("5x3", 45) / full, 0.90, 1e-9);
  EXPECT_NEAR(k_rpm("5x3", 270) / full, 0.25, 1e-9);
  EXPECT_NEAR(k_rpm("5x3", 90) / full, 1.03 - 0.0028889 * 90, 1e-5);
}

TEST(Truth, SlopesAreEqualPerDiameterAndBladeCountsOffset) {
  for (const double phi : {45.0, 90.0, 180.0, 270.0}) {
    EXPECT_NEAR(k_rpm("5x3", phi) - k_rpm("5x2", phi), 0.4e-8, 1e-14);
    EXPECT_NEAR(k_rpm("6x3", phi) - k_rpm("6x2", phi), 0.5e-8, 1e-14);
  }
}

TEST(Truth, AnInchMoreAboutDoublesTheCoefficient) {
  for (const double phi : {45.0, 90.0, 180.0}) {
    for (const int blades : {2, 3}) {
      const double ratio = blades == 2 ? k_rpm("6x2", phi) / k_rpm("5x2", phi) : k_rpm("6x3", phi) / k_rpm("5x3", phi);
      EXPECT_GT(ratio, 1.7) << phi << " deg, " << blades << " blades";
      EXPECT_LT(ratio, 2.2) << phi << " deg, " << blades << " blades";
    }
  }
}

TEST(Truth, ThreeBladesLoseTheSmallerShare) {
  for (const double phi : {90.0, 180.0, 270.0}) {
    EXPECT_GT(k_rpm("5x3", phi) / k_rpm("5x3", 0), k_rpm("5x2", phi) / k_rpm("5x2", 0));
    EXPECT_GT(k_rpm("6x3", phi) / k_rpm("6x3", 0), k_rpm("6x2", phi) / k_rpm("6x2", 0));
  }
}

TEST(Truth, CoefficientsFallWithTheOcclusionAndNeverBelowZero) {
  for (const auto& propeller : kPropellers) {
    double last = thrust_coefficient(propeller, 0);
    for (const double phi : {45.0, 90.0, 180.0, 270.0}) {
      EXPECT_LT(thrust_coefficient(propeller, phi), last) << propeller.id << " at " << phi;
      EXPECT_GT(thrust_coefficient(propeller, phi), 0) << propeller.id << " at " << phi;
      last = thrust_coefficient(propeller, phi);
    }
    EXPECT_GE(thrust_coefficient(propeller, 359), 0);
    EXPECT_LT(torque_coefficient(propeller, 270), torque_coefficient(propeller, 0));
    EXPECT_GT(torque_coefficient(propeller, 270), 0.9 * torque_coefficient(propeller, 0));
  }
}

TEST(Truth, UnknownPropellersAreNotFound) {
  EXPECT_EQ(find_propeller("7x2"), nullptr);
  EXPECT_EQ(find_propeller(""), nullptr);
}

TEST(Truth, YamlGivesBackEveryDigit) {
  const YAML::Node file = YAML::Load(truth_yaml(17));
  EXPECT_EQ(file["seed"].as<int>(), 17);
  EXPECT_EQ(file["k_unit"].as<std::string>(), "N/(rad/s)^2");
  ASSERT_EQ(file["propellers"].size(), kPropellers.size());
  for (const auto& propeller : kPropellers) {
    const YAML::Node entry = file["propellers"][std::string(propeller.id)];
    EXPECT_EQ(entry["K_T"].as<double>(), thrust_coefficient(propeller, 0));
    ASSERT_EQ(entry["k"].size(), kOcclusionsDeg.size());
    const double intercept = entry["line"]["intercept"].as<double>();
    const double slope = entry["line"]["slope_per_deg"].as<double>();
    for (const auto& point : entry["k"]) {
      const double phi = point["phi_deg"].as<double>();
      EXPECT_EQ(point["k"].as<double>(), thrust_coefficient(propeller, phi));
      if (phi > 0) {
        EXPECT_NEAR(point["k"].as<double>() / (intercept + slope * phi), 1, 1e-9);
      }
    }
  }
}

}  // namespace kphi::sim::truth_test
