#include <gtest/gtest.h>

#include "compensation/flight/tables.hpp"
#include "test/compensation/flight/flight_fixture.hpp"

namespace kphi::flight {
namespace paper_test {

/// How far ë may be from kP e + kD ė when the printed numbers are rounded: half a unit of each last digit.
double rounding(const Gains& gains, double error_digit) {
  return gains.position.z() * error_digit / 2 + gains.velocity.z() * 1e-5 / 2 + 1e-5 / 2;
}

TEST(TableTwo, IsSatisfiedByFifteenAndSixWithinItsRounding) {
  const Gains gains = example_gains();
  ASSERT_EQ(gains.position.z(), 15);
  ASSERT_EQ(gains.velocity.z(), 6);
  const double digits[] = {1e-5, 1e-4};  // 0.16859 and -0.0434
  for (std::size_t i = 0; i < kHeightRows.size(); ++i) {
    const HeightRow& row = kHeightRows[i];
    EXPECT_NEAR(height_demand(gains, row.error, row.error_rate), row.acceleration, rounding(gains, digits[i]));
  }
}

TEST(TableTwo, IsSatisfiedByNoOtherGainsASixthAway) {
  for (const auto& [kp, kd] :
       std::vector<std::pair<double, double>>{{15.2, 6}, {14.8, 6}, {15, 6.1}, {15, 5.9}, {10, 4}}) {
    Gains gains = example_gains();
    gains.position.z() = kp;
    gains.velocity.z() = kd;
    const HeightRow& row = kHeightRows[0];
    EXPECT_GT(std::fabs(height_demand(gains, row.error, row.error_rate) - row.acceleration), rounding(gains, 1e-5));
  }
}

TEST(Experiments, AreNineWithDistinctNamesAndBothKindsOfO) {
  std::set<std::string_view> names;
  for (const Experiment& experiment : kExperiments) {
    names.insert(experiment.name);
    EXPECT_GE(experiment.leg_count, 2u);
    EXPECT_LE(experiment.leg_count, experiment.legs.size());
  }
  EXPECT_EQ(names.size(), 9u);
}

/// The leg that stands for a row must be of the shape that the row names.
TEST(PaperTables, PointAtLegsOfTheirOwnShape) {
  const auto matches = [](std::string_view name, const Leg& leg) {
    return name == "X" ? leg.shape == Shape::x : leg.shape == Shape::o && leg.compensated == (name == "O c.");
  };
  for (const HoverRow& row : kHoverRows) {
    const Experiment& experiment = kExperiments[row.flight];
    EXPECT_TRUE(matches(row.final, experiment.legs[row.leg])) << experiment.name;
    EXPECT_TRUE(row.leg == 0 || matches(row.start, experiment.legs[row.leg - 1])) << experiment.name;
  }
  for (const HeightRow& row : kHeightRows) EXPECT_TRUE(matches(row.final, kExperiments[row.flight].legs[row.leg]));
  for (const ForwardRow& row : kForwardRows) {
    const Experiment& experiment = kExperiments[row.flight];
    EXPECT_EQ(row.title.substr(0, 6) == "rising", experiment.path == Path::rising_circle);
    for (const auto& [name, cell] : {std::pair{"X", row.x}, {"O n.c.", row.o_plain}, {"O c.", row.o_compensated}}) {
      EXPECT_TRUE(!cell || matches(name, experiment.legs[cell->leg])) << experiment.name << ", " << name;
    }
  }
}

TEST(Reference, FliesThePapersCircles) {
  EXPECT_NEAR(kLapSeconds, 15.708, 1e-3);
  double lowest = 9, highest = 0;
  for (double t = 0; t < kLapSeconds; t += 0.01) {
    const Reference level = reference_at(Path::level_circle, t), rising = reference_at(Path::rising_circle, t);
    EXPECT_NEAR(level.position.head<2>().norm(), 1.5, 1e-12);
    EXPECT_NEAR(level.velocity.norm(), 0.6, 1e-12);
    EXPECT_NEAR(level.acceleration.norm(), 0.24, 1e-12);
    EXPECT_EQ(level.position.z(), 1.5);
    lowest = std::min(lowest, rising.position.z());
    highest = std::max(highest, rising.position.z());
    const Reference before = reference_at(Path::rising_circle, t - 1e-5),
                    after = reference_at(Path::rising_circle, t + 1e-5);
    EXPECT_LT(((after.position - before.position) / 2e-5 - rising.velocity).norm(), 1e-6);
    EXPECT_LT(((after.velocity - before.velocity) / 2e-5 - rising.acceleration).norm(), 1e-6);
    EXPECT_LT(((after.acceleration - before.acceleration) / 2e-5 - rising.jerk).norm(), 1e-6);
  }
  EXPECT_NEAR(lowest, 1.25, 1e-4);
  EXPECT_NEAR(highest, 1.75, 1e-4);
}

}  // namespace paper_test
}  // namespace kphi::flight
