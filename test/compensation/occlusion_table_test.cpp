#include "compensation/occlusion_table.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "test/compensation/odd_numbers.hpp"

namespace kphi::compensation {
namespace occlusion_table_test {

std::optional<OcclusionTable> table_of(const std::vector<Knot>& knots) {
  return OcclusionTable::from(knots.data(), knots.size());
}

const std::vector<Knot> kKnots{{Radians(0), 1.0, 0.01}, {Radians(1), 0.9, 0.02}, {Radians(3), 0.3, 0.03}};

TEST(OcclusionTable, IsStraightBetweenItsKnotsAndGoesOnBeyondTheLast) {
  const OcclusionTable table = table_of(kKnots).value();
  for (const Knot& knot : kKnots) EXPECT_NEAR(table.at(knot.occlusion), knot.value, 1e-15);
  EXPECT_NEAR(table.at(Radians(0.5)), 0.95, 1e-15);
  EXPECT_NEAR(table.at(Radians(2)), 0.6, 1e-15);
  EXPECT_NEAR(table.at(Radians(4)), 0.0, 1e-15);
  EXPECT_NEAR(table.slope_at(Radians(0.5)), -0.1, 1e-15);
  EXPECT_NEAR(table.slope_at(Radians(5)), -0.3, 1e-15);
}

TEST(OcclusionTable, CannotHoldKnotsThatCannotBe) {
  EXPECT_FALSE(table_of({}));
  EXPECT_FALSE(table_of({{Radians(0), 1, 0}}));
  EXPECT_FALSE(table_of({{Radians(0.1), 1, 0}, {Radians(1), 1, 0}})) << "begins at 0";
  EXPECT_FALSE(table_of({{Radians(0), 1, 0}, {Radians(1), 1, 0}, {Radians(1), 1, 0}})) << "ascends";
  EXPECT_FALSE(table_of({{Radians(0), 1, 0}, {Radians(7), 1, 0}})) << "one turn at most";
  EXPECT_FALSE(table_of({{Radians(0), 1, 0}, {Radians(1), 1, -1e-9}})) << "an error is not negative";
  for (const double odd : {kNaN, kInfinity, -kInfinity}) {
    EXPECT_FALSE(table_of({{Radians(0), odd, 0}, {Radians(1), 1, 0}})) << odd;
    EXPECT_FALSE(table_of({{Radians(0), 1, 0}, {Radians(odd), 1, 0}})) << odd;
  }
  std::vector<Knot> many(kMostKnots + 1);
  for (std::size_t i = 0; i < many.size(); ++i) many[i].occlusion = Radians(0.1 * static_cast<double>(i));
  EXPECT_FALSE(table_of(many));
  many.pop_back();
  EXPECT_TRUE(table_of(many));
}

TEST(OcclusionTable, TakesTheErrorsOfItsKnotsToBeWrongTogether) {
  const OcclusionTable straight = table_of({{Radians(0), 1.0, 0.01}, {Radians(2), 0.5, 0.03}}).value();
  EXPECT_NEAR(straight.standard_error_at(Radians(0)), 0.01, 1e-15);
  EXPECT_NEAR(straight.standard_error_at(Radians(1)), 0.02, 1e-15);
  EXPECT_EQ(table_of({{Radians(0), 1.0}, {Radians(2), 0.5}})->standard_error_at(Radians(1)), kInfinity);
}

TEST(OcclusionTable, SaysHowFarACurveMayBendAwayBetweenItsKnots) {
  // A parabola through unequal knots: its second derivative is known at all but the ends, so the bound holds, and is
  // sqrt(3) times the standard uncertainty.
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> width(0.3, 1.2), bend(-0.1, 0.1);
  for (int i = 0; i < 200; ++i) {
    const double a = bend(random), b = bend(random);
    const auto parabola = [&](double phi) { return 1 + a * phi + b * phi * phi; };
    std::vector<Knot> knots;
    for (double phi = 0; knots.size() < 5; phi += width(random)) knots.push_back({Radians(phi), parabola(phi), 0});
    const OcclusionTable table = table_of(knots).value();
    const double last = knots.back().occlusion.value();
    for (double phi = 0; phi <= last; phi += last / 97) {
      const double off = std::fabs(table.at(Radians(phi)) - parabola(phi));
      EXPECT_LE(off, std::sqrt(3.0) * table.bend_error_at(Radians(phi)) + 1e-14);
      EXPECT_GE(off * (1 + 1e-9) + 1e-14, std::sqrt(3.0) * table.bend_error_at(Radians(phi)) * (1 - 1e-9));
    }
    for (const Knot& knot : knots) EXPECT_EQ(table.bend_error_at(knot.occlusion), 0);
    EXPECT_EQ(table.bend_error_at(Radians(last + 0.1)), 0);
  }
}

TEST(OcclusionTable, IsMovedAsAWhole) {
  const OcclusionTable moved = table_of(kKnots)->moved(2.0, 0.5);
  EXPECT_NEAR(moved.at(Radians(0)), 2.0, 1e-15);
  EXPECT_NEAR(moved.at(Radians(3)), 2.0 - 0.35, 1e-15);
  EXPECT_EQ(moved.standard_error_at(Radians(3)), 0.03);
}

}  // namespace occlusion_table_test
}  // namespace kphi::compensation
