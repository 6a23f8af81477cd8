#include "compensation/flight/arms.hpp"

#include <gtest/gtest.h>

namespace kphi::flight {
namespace arms_test {

constexpr double kStep = 0.002;
const Angles kFrom{Radians(0.5), Radians(0.5), Radians(0.5), Radians(0.5)},
    kTo{Radians(3), Radians(3), Radians(2.8), Radians(3)};

/// Steps until nothing moves; calls `look(time)` after each.
template <class Look>
double moved(Arms& arms, const Look& look) {
  arms.begin(kTo);
  double time = 0;
  while (arms.moving()) {
    time += kStep;
    arms.advance(time);
    look(time);
    EXPECT_LT(time, 10);
    if (time > 10) break;
  }
  return time;
}

TEST(Arms, WithoutLagAndBacklashFollowTheirCommand) {
  Arms arms(kFrom, 1.5, {}, kStep);
  ArmMotion command(kFrom, 1.5);
  command.begin(kTo, 0);
  EXPECT_NEAR(moved(arms, [&](double time) { EXPECT_EQ(arms.hubs(), command.angles(time)); }), 1.5, 0.01);
  EXPECT_EQ(arms.hubs(), kTo);
}

TEST(Arms, WithALagAreBehindByIt) {
  Arms arms(kFrom, 1.5, {0.05, 0, 0}, kStep);
  ArmMotion command(kFrom, 1.5);
  command.begin(kTo, 0);
  const double ended = moved(arms, [&](double time) {
    if (time < 0.5 || time > 1.2) return;
    EXPECT_NEAR(arms.hubs()[0].value(), command.angles(time - 0.05)[0].value(), 0.02);
    EXPECT_NEAR(arms.rates()[0], command.rates(time - 0.05)[0], 0.2);
  });
  EXPECT_GT(ended, 1.6);
  EXPECT_NEAR(arms.hubs()[2].value(), 2.8, 1e-8);
}

TEST(Arms, InBacklashStopShortByHalfOfIt) {
  Arms arms(kFrom, 1.5, {0, 0.02, 0}, kStep);
  moved(arms, [](double) {});
  EXPECT_NEAR(arms.hubs()[0].value(), 3 - 0.01, 1e-12);
  EXPECT_EQ(arms.tell()[0], kTo[0]) << "the servo does not know";
}

TEST(Arms, TellTheirAngleAsLateAsTheirFeedbackIs) {
  Arms arms(kFrom, 1.5, {0, 0, 0.1}, kStep);
  ArmMotion command(kFrom, 1.5);
  command.begin(kTo, 0);
  (void)arms.tell();
  moved(arms, [&](double time) {
    const Angles told = arms.tell();
    const Angles then = time < 0.1 ? kFrom : command.angles(time - 0.1);
    EXPECT_NEAR(told[1].value(), then[1].value(), 1e-9) << time;
  });
}

}  // namespace arms_test
}  // namespace kphi::flight
