#include "compensation/flight/shadow.hpp"

#include <gtest/gtest.h>

#include "compensation/flight/random.hpp"
#include "compensation/rim_arc.hpp"
#include "test/compensation/flight/flight_fixture.hpp"

namespace kphi::flight {
namespace {

TEST(CoveredArc, AgreesWithTheFlyingLibraryThoughNoLineIsShared) {
  Random random(11);
  int overlapping = 0;
  for (int i = 0; i < 20000; ++i) {
    const double a = random.uniform(0.02, 0.1), r = random.uniform(0.02, 0.1);
    const double x = random.uniform(-0.25, 0.25), y = random.uniform(-0.25, 0.25);
    const double library = compensation::rim_arc(Metres(a), Metres(r), Metres(x), Metres(y)).value();
    ASSERT_NEAR(covered_arc(a, r, x, y), library, 1e-7) << a << " " << r << " " << x << " " << y;
    overlapping += library > 0;
  }
  EXPECT_GT(overlapping, 2000);
}

TEST(CoveredArc, IsZeroApartAndAFullTurnInside) {
  EXPECT_EQ(covered_arc(0.05, 0.06, 0.2, 0), 0);
  EXPECT_NEAR(covered_arc(0.05, 0.02, 0.01, 0), 2 * kPi, 1e-12);
  EXPECT_NEAR(covered_arc(0.05, 0.01, 0.05, 0.0), kPi, 1e-12) << "hub on an edge";
  EXPECT_NEAR(covered_arc(0.05, 0.01, 0.05, 0.05), kPi / 2, 1e-12) << "hub on a corner";
}

TEST(CoveredLoad, IsThatOfASectorWhereTheBodyIsOne) {
  EXPECT_NEAR(covered_load(1.0, 0.01, 1.0, 0.0), kPi, 2e-3) << "hub on a long edge";
  EXPECT_NEAR(covered_load(0.05, 0.02, 0.01, 0), 2 * kPi, 2e-3) << "wholly over the body";
  EXPECT_EQ(covered_load(0.05, 0.06, 0.2, 0), 0);
}

TEST(Shadow, OfTheDefaultVehicleInOIsThePapersSixtyFiveDegrees) {
  const Shadow& shadow = example_shadow();
  EXPECT_NEAR(to_degrees(Radians(shadow.arc(from_degrees(180)))), 64.837, 0.01);
  EXPECT_NEAR(to_degrees(Radians(shadow.arc(from_degrees(165.676)))), 41.293, 0.05);
  EXPECT_NEAR(to_degrees(Radians(shadow.load(from_degrees(180)))), 50.51, 0.2);
  EXPECT_EQ(shadow.arc(from_degrees(45)), 0);
  EXPECT_EQ(shadow.load(from_degrees(45)), 0);
}

TEST(Shadow, GoesRoundWithoutAStepAtHalfATurn) {
  const Shadow& shadow = example_shadow();
  EXPECT_NEAR(shadow.arc(from_degrees(181)), shadow.arc(from_degrees(-179)), 1e-9);
  EXPECT_NEAR(shadow.arc(from_degrees(179.99)), shadow.arc(from_degrees(180.01)), 2e-3);
}

}  // namespace
}  // namespace kphi::flight
