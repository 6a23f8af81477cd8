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
  EXPECT_NEAR(dense.curve_fit.K_T / thin.curve_fit.K_T, 1.25 / 1.10, 1e-9);
  ASSERT_EQ(thin.table.size(), dense.table.size());
  const auto in_thin = analysed(thin).analysis.standard, in_dense = analysed(dense).analysis.standard;
  for (std::size_t i = 0; i < thin.table.size(); ++i) {
    EXPECT_NEAR(in_thin[i].value / in_dense[i].value, 1, 1e-6);
    EXPECT_NEAR(in_thin[i].value / identify(campaign_steps()).table[i].k, 1, 1e-6);
  }
}

TEST(Air, ScalesTheCoefficientOfTheTableWithItsWholeUncertaintyByEachEstimator) {
  const auto steps = in_air(1.10);
  for (const Estimator estimator :
       {Estimator::through_origin, Estimator::with_offset, Estimator::polynomial, Estimator::at_speed}) {
    const Identification found = identify(steps, {.estimator = estimator});
    AnalysisOptions options;
    options.bench.air_density = found.air->u / found.air->value;
    const Analysis analysis = analyse(found, options);
    for (std::size_t i = 0; i < found.table.size(); ++i) {
      const double scale = kStandardDensity / 1.10;
      const Budget &k = analysis.coefficients[i], &standard = analysis.standard[i];
      EXPECT_NEAR(standard.value / (k.value * scale), 1, 1e-12) << name_of(estimator) << ' ' << found.table[i].phi_deg;
      EXPECT_NEAR(standard.combined() / std::hypot(k.combined() * scale, 0.01 * k.value * scale), 1, 1e-9);
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
  const YAML::Node file = YAML::Load(format_coefficients(analysed(fit), {}));
  EXPECT_EQ(file["air_density_kg_m3"].as<std::string>(), "unknown");
  EXPECT_EQ(file["k_standard"].as<std::string>(), "unknown");
  EXPECT_FALSE(file["table"][0]["k_standard"].IsDefined());
  EXPECT_NE(format_report(analysed(fit), {}).find("Air density unknown"), std::string::npos);
}

TEST(Air, StandsInFileAndReport) {
  const Fitted fit = analysed(identify(in_air(1.10)));
  const YAML::Node file = YAML::Load(format_coefficients(fit, {}));
  EXPECT_NEAR(file["air_density_kg_m3"].as<double>(), 1.10, 1e-12);
  EXPECT_NEAR(file["air_density_u_kg_m3"].as<double>(), 0.011, 1e-12);
  EXPECT_EQ(file["k_standard"]["value"].as<double>(), fit.analysis.standard[0].value);
  EXPECT_EQ(file["table"][4]["k_standard"].as<double>(), fit.analysis.standard[4].value);
  const std::string report = format_report(fit, {});
  EXPECT_NE(report.find("1.1000 kg/m³, standard uncertainty 0.0110"), std::string::npos);
  EXPECT_EQ(report.find("Air density unknown"), std::string::npos);
}

}  // namespace air_test
}  // namespace kphi::fit
