#include "drivers/iq/inquiry.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace kphi::iq {
namespace {

constexpr const Entry& kTimeout = entry<"propeller_motor_control.timeout">;

TEST(OpenInquiry, IsOverWithTheFirstAnswerToAQuestion) {
  OpenInquiry open({&kTimeout, {}});
  EXPECT_FALSE(open.done());
  open.take(std::nullopt);
  EXPECT_FALSE(open.done());
  open.take(0.7);
  EXPECT_TRUE(open.done());
  EXPECT_EQ(open.reply().value, 0.7);
  EXPECT_FALSE(open.reply().accepted) << "nothing was set";
}

TEST(OpenInquiry, IsPutThreeTimesToAModuleThatStaysSilent) {
  OpenInquiry open({&kTimeout, 0.5});
  for (int i = 0; i < OpenInquiry::kAttempts; ++i) {
    EXPECT_FALSE(open.done());
    open.take(std::nullopt);
  }
  EXPECT_TRUE(open.done());
  EXPECT_EQ(open.reply().value, std::nullopt);
}

TEST(OpenInquiry, SetsUntilItReadsBackBitByBit) {
  OpenInquiry open({&kTimeout, 0.5});
  open.take(std::nextafterf(0.5f, 1.0f));
  EXPECT_FALSE(open.done());
  open.take(0.5);
  EXPECT_TRUE(open.done());
  EXPECT_TRUE(open.reply().accepted);
}

TEST(OpenInquiry, RemembersWhatAModuleInsistsOn) {
  OpenInquiry open({&kTimeout, 0.5}, 2);
  open.take(10.0);
  open.take(std::nullopt);
  EXPECT_TRUE(open.done());
  EXPECT_EQ(open.reply().value, 10.0);
  EXPECT_FALSE(open.reply().accepted);
}

TEST(OpenInquiry, CanBeGivenUp) {
  OpenInquiry open({&kTimeout, 0.5});
  open.give_up();
  EXPECT_TRUE(open.done());
}

}  // namespace
}  // namespace kphi::iq
