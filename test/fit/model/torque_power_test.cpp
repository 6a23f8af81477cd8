#include "fit/model/torque_power.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <random>

#include "fit/model/identification.hpp"
#include "fit/report/report.hpp"
#include "test/fit/campaign_steps.hpp"

namespace kphi::fit {
namespace torque_power_test {

results::StepMean step(double phi, int number, double thrust_n) {
  results::StepMean one = step_at(phi, 1, number);
  one.thrust_n = thrust_n;
  return one;
}

TEST(DragTorque, HasAnUncertaintyOfItsOwnThatItsScatterBearsOut) {
  constexpr double kTruth = 0.013, kNoise_nm = 2e-4;
  std::vector<double> found, told;
  for (unsigned seed = 1; seed <= 200; ++seed) {
    auto steps = campaign_steps({}, seed);
    std::mt19937 random(1000 + seed);
    std::normal_distribution<double> noise(0, kNoise_nm);
    for (auto& one : steps) {
      one.torque_nm =
          -kTruth * CampaignTruth().k(one.occlusion_deg) * one.speed_rad_s * one.speed_rad_s + noise(random);
      one.torque_sd_nm = 10 * kNoise_nm;
      one.thrust_n_eff = 100;
      one.thrust_u_n = one.zero_u_n = one.zero_moved_n = 0.01;  // N, of the thrust
    }
    const Identification campaign = identify(steps);
    const auto torque = torque_coefficients(campaign, BenchUncertainty::none());
    ASSERT_EQ(torque.size(), 5u);
    found.push_back(torque[0].k_q.value);
    told.push_back(torque[0].k_q.combined());
  }
  const auto mean = [](const std::vector<double>& all) { return std::accumulate(all.begin(), all.end(), 0.0) / 200; };
  double squares = 0;
  for (const double one : found) squares += (one - mean(found)) * (one - mean(found)) / 199;
  EXPECT_NEAR(mean(found), kTruth * CampaignTruth().K_T, 1e-3 * kTruth * CampaignTruth().K_T);
  EXPECT_NEAR(mean(told) / std::sqrt(squares), 1, 0.3);
}

TEST(Power, IsThatOfTheSupplyWhereItWasMeasuredElseThatOfTheModule) {
  results::StepMean one = step(0, 3, 9.80665);
  one.supply_voltage_v = 11.5;
  one.supply_current_a = 10;
  for (const double supply_w : {200.0, results::kNotMeasured}) {
    one.supply_w = supply_w;
    const auto rows = power_of({&one, 1});
    ASSERT_EQ(rows.size(), 1u);
    EXPECT_EQ(rows[0].by_supply, supply_w == 200);
    const double watt = supply_w == 200 ? 200 : 115;
    EXPECT_DOUBLE_EQ(rows[0].power_w, watt);
    EXPECT_DOUBLE_EQ(rows[0].gram_per_watt(), 1000 / watt);
    EXPECT_DOUBLE_EQ(rows[0].newton_per_watt(), 9.80665 / watt);
  }
}

TEST(Power, IsTheMeanOfTheRepetitionsOfAStep) {
  std::vector<results::StepMean> steps{step(90, 1, 1), step(90, 1, 3), step(45, 1, 1), step(90, 0, 1)};
  for (auto& one : steps) one.supply_w = 10 * one.thrust_n;
  const auto rows = power_of(steps);
  ASSERT_EQ(rows.size(), 3u);
  EXPECT_EQ(rows[0].phi_deg, 45);
  EXPECT_EQ(rows[1].step, 0);
  EXPECT_DOUBLE_EQ(rows[2].thrust_n, 2);
  EXPECT_DOUBLE_EQ(rows[2].power_w, 20);
}

TEST(Power, StandsInTheReportOnlyWhereSomebodyMeasuredIt) {
  auto steps = campaign_steps();
  EXPECT_EQ(format_report(analysed(identify(steps)), {}).find("g/W"), std::string::npos);
  for (auto& one : steps) one.supply_w = 100 * one.thrust_n / 9.80665e-3 / 500;
  const std::string report = format_report(analysed(identify(steps)), {});
  EXPECT_NE(report.find("<th>g/W</th><th>N/W</th>"), std::string::npos);
  EXPECT_NE(report.find("<td>5.000</td><td>0.04903</td><td class=\"text\">supply</td>"), std::string::npos);
}

}  // namespace torque_power_test
}  // namespace kphi::fit
