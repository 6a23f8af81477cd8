#include "fit/propellers/claims.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <map>

#include "test/fit/bench_study.hpp"

namespace kphi::fit {
namespace claims_test {

/// In N/RPM², as the paper prints them: K_T, intercept and slope per degree of the occluded line.
struct PaperPropeller {
  double diameter_in;
  int blades;
  double K_T, intercept, slope;
};

// Equal slopes per diameter, offsets of 0.4e-8 and 0.5e-8, an inch more about doubles k.
constexpr double kSlope5 = -1.7e-8 * 0.65 / 225;
constexpr PaperPropeller kPaper[] = {{5, 2, 1.3e-8, 1.351e-8, kSlope5},
                                     {5, 3, 1.7e-8, 1.751e-8, kSlope5},
                                     {6, 2, 2.6e-8, 2.683e-8, -9.35e-11},
                                     {6, 3, 3.1e-8, 3.183e-8, -9.35e-11}};

Fitted member(const PaperPropeller& propeller, unsigned seed, double slope_factor = 1, bool air_known = false) {
  StudyTruth truth;
  truth.line.K_T = from_newtons_per_rpm2(propeller.K_T).value();
  truth.line.intercept = from_newtons_per_rpm2(propeller.intercept).value();
  truth.line.slope_per_deg = slope_factor * from_newtons_per_rpm2(propeller.slope).value();
  StudyCampaign campaign = study_campaign(truth, seed);
  for (auto& step : campaign.steps) {
    step.propeller = fmt::format("{}x{}", propeller.diameter_in, propeller.blades);
    step.diameter_in = propeller.diameter_in;
    step.blades = propeller.blades;
    if (air_known) continue;
    step.thrust_n *= kStandardDensity / campaign.density;  // all four in the same air
    step.air_density_kg_m3 = results::kNotMeasured;
  }
  Fitted result;
  result.identification = identify(campaign.steps);
  result.analysis = analyse(result.identification, study_options(truth));
  return result;
}

std::vector<Fitted> family(unsigned seed = 20) {
  std::vector<Fitted> members;
  for (const PaperPropeller& propeller : kPaper) members.push_back(member(propeller, ++seed));
  return members;
}

std::map<std::string, Claim> by_id(const std::vector<Claim>& claims) {
  std::map<std::string, Claim> result;
  for (const Claim& claim : claims) result[claim.id] = claim;
  return result;
}

TEST(Claims, OfThePaperHoldForFourSimulatedPropellers) {
  const auto claims = by_id(test_claims(family()));
  for (const char* id : {"slopes_5in", "slopes_6in", "offset_5in", "offset_6in", "order_5in", "order_6in", "share_45",
                         "share_270", "inch_2b", "inch_3b", "d4_2b", "d4_3b"}) {
    ASSERT_TRUE(claims.contains(id)) << id;
    const Claim& claim = claims.at(id);
    EXPECT_EQ(claim.verdict, Verdict::holds)
        << id << ": " << claim.value << " in " << claim.lower << ".." << claim.upper;
    EXPECT_LT(claim.lower, claim.value);
    EXPECT_GT(claim.upper, claim.value);
  }
  EXPECT_NEAR(claims.at("offset_5in").value, 0.4e-8, 0.03e-8) << "in N/RPM^2, as the paper says it";
}

TEST(Claims, OfSeveralPropellersAreMadeInStandardAir) {
  std::vector<Fitted> members;
  for (const PaperPropeller& propeller : kPaper) members.push_back(member(propeller, 30 + members.size(), 1, true));
  const auto claims = by_id(test_claims(members));  // days from 1.10 to 1.25 kg/m³
  EXPECT_NEAR(claims.at("inch_2b").value, 2.042, 0.02) << "mean over the occlusions";
  EXPECT_NEAR(claims.at("slopes_5in").value, 1.0, 0.02);
  EXPECT_NEAR(claims.at("offset_6in").value, 0.5e-8, 0.05e-8);
}

TEST(Claims, ThatAreFalseFail) {
  auto members = family();
  members[1] = member(kPaper[1], 22, 0.7);  // another slope for 5x3
  const auto claims = by_id(test_claims(members));
  EXPECT_EQ(claims.at("slopes_5in").verdict, Verdict::fails);
  EXPECT_EQ(claims.at("share_270").verdict, Verdict::fails);
  EXPECT_EQ(claims.at("slopes_6in").verdict, Verdict::holds);
}

TEST(Claims, ThatCannotBeTestedSaySo) {
  const std::vector<Fitted> one{member(kPaper[1], 22)};
  const auto claims = by_id(test_claims(one));
  EXPECT_EQ(claims.at("slopes_5in").verdict, Verdict::not_tested);
  EXPECT_EQ(claims.at("inch_2b").verdict, Verdict::not_tested);
  EXPECT_EQ(claims.at("share_45").verdict, Verdict::holds);
}

TEST(Family, SharesASlopePerDiameterAndTestsIt) {
  const auto members = family();
  const auto shared = shared_slopes(members);
  ASSERT_EQ(shared.size(), 2u);
  const double truth = from_newtons_per_rpm2(kSlope5).value();
  EXPECT_EQ(shared[0].diameter_in, 5);
  EXPECT_NEAR(shared[0].slope.value / truth, 1, 0.02);
  EXPECT_LT(shared[0].slope.u, members[0].analysis.parameters[1].combined()) << "two propellers tell more than one";
  EXPECT_FALSE(shared[0].equal_slopes.rejected());
  EXPECT_EQ(shared[0].propellers.size(), 2u);

  auto other = members;
  other[1] = member(kPaper[1], 22, 0.7);
  EXPECT_TRUE(shared_slopes(other)[0].equal_slopes.rejected());
}

TEST(Family, PredictsThePropellerThatWasLeftOut) {
  const auto members = family();
  for (std::size_t left_out = 0; left_out < members.size(); ++left_out) {
    auto others = members;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(left_out));
    const PaperPropeller& truth = kPaper[left_out];
    for (const double phi : {0.0, 90.0, 270.0}) {
      const auto prediction = predict(others, truth.diameter_in, truth.blades, phi);
      ASSERT_TRUE(prediction);
      const double k = from_newtons_per_rpm2(phi == 0 ? truth.K_T : truth.intercept + truth.slope * phi).value();
      EXPECT_LE(prediction->lower, k) << left_out << " at " << phi;
      EXPECT_GE(prediction->upper, k) << left_out << " at " << phi;
      EXPECT_GT(prediction->k.value, 0.3 * k);
    }
  }
  EXPECT_FALSE(predict(std::span(members).first(2), 6, 3, 90));
}

}  // namespace claims_test
}  // namespace kphi::fit
