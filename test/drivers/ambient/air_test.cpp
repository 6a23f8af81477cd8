#include "drivers/ambient/air.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace kphi::ambient {
namespace air_test {

TEST(AirDensity, AgreesWithTheSimplerFormulaOfDryAirAndVapour) {
  // ρ = (p − e)/(287.05 T) + e/(461.5 T), e after Magnus: good to some 5e-4.
  for (const double t : {5.0, 15.0, 20.0, 25.0, 35.0}) {
    for (const double p : {95000.0, 101325.0}) {
      for (const double h : {0.0, 0.5, 1.0}) {
        const double e = h * 611.2 * std::exp(17.62 * t / (243.12 + t)), kelvin = t + 273.15;
        const double simple = (p - e) / (287.05 * kelvin) + e / (461.5 * kelvin);
        EXPECT_NEAR(density_of({t, p, h}).kg_m3 / simple, 1, 1e-3) << t << " °C, " << p << " Pa, " << h;
      }
    }
  }
}

TEST(AirDensity, KnowsTheRoomAndTheStandardAtmosphere) {
  EXPECT_NEAR(density_of({20, 101325, 0.5}).kg_m3, 1.1989, 5e-4);
  EXPECT_NEAR(density_of({15, 101325, 0}).kg_m3, 1.225, 6e-4);
}

TEST(AirDensity, FallsWithTemperatureAndHumidityAndRisesWithPressure) {
  const double here = density_of({20, 101325, 0.5}).kg_m3;
  EXPECT_NEAR(density_of({30, 101325, 0.5}).kg_m3 / here, 1 - 0.036, 2e-3);
  EXPECT_NEAR(density_of({10, 101325, 0.5}).kg_m3 / here, 1 + 0.038, 2e-3);
  EXPECT_NEAR(density_of({20, 98325, 0.5}).kg_m3 / here, 1 - 0.030, 1e-3);
  EXPECT_NEAR(density_of({20, 101325, 0}).kg_m3 / here, 1 + 0.0044, 3e-4);
}

TEST(AirDensity, CarriesTheUncertaintyOfItsInputs) {
  EXPECT_NEAR(density_of({20, 101325, 0.5}).u_kg_m3, 22e-6 * 1.199, 1e-7) << "of the formula alone";
  EXPECT_GT(density_of({40, 101325, 0.5}).u_kg_m3, 1e-4) << "beyond the formula's range";
  // Against a Monte Carlo propagation (JCGM 101).
  const Air air{22, 99000, 0.4, 0.6, 58, 0.017};
  std::mt19937_64 random(7);
  std::normal_distribution<double> one;
  double sum = 0, squares = 0;
  constexpr int kDraws = 20000;
  for (int i = 0; i < kDraws; ++i) {
    const double rho = density_of({22 + 0.6 * one(random), 99000 + 58 * one(random), 0.4 + 0.017 * one(random)}).kg_m3;
    sum += rho;
    squares += rho * rho;
  }
  const double mean = sum / kDraws, sd = std::sqrt(squares / kDraws - mean * mean);
  EXPECT_NEAR(density_of(air).u_kg_m3 / sd, 1, 0.03);
}

TEST(AirDensity, RefusesWhatNoAirIs) {
  for (const Air& air : {Air{20, 0, 0.5}, Air{20, 101325, 1.1}, Air{20, 101325, -0.1}, Air{-60, 101325, 0.5},
                         Air{80, 101325, 0.5}, Air{std::nan(""), 101325, 0.5}, Air{20, std::nan(""), 0.5}}) {
    EXPECT_FALSE(plausible(air));
    EXPECT_THROW((void)density_of(air), std::invalid_argument);
  }
}

}  // namespace air_test
}  // namespace kphi::ambient
