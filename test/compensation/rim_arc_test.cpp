#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "compensation/occlusion.hpp"
#include "test/compensation/geometry_vectors.hpp"
#include "test/compensation/odd_numbers.hpp"

namespace kphi::compensation {
namespace rim_arc_test {

double arc(double half_side, double radius, double x, double y) {
  return rim_arc(Metres(half_side), Metres(radius), Metres(x), Metres(y)).value();
}

double arc_of_arm(double half_side, double arm_length, double radius, double theta) {
  return arc(half_side, radius, half_side + arm_length * std::cos(theta), half_side + arm_length * std::sin(theta));
}

TEST(RimArc, AgreesWithTheKnownAnswers) {
  const auto vectors = geometry_vectors();
  ASSERT_EQ(vectors.size(), 114u);
  for (const GeometryVector& v : vectors) expect_known_arc(arc(v.half_side, v.radius, v.hub_x, v.hub_y), v);
}

TEST(RimArc, OfAHubOnAnEdgeLineBeyondTheCornerIsTheArcCosineOfTheDistance) {
  for (const double phi : {5.0, 30.0, 65.0, 85.0}) {
    const double gap = 0.0635 * std::cos(phi * kPi / 180);
    EXPECT_NEAR(arc(0.045, 0.0635, -0.045 - gap, 0.045) * 180 / kPi, phi, 1e-10);
  }
}

TEST(RimArc, IsZeroApartAndFullInside) {
  EXPECT_EQ(arc(0.05, 0.0635, 0.2, 0.2), 0.0);
  EXPECT_EQ(arc(0.05, 0.0635, 0.105, 0.105), 0.0);  // boxes overlap, the corner is out of reach
  EXPECT_DOUBLE_EQ(arc(0.1, 0.0635, 0.0, 0.0), 2 * kPi);
  EXPECT_EQ(arc(0.02, 0.0635, 0.0, 0.0), 0.0) << "blind to a body wholly under the disk";
}

TEST(RimArc, IsAQuarterOnACornerAndAHalfOnAnEdge) {
  EXPECT_NEAR(arc(0.2, 0.0635, 0.2, 0.2), kPi / 2, 1e-12);
  EXPECT_NEAR(arc(0.2, 0.0635, 0.2, 0.0), kPi, 1e-12);
}

TEST(RimArc, GrowsLikeARootFromTangency) {
  // A large body, entered by p: φ = 2 acos(1 − p/R).
  for (const double penetration : {1e-5, 1e-4, 1e-3, 1e-2}) {
    EXPECT_NEAR(arc(1.0, 0.0635, 1.0635 - penetration, 0.0), 2 * std::acos(1 - penetration / 0.0635), 1e-11);
  }
}

TEST(RimArc, AtTangencyIsTinyWhateverTheRounding) {
  for (int ulps = -4; ulps <= 4; ++ulps) {
    double moved = 0.1135;
    for (int i = 0; i < std::abs(ulps); ++i) moved = std::nextafter(moved, ulps < 0 ? 0.0 : 1.0);
    const double phi = arc(0.05, 0.0635, moved, 0.0);
    EXPECT_GE(phi, 0.0);
    EXPECT_LE(phi, 2e-7);
  }
}

TEST(RimArc, IsTheSameFromEverySideOfTheSquare) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> side(0.01, 0.15), radius(0.03, 0.12), place(-0.2, 0.2);
  for (int i = 0; i < 10000; ++i) {
    const double a = side(random), r = radius(random), x = place(random), y = place(random);
    const double phi = arc(a, r, x, y);
    EXPECT_GE(phi, 0.0);
    EXPECT_LE(phi, 2 * kPi);
    EXPECT_NEAR(arc(a, r, -y, x), phi, 1e-7);
    EXPECT_NEAR(arc(a, r, -x, -y), phi, 1e-7);
    EXPECT_NEAR(arc(a, r, y, x), phi, 1e-7);
    EXPECT_NEAR(arc(2 * a, 2 * r, 2 * x, 2 * y), phi, 1e-12);
  }
}

TEST(RimArc, IsNeverNaN) {
  const double odd[] = {kNaN, kInfinity, -kInfinity, 1e300, -1e300, 0.0, 1e-300, 0.05};
  for (int i = 0; i < 8 * 8 * 8 * 8; ++i) {
    const double a = odd[i / 512], r = odd[i / 64 % 8], x = odd[i / 8 % 8], y = odd[i % 8];
    EXPECT_FALSE(std::isnan(arc(a, r, x, y))) << a << ' ' << r << ' ' << x << ' ' << y;
  }
}

ContactFreeWindow window(double half_side, double arm_length, double radius) {
  return contact_free_window(Metres(half_side), Metres(arm_length), Metres(radius));
}

TEST(ContactFreeWindow, EndsWhereTheBodyIsTouchedOrNowhere) {
  const ContactFreeWindow free = window(0.045, 0.117, 0.0635), whole = window(0.02, 0.117, 0.0635);
  EXPECT_NEAR(to_degrees(free.from), -57.474, 5e-4);
  EXPECT_NEAR(to_degrees(free.to), 147.474, 5e-4) << "at the next corner";
  EXPECT_NEAR(window(0.2, 0.117, 0.0635).to.value(), kPi - std::asin(0.0635 / 0.117), 1e-15) << "at the edge";
  EXPECT_EQ(to_degrees(whole.from), -90.0) << "arms that never reach the body";
  EXPECT_EQ(to_degrees(whole.to), 180.0);
  for (const double theta : {-1.5, 0.0, kPi / 4, 3.0})
    EXPECT_FALSE(window(0.05, 0.06, 0.06).contains(Radians(theta))) << "an arm no longer than the propeller";
}

TEST(ContactFreeWindow, SeparatesTouchingFromFreeAnglesOnRandomVehicles) {
  std::mt19937_64 random(65);
  std::uniform_real_distribution<double> side(0.01, 0.15), radius(0.03, 0.12), longer(1.01, 2.5), share(0.0, 1.0);
  int corners = 0, edges = 0, never = 0;
  for (int i = 0; i < 2000; ++i) {
    const double a = side(random), r = radius(random), arm = r * longer(random);
    const ContactFreeWindow free = window(a, arm, r);
    const bool reaches = free.to.value() < kPi;
    ASSERT_NEAR(free.from.value() + free.to.value(), kPi / 2, 1e-14);
    never += !reaches;
    edges += reaches && free.to.value() == kPi - std::asin(r / arm);
    corners += reaches && free.to.value() != kPi - std::asin(r / arm);
    for (int j = 0; j < 20; ++j) {
      const double inside = free.from.value() + share(random) * (free.to - free.from).value();
      EXPECT_LE(arc_of_arm(a, arm, r, inside), 1e-6) << a << ' ' << arm << ' ' << r << ' ' << inside;
    }
    if (reaches && free.to.value() < kPi - 1e-3) {
      // Just past the window the rim overlaps, on both sides.
      EXPECT_GT(arc_of_arm(a, arm, r, free.to.value() + 1e-4), 0.0) << a << ' ' << arm << ' ' << r;
      EXPECT_GT(arc_of_arm(a, arm, r, free.from.value() - 1e-4), 0.0) << a << ' ' << arm << ' ' << r;
    }
  }
  EXPECT_GT(corners, 50);
  EXPECT_GT(edges, 50);
  EXPECT_GT(never, 50);
}

}  // namespace rim_arc_test
}  // namespace kphi::compensation
