#include "fit/logs/throttle_law.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
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
  double low, high;  ///< of the shape
};
constexpr LawOfTest kLaws[]{{ThrottleForm::px4, 0, 1},
                            {ThrottleForm::ardupilot, -0.2, 0.9},
                            {ThrottleForm::ardupilot_voltage, -0.2, 0.9},
                            {ThrottleForm::betaflight, 0, 1},
                            {ThrottleForm::betaflight_4_2, 0, 1.5},
                            {ThrottleForm::crazyflie, 0.002, 0.01}};

/// What the stacks' own sources make of a wanted thrust: the output that they give to the motor, 0 to 1. Written from
/// their formulas and without the library; p: the thrust at full output and the shape.
double output_by(ThrottleForm form, double full, double shape, double thrust, double volts) {
  const double m = thrust / full;
  const auto root = [&](double share) {  // of f x² + (1 − f) x = share
    if (std::abs(shape) < 1e-12) return share;
    const double linear = (1 - shape) / (2 * shape);
    return (shape > 0 ? 1 : -1) * std::sqrt(linear * linear + share / shape) - linear;
  };
  switch (form) {
    case ThrottleForm::px4:
      return root(m);
    case ThrottleForm::ardupilot:
      return 0.15 + 0.8 * root(m);
    case ThrottleForm::ardupilot_voltage: {
      // lift_max scales the thrust that is asked for, the battery's share the output: together the curve is over x V.
      const double share = volts / 12, lift_max = share * (1 - shape) + shape * share * share;
      return 0.15 + 0.8 * root(lift_max * (m / lift_max)) / share;
    }
    case ThrottleForm::betaflight: {
      const double inverse = 1 - m;
      return 0.055 + 0.945 * m * (1 + shape * inverse * (1 + shape * (inverse - m)));
    }
    case ThrottleForm::betaflight_4_2:
      return 0.055 + 0.945 * m * (1 + shape * (1 - m) * (1 - m));
    case ThrottleForm::crazyflie:
      break;
  }
  return NAN;
}

/// c0 to c3 of Crazyflie's test: thrust N over volts.
std::array<double, 4> cubic(double shape) { return {-0.02, 0.06, -0.01, shape}; }

/// Thrust of an output, by trying thrusts.
double thrust_by(ThrottleForm form, double full, double shape, double u, double volts) {
  if (form == ThrottleForm::crazyflie) {
    const auto c = cubic(shape);
    const double v = u * volts;
    return c[0] + c[1] * v + c[2] * v * v + c[3] * v * v * v;
  }
  double low = -full, high = 1.2 * full;
  for (int i = 0; i < 80; ++i) {
    const double thrust = (low + high) / 2;
    (thrust < 0 || output_by(form, full, shape, thrust, volts) < u ? low : high) = thrust;
  }
  return (low + high) / 2;
}

/// KPHI_LOGS: how many of each.
TEST(ThrottleLaws, HoldTheTruthIn95Of100Logs) {
  const char* const more = std::getenv("KPHI_LOGS");
  const int count = more == nullptr ? 200 : std::atoi(more);
  for (const LawOfTest& law : kLaws) {
    int held = 0, fitted = 0;
    for (int seed = 1; seed <= count; ++seed) {
      Random random(static_cast<std::uint64_t>(seed));
      const double shape = between(random, law.low, law.high), noise = between(random, 0.002, 0.02);
      const double full = law.form == ThrottleForm::crazyflie ? 0.3 : between(random, 3, 12);
      const auto rows = static_cast<int>(between(random, 16, 60));
      std::vector<ThrottlePoint> points;
      for (int i = 0; i < rows; ++i) {
        const double u = 0.16 + 0.79 * i / (rows - 1.0), sag = i % 2 == 0 ? 0 : 1.5;
        const double volts = i + 1 == rows ? 12 : 12 - sag - 0.5 * u;
        points.push_back({u, thrust_by(law.form, full, shape, u, volts) + noise * full * random.normal(), volts});
      }
      const auto fit = fit_throttle(law.form, points);
      if (!fit) continue;
      ++fitted;
      const auto last = std::ranges::find_if(fit->parameters.rbegin(), fit->parameters.rend(),
                                             [](const ThrottleParameter& one) { return one.half_95 > 0; });
      ASSERT_NE(last, fit->parameters.rend());
      const double truth = last->name == "thrust_linear" ? 100 * shape : shape;
      held += std::abs(last->value - truth) <= last->half_95 ? 1 : 0;
    }
    const double share = static_cast<double>(held) / fitted;
    fmt::print("{}: {} of {} fitted, {:.1f} % hold the truth\n", name_of(law.form), fitted, count, 100 * share);
    EXPECT_GE(fitted, 0.98 * count);
    EXPECT_NEAR(share, 0.95, std::max(0.02, 4 * std::sqrt(0.0475 / count))) << name_of(law.form);
  }
}

TEST(ThrottleLaws, AreToldApartOnlyWhereTheRowsTell) {
  for (const double noise : {1e-4, 0.5}) {
    Random random(3);
    std::vector<ThrottlePoint> points;
    for (int i = 0; i < 30; ++i) {
      const double u = 0.1 + 0.03 * i;
      points.push_back({u, thrust_by(ThrottleForm::betaflight_4_2, 10, 0.9, u, 12) + noise * random.normal(), 12});
    }
    EXPECT_EQ(told_apart(ThrottleForm::px4, ThrottleForm::betaflight_4_2, points), noise < 0.01);
  }
}

TEST(ThrottleLaws, OfALogAreSaidInItsStacksWords) {
  std::string text = "Throttle (%),Thrust (N),rpm\n";
  for (int i = 1; i <= 20; ++i) {
    const double u = 0.05 * i, thrust = 10 * (0.35 * u * u + 0.65 * u) + (i % 2 == 0 ? 0.01 : -0.01);
    text += fmt::format("{:.1f},{:.5f},{:.1f}\n", 100 * u, thrust, 1000 * std::sqrt(thrust));
  }
  const auto lines = throttle_lines(throttle_laws(import_table(text, "own.csv", {}).table));
  EXPECT_THAT(lines, Contains(HasSubstr("PX4                    THR_MDL_FAC = 0.35")));
  EXPECT_THAT(lines, Contains(HasSubstr("MOT_SPIN_MIN = 0.15, MOT_SPIN_MAX = 0.95")));
  EXPECT_THAT(lines, Contains(HasSubstr("Betaflight from 2026.6 thrust_linear = ")));
  EXPECT_THAT(lines, Contains(HasSubstr("Betaflight to 2025.12  thrust_linear = ")));
  for (const char* volts : {"Crazyflie", "ArduPilot with voltage"})
    EXPECT_EQ(std::ranges::count_if(lines, [&](const std::string& line) { return line.starts_with(volts); }), 0)
        << "no voltage";
}

TEST(ThrottleLaws, AreNotFittedWhereTheRowsDoNotTellThem) {
  std::vector<ThrottlePoint> points(10, {0.5, 3, 12});
  for (const ThrottleForm form : kThrottleForms) EXPECT_FALSE(fit_throttle(form, points)) << name_of(form);
  points.assign(4, {0.5, 3, 12});
  for (const ThrottleForm form : kThrottleForms) EXPECT_FALSE(fit_throttle(form, points)) << name_of(form);
}

}  // namespace throttle_law_test
}  // namespace kphi::fit
