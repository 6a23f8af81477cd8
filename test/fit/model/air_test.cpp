#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <cmath>

#include "fit/coefficients/coefficients.hpp"
#include "fit/model/identification.hpp"
#include "fit/report/report.hpp"
#include "test/fit/campaign_steps.hpp"

namespace kphi::fit {
namespace air_test {

/// The same propeller, noise and all, in another air: thrust is proportional to its density.
std::vector<results::StepMean> in_air(double kg_m3) {
  std::vector<results::StepMean> steps = campaign_steps();
  for (results::StepMean& step : steps) {
    step.thrust_n *= kg_m3 / kStandardDensity;
    step.air_density_kg_m3 = kg_m3;
    step.air_density_u_kg_m3 = 0.01 * kg_m3;
  }
  return steps;
}

TEST(Air, TheSamePropellerInAnotherAirHasTheSameStandardCoefficients) {
  const Identification thin = identify(in_air(1.10)), dense = identify(in_air(1.25));
  EXPECT_NEAR(dense.line.K_T / thin.line.K_T, 1.25 / 1.10, 1e-9);
  ASSERT_EQ(thin.table.size(), dense.table.size());
  for (std::size_t i = 0; i < thin.table.size(); ++i) {
    EXPECT_NEAR(thin.table[i].standard->value / dense.table[i].standard->value, 1, 1e-6);
    EXPECT_NEAR(thin.table[i].standard->value / identify(campaign_steps()).table[i].k, 1, 1e-6);
  }
}

TEST(Air, ItsUncertaintyJoinsThatOfTheFit) {
  const auto standard = at_standard(2e-6, 2e-8, {1.225, 0.03 * 1.225});
  EXPECT_DOUBLE_EQ(standard.value, 2e-6);
  EXPECT_NEAR(standard.u / standard.value, std::hypot(0.01, 0.03), 1e-12);
}

TEST(Air, ScalesTheCoefficientOfTheTableWithItsWholeUncertaintyByEachEstimator) {
  const auto steps = in_air(1.10);
  for (const Estimator estimator :
       {Estimator::through_origin, Estimator::with_offset, Estimator::polynomial, Estimator::at_speed}) {
    for (const OcclusionCoefficient& row : identify(steps, {.estimator = estimator}).table) {
      const double scale = kStandardDensity / 1.10;
      EXPECT_NEAR(row.standard->value / (row.k * scale), 1, 1e-12) << name_of(estimator) << ' ' << row.phi_deg;
      EXPECT_NEAR(row.standard->u / std::hypot(row.standard_error * scale, 0.01 * row.k * scale), 1, 1e-9);
    }
  }
}

TEST(Air, OneStepWithoutItIsEnoughToKnowNothing) {
  auto steps = in_air(1.2);
  steps[300].air_density_kg_m3 = results::kNotMeasured;
  EXPECT_FALSE(air_of(steps));
  EXPECT_FALSE(identify(steps).air);
}

TEST(Air, UnknownIsWrittenAndNeverStandard) {
  const Identification fit = identify(campaign_steps());
  const YAML::Node file = YAML::Load(format_coefficients(fit, {}));
  EXPECT_EQ(file["air_density_kg_m3"].as<std::string>(), "unknown");
  EXPECT_EQ(file["k_standard"].as<std::string>(), "unknown");
  EXPECT_FALSE(file["table"][0]["k_standard"].IsDefined());
  EXPECT_NE(format_report({fit, {}}, {}).find("Air density unknown"), std::string::npos);
}

TEST(Air, StandsInFileAndReport) {
  const Identification fit = identify(in_air(1.10));
  const YAML::Node file = YAML::Load(format_coefficients(fit, {}));
  EXPECT_NEAR(file["air_density_kg_m3"].as<double>(), 1.10, 1e-12);
  EXPECT_NEAR(file["air_density_u_kg_m3"].as<double>(), 0.011, 1e-12);
  EXPECT_EQ(file["k_standard"]["value"].as<double>(), fit.table[0].standard->value);
  EXPECT_EQ(file["table"][4]["k_standard"].as<double>(), fit.table[4].standard->value);
  const std::string report = format_report({fit, {}}, {});
  EXPECT_NE(report.find("1.1000 ± 0.0110 kg/m³"), std::string::npos);
  EXPECT_EQ(report.find("Air density unknown"), std::string::npos);
}

}  // namespace air_test
}  // namespace kphi::fit
