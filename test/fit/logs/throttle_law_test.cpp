#include "fit/logs/throttle_law.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "base/random.hpp"
#include "fit/logs/import_table.hpp"

namespace kphi::fit {
namespace throttle_law_test {

using ::testing::Contains;
using ::testing::HasSubstr;

/// Between low and high.
double between(Random& random, double low, double high) { return low + (high - low) * (random.symmetric() + 1) / 2; }

struct LawOfTest {
  ThrottleForm form;
  double low, high;  ///< of the parameter
};
constexpr LawOfTest kLaws[]{{ThrottleForm::px4, 0, 1},
                            {ThrottleForm::ardupilot, -0.2, 0.9},
                            {ThrottleForm::betaflight, 0, 1.5},
                            {ThrottleForm::crazyflie, 0.2, 2}};

/// What each stack's own words make of throttle, written without the library: by trying thrusts.
double thrust_by(ThrottleForm form, double p0, double p1, double u, double volts) {
  if (form == ThrottleForm::px4 || form == ThrottleForm::ardupilot) return p0 * (p1 * u * u + (1 - p1) * u);
  double low = 0, high = 100;
  for (int i = 0; i < 80; ++i) {
    const double thrust = (low + high) / 2, m = thrust / p0;
    const double needed = form == ThrottleForm::betaflight ? (m > 1.2 ? 9 : m * (1 + p1 * (1 - m) * (1 - m)))
                                                           : (p0 * thrust + p1 * thrust * thrust) / volts;
    (needed < u ? low : high) = thrust;
  }
  return (low + high) / 2;
}

/// KPHI_LOGS: how many of each.
TEST(ThrottleLaws, HoldTheTruthIn95Of100Logs) {
  const char* const more = std::getenv("KPHI_LOGS");
  const int count = more == nullptr ? 250 : std::atoi(more);
  for (const LawOfTest& law : kLaws) {
    int held = 0, fitted = 0;
    for (int seed = 1; seed <= count; ++seed) {
      Random random(static_cast<std::uint64_t>(seed));
      const double p1 = between(random, law.low, law.high), noise = between(random, 0.002, 0.03);
      const double p0 = law.form == ThrottleForm::crazyflie ? between(random, 1, 3) : between(random, 3, 12);
      const auto rows = static_cast<int>(between(random, 12, 60));
      std::vector<ThrottlePoint> points;
      for (int i = 0; i < rows; ++i) {
        const double u = 0.1 + 0.9 * i / rows, volts = 12 - 1.5 * u;
        const double thrust = thrust_by(law.form, p0, p1, u, volts);
        points.push_back({u, thrust + noise * (law.form == ThrottleForm::crazyflie ? 3 : p0) * random.normal(), volts});
      }
      const auto fit = fit_throttle(law.form, points);
      if (!fit) continue;
      ++fitted;
      const ThrottleParameter& last = fit->parameters.back();
      const double truth = law.form == ThrottleForm::betaflight ? 100 * p1 : p1;
      held += std::abs(last.value - truth) <= last.half_95 ? 1 : 0;
    }
    const double share = static_cast<double>(held) / fitted;
    fmt::print("form {}: {} of {} fitted, {:.1f} % hold the truth\n", static_cast<int>(law.form), fitted, count,
               100 * share);
    EXPECT_GE(fitted, 0.98 * count);
    EXPECT_NEAR(share, 0.95, std::max(0.02, 4 * std::sqrt(0.0475 / count)));
  }
}

TEST(ThrottleLaws, AreToldApartOnlyWhereTheRowsTell) {
  for (const double noise : {1e-4, 0.2}) {
    Random random(3);
    std::vector<ThrottlePoint> points;
    for (int i = 0; i < 30; ++i) {
      const double u = 0.1 + 0.03 * i;
      points.push_back({u, thrust_by(ThrottleForm::betaflight, 10, 0.9, u, 12) + noise * random.normal(), 12});
    }
    const auto px4 = fit_throttle(ThrottleForm::px4, points),
               betaflight = fit_throttle(ThrottleForm::betaflight, points);
    ASSERT_TRUE(px4 && betaflight);
    EXPECT_EQ(told_apart(*px4, *betaflight), noise < 0.01);
  }
}

TEST(ThrottleLaws, OfALogAreSaidInItsStacksWords) {
  std::string text = "Throttle (%),Thrust (N),rpm\n";
  for (int i = 1; i <= 20; ++i) {
    const double u = 0.05 * i, thrust = 10 * (0.35 * u * u + 0.65 * u) + (i % 2 == 0 ? 0.01 : -0.01);
    text += fmt::format("{:.1f},{:.5f},{:.1f}\n", 100 * u, thrust, 1000 * std::sqrt(thrust));
  }
  const auto lines = throttle_lines(import_table(text, "own.csv", {}).table);
  EXPECT_THAT(lines, Contains(HasSubstr("PX4        THR_MDL_FAC = 0.350")));
  EXPECT_THAT(lines, Contains(HasSubstr("ArduPilot  MOT_THST_EXPO = 0.350")));
  EXPECT_THAT(lines, Contains(HasSubstr("thrust_linear = ")));
  EXPECT_EQ(std::ranges::count_if(lines, [](const std::string& line) { return line.starts_with("Crazyflie"); }), 0)
      << "no voltage";
}

}  // namespace throttle_law_test
}  // namespace kphi::fit
