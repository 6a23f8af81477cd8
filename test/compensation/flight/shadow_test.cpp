#include "compensation/flight/shadow.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>

#include "compensation/flight/flight.hpp"
#include "compensation/occlusion.hpp"
#include "test/compensation/flight/flight_fixture.hpp"

namespace kphi::flight {
namespace shadow_test {

using compensation::ConvexPolygon;

/// To the last digits, but for tangency: a rounding of 1e-16 is an angle of 1e-8 there.
TEST(CoveredArc, AgreesWithTheFlyingLibraryThoughNoLineIsShared) {
  Random random(12);
  int overlapping = 0, exact = 0;
  for (int i = 0; i < 200000; ++i) {
    const double a = random.uniform(0.02, 0.1), r = random.uniform(0.02, 0.1);
    const double x = random.uniform(-0.25, 0.25), y = random.uniform(-0.25, 0.25);
    bool touches = false;
    for (const double sx : {-a, a}) {
      touches = touches || std::fabs(std::fabs(sx - x) - r) < 1e-3 * r || std::fabs(std::fabs(sx - y) - r) < 1e-3 * r;
      for (const double sy : {-a, a}) touches = touches || std::fabs(std::hypot(sx - x, sy - y) - r) < 1e-3 * r;
    }
    const double library = compensation::rim_arc(Metres(a), Metres(r), Metres(x), Metres(y)).value();
    ASSERT_NEAR(covered_arc(ConvexPolygon::square(Metres(a)), r, x, y), library, touches ? 1e-7 : 1e-12)
        << a << " " << r << " " << x << " " << y;
    overlapping += library > 0;
    exact += !touches && library > 0 && library < 2 * kPi;
  }
  EXPECT_GT(overlapping, 20000);
  EXPECT_GT(exact, 20000);
}

/// Corners on a circle, in any number.
ConvexPolygon any_outline(Random& random) {
  for (;;) {
    const std::size_t count = 3 + random.bits() % 10;
    std::array<double, ConvexPolygon::kMaxCorners> at{};
    for (std::size_t i = 0; i < count; ++i) at[i] = random.uniform(0, 2 * kPi);
    std::sort(at.begin(), at.begin() + static_cast<long>(count));
    std::array<compensation::Position, ConvexPolygon::kMaxCorners> corners{};
    for (std::size_t i = 0; i < count; ++i)
      corners[i] = {Metres(0.08 * std::cos(at[i])), Metres(0.05 * std::sin(at[i]))};
    if (const auto outline = ConvexPolygon::from(corners.data(), count)) return *outline;
  }
}

TEST(CoveredArc, AgreesWithTheFlyingLibraryOverAnyConvexBody) {
  Random random(13);
  int overlapping = 0;
  for (int i = 0; i < 20000; ++i) {
    const ConvexPolygon outline = any_outline(random);
    const double r = random.uniform(0.01, 0.1), x = random.uniform(-0.2, 0.2), y = random.uniform(-0.2, 0.2);
    const auto library = [&](compensation::OverlapMeasure measure) {
      return occlusion_angle(outline, Metres(r), {Metres(x), Metres(y)}, measure).value();
    };
    ASSERT_NEAR(covered_arc(outline, r, x, y), library(compensation::OverlapMeasure::rim_arc), 1e-6);
    if (i % 20 == 0) {
      ASSERT_NEAR(covered_load(outline, r, x, y), library(compensation::OverlapMeasure::load_share), 0.02)
          << "32 rings";
    }
    overlapping += library(compensation::OverlapMeasure::rim_arc) > 0;
  }
  EXPECT_GT(overlapping, 4000);
}

const ConvexPolygon kSquare = ConvexPolygon::square(Metres(0.05));

TEST(CoveredLoad, IsThatOfASectorWhereTheBodyIsOne) {
  EXPECT_NEAR(covered_load(ConvexPolygon::square(Metres(1.0)), 0.01, 1.0, 0.0), kPi, 2e-3) << "hub on a long edge";
  EXPECT_NEAR(covered_load(kSquare, 0.02, 0.01, 0), 2 * kPi, 2e-3) << "wholly over the body";
  EXPECT_EQ(covered_load(kSquare, 0.06, 0.2, 0), 0);
}

TEST(Shadow, OfTheDefaultVehicleInOIsThePapersSixtyFiveDegrees) {
  const Shadow& shadow = example_shadow();
  EXPECT_NEAR(to_degrees(Radians(shadow.arc(0, from_degrees(180)))), 64.837, 0.01);
  EXPECT_NEAR(to_degrees(Radians(shadow.arc(2, from_degrees(165.676)))), 41.293, 0.05);
  EXPECT_NEAR(to_degrees(Radians(shadow.load(0, from_degrees(180)))), 50.51, 0.2);
  EXPECT_EQ(shadow.arc(0, from_degrees(45)), 0);
  EXPECT_EQ(shadow.load(0, from_degrees(45)), 0);
}

TEST(Shadow, OfEachArmIsThatOfItsOwnHinge) {
  Vehicle vehicle = example_vehicle();
  compensation::Airframe& airframe = vehicle.airframe;
  airframe.mirrored = {false, true, false, true};
  const Shadow mirrored(vehicle);
  for (std::size_t arm = 0; arm < 4; ++arm) {
    EXPECT_NEAR(mirrored.arc(arm, from_degrees(170)), example_shadow().arc(0, from_degrees(170)), 1e-9) << arm;
  }
  // Half of a long body, its front arms hinged far from its middle.
  airframe.polygon =
      compensation::PolygonBody{ConvexPolygon::square(Metres(0.045)), compensation::Rotors<compensation::Hinge>(4)};
  for (std::size_t i = 0; i < 4; ++i) {
    airframe.polygon->hinges[i] = {{Metres(i < 2 ? 0.3 : 0.045), Metres(0.045)}, Radians(0), false};
  }
  const Shadow uneven(vehicle);
  EXPECT_EQ(uneven.arc(0, from_degrees(180)), 0);
  EXPECT_GT(uneven.arc(2, from_degrees(180)), 1);
}

TEST(Shadow, GoesRoundWithoutAStepAtHalfATurn) {
  const Shadow& shadow = example_shadow();
  EXPECT_NEAR(shadow.arc(0, from_degrees(181)), shadow.arc(0, from_degrees(-179)), 1e-9);
  EXPECT_NEAR(shadow.arc(0, from_degrees(179.99)), shadow.arc(0, from_degrees(180.01)), 2e-3);
}

constexpr LossLaw kLaws[] = {LossLaw::quadratic, LossLaw::quadratic_by_load, LossLaw::steep_onset};

TEST(LossLaw, GoesThroughWhatThePaperMeasured) {
  for (const LossLaw law : kLaws) EXPECT_EQ(thrust_share(law, 0), 1);
  EXPECT_NEAR(thrust_share(LossLaw::quadratic, 45), 0.90, 1e-4);
  EXPECT_NEAR(thrust_share(LossLaw::quadratic, 270), 0.25, 1e-4);
  EXPECT_NEAR(thrust_share(LossLaw::steep_onset, 45), 0.84, 0.005);
  EXPECT_NEAR(thrust_share(LossLaw::steep_onset, 270), 0.25, 1e-6);
}

TEST(LossLaw, FallsWithOcclusionAndIsNeverTheControllersLine) {
  const compensation::ThrustCurve line = compensation::paper_line();
  for (const LossLaw law : kLaws) {
    double largest_difference = 0;
    for (double degrees = 1; degrees <= 270; ++degrees) {
      EXPECT_LT(thrust_share(law, degrees), thrust_share(law, degrees - 1)) << name_of(law) << " " << degrees;
      const double believed = line.scaling_factor(from_degrees(degrees));
      largest_difference = std::max(largest_difference, std::fabs(thrust_share(law, degrees) - believed));
    }
    EXPECT_GT(largest_difference, 0.02) << name_of(law);
  }
}

TEST(LossLaw, LosesGammaTimesAsMuchInFlight) {
  const Shadow& shadow = example_shadow();
  const Radians o = from_degrees(180);
  for (const LossLaw law : kLaws) {
    const double bench = thrust_share_in_flight(law, 1, shadow, 0, o);
    EXPECT_LT(bench, 0.95);
    EXPECT_NEAR(1 - thrust_share_in_flight(law, 1.4, shadow, 0, o), 1.4 * (1 - bench), 1e-12);
    EXPECT_EQ(thrust_share_in_flight(law, 100, shadow, 0, o), 0.05);
    EXPECT_EQ(thrust_share_in_flight(law, 1.4, shadow, 0, from_degrees(45)), 1) << "nothing is lost in X";
  }
}

}  // namespace shadow_test
}  // namespace kphi::flight
