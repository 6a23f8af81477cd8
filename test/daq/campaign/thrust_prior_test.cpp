#include "daq/campaign/thrust_prior.hpp"

#include <gtest/gtest.h>

namespace kphi::daq {
namespace {

TEST(ThrustPrior, OfFiveInchesIsWhatOthersMeasured) {
  const auto prior = thrust_prior({"5x3", "", 5, 3});
  ASSERT_TRUE(prior);
  EXPECT_EQ(prior->low.value(), 1.12e-6);
  EXPECT_EQ(prior->high.value(), 1.38e-6);
  EXPECT_NEAR(ThrustPrior::at(prior->high, from_rpm(19100)).value(), 5.52, 0.01);
}

TEST(ThrustPrior, OfSixInchesIsTwiceThatAndSaysSo) {
  const auto prior = thrust_prior({"6x2", "", 6, 2});
  ASSERT_TRUE(prior);
  EXPECT_NEAR(prior->low.value(), 2.07 * 1.02e-6, 0.01e-6);
  EXPECT_NE(prior->source.find("(D / 5 in)^4"), std::string::npos);
}

TEST(ThrustPrior, IsUnknownOfWhatNobodyMeasured) {
  EXPECT_FALSE(thrust_prior({"5x6", "", 5, 6}));
  EXPECT_FALSE(thrust_prior({"2x2", "", 2, 2}));
  EXPECT_FALSE(thrust_prior({"10x2", "", 10, 2}));
}

}  // namespace
}  // namespace kphi::daq
