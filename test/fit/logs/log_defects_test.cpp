// Tables with the defects that tables of others have: each with its words, and no k more than 5 % wrong that would
// leave with exit 0, whatever advice of kphi is followed.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "base/error.hpp"
#include "base/random.hpp"
#include "compensation/units.hpp"
#include "fit/logs/import_table.hpp"

namespace kphi::fit {
namespace log_defects_test {

using ::testing::HasSubstr;

/// Uniform from 0 to 1.
double share_of(Random& random) { return (random.symmetric() + 1) / 2; }

constexpr double kK = 1.2e-6;
double newtons(double rpm, double k = kK) { return k * std::pow(from_rpm(rpm).value(), 2); }

/// What an import of these options ends in.
struct Outcome {
  std::vector<double> k, u;  ///< of each group
  std::string said;          ///< findings
  bool spoilt = false;       ///< exit 5
  std::string refused;       ///< with exit 2 or 5
  [[nodiscard]] bool leaves_with_0() const { return !spoilt && refused.empty(); }
};

Outcome outcome_of(const std::string& text, const ImportOptions& options = {}) {
  Outcome outcome;
  try {
    for (const Import& import : import_groups(text, "own.csv", options)) {
      const JudgedFit judged = judged_fit(import.table);
      for (const OcclusionFit& one : judged.fits)
        outcome.k.push_back(one.fit.parameters.k), outcome.u.push_back(one.u_k);
      for (const auto* list : {&import.findings, &judged.findings}) {
        for (const LogFinding& finding : *list) {
          outcome.said += fmt::format("{}: {}\n", name_of(finding.kind), finding.text);
          outcome.spoilt |= spoils_k(finding.kind);
        }
      }
    }
  } catch (const std::runtime_error& error) {
    outcome.refused = error.what();
  }
  return outcome;
}

/// What follows from the advice in a refusal or a finding.
std::vector<ImportOptions> advised(const Outcome& outcome) {
  std::vector<ImportOptions> all;
  const std::string words = outcome.refused + outcome.said;
  const auto says = [&](const char* option) { return words.find(option) != std::string::npos; };
  if (says("import with --reverse-thrust")) all.emplace_back().rows.reverse_thrust = true;
  if (says("--speed optical")) all.emplace_back().rows.speed = SpeedSource::optical;
  return all;
}

void expect_no_wrong_k(const std::string& text, double k, const char* what) {
  const Outcome first = outcome_of(text);
  std::vector<Outcome> outcomes{first};
  for (const ImportOptions& options : advised(first)) outcomes.push_back(outcome_of(text, options));
  for (const Outcome& outcome : outcomes) {
    if (!outcome.leaves_with_0()) continue;
    for (const double one : outcome.k) EXPECT_NEAR(one / k, 1, 0.05) << what << "\n" << outcome.said;
  }
}

/// A ramp up and down in a few hundred rows; zero_n: what the channel reads without thrust.
std::string ramp(double zero_n, double sign, double noise_n, std::uint64_t seed, int rest_rows = 0,
                 double low_rpm = 3000, double high_rpm = 9000) {
  Random random(seed);
  std::string text = "Time (s),Throttle (us),Thrust (N),Motor Optical Speed (RPM)\n";
  for (int i = 0; i < rest_rows; ++i)
    text += fmt::format("{},1000,{},0\n", 0.05 * i, zero_n + noise_n * random.normal());
  for (int i = 0; i < 400; ++i) {
    const double share = 1 - std::abs(i / 200.0 - 1), rpm = low_rpm + (high_rpm - low_rpm) * share;
    text += fmt::format("{},{},{},{:.1f}\n", 20 + 0.05 * i, 1200 + 600 * share,
                        sign * newtons(rpm) + zero_n + noise_n * random.normal(), rpm);
  }
  return text;
}

TEST(SpeedsOfALog, AThousandTimesTooSlowGiveNoK) {
  // "2.000" RPM beside "0.296" N: whoever exported it grouped the one and not the other.
  std::string text = "rpm;thrust (N)\n";
  for (int thousands = 2; thousands <= 14; ++thousands)
    text += fmt::format("{}.000;{:.3f}\n", thousands, newtons(1000 * thousands));
  const Outcome outcome = outcome_of(text);
  EXPECT_TRUE(outcome.spoilt) << outcome.said;
  EXPECT_THAT(outcome.said, HasSubstr("no row reaches 100 RPM"));
}

TEST(UntaredLog, IsFittedWithItsOffset) {
  for (const double zero : {-4.0, -1.6, -0.6, -0.3, 0.3, 0.8, 3.0}) {
    const Outcome outcome = outcome_of(ramp(zero, 1, 0.01, 1));
    SCOPED_TRACE(fmt::format("zero {} N: {}{}", zero, outcome.refused, outcome.said));
    ASSERT_TRUE(outcome.leaves_with_0());
    EXPECT_THAT(outcome.said, HasSubstr("zero_fitted: thrust over ω² begins at"));
    EXPECT_NEAR(outcome.k[0] / kK, 1, 0.01);
    EXPECT_LT(std::abs(outcome.k[0] - kK), 2 * outcome.u[0]) << "± holds it";
  }
}

TEST(UntaredLog, IsTiedToItsRowsWithTheMotorOff) {
  const Outcome outcome = outcome_of(ramp(-1.6, 1, 0.01, 2, 100));
  ASSERT_TRUE(outcome.leaves_with_0()) << outcome.refused;
  EXPECT_THAT(outcome.said, HasSubstr("untared: with the motor off the stand reads -1.60"));
  EXPECT_NEAR(outcome.k[0] / kK, 1, 2e-3);
}

TEST(TaredLog, IsTakenAsItIs) {
  const Outcome outcome = outcome_of(ramp(0, 1, 0.01, 3));
  ASSERT_TRUE(outcome.leaves_with_0()) << outcome.said;
  EXPECT_EQ(outcome.said.find("zero_fitted"), std::string::npos);
  EXPECT_NEAR(outcome.k[0] / kK, 1, 2e-3);
}

TEST(SignOfALog, IsThatOfItsSlope) {
  const Outcome reversed = outcome_of(ramp(0, -1, 0.01, 4));
  EXPECT_THAT(reversed.refused, HasSubstr("its sign is reversed; import with --reverse-thrust"));
  ImportOptions turned;
  turned.rows.reverse_thrust = true;
  const Outcome right = outcome_of(ramp(0, -1, 0.01, 4), turned);
  ASSERT_TRUE(right.leaves_with_0()) << right.refused;
  EXPECT_NEAR(right.k[0] / kK, 1, 2e-3);
  EXPECT_EQ(right.said.find("negative_thrust"), std::string::npos) << "audited after turning: " << right.said;
  EXPECT_THAT(outcome_of(ramp(0, 1, 0.01, 4), turned).refused, HasSubstr("leave --reverse-thrust out"));
}

TEST(SignOfALog, IsNotTakenForReversedWhereItIsUntared) {
  for (const double noise : {0.01, 0.1, 0.3}) {
    const std::string text = ramp(-3, 1, noise, 5);
    EXPECT_EQ(outcome_of(text).refused.find("reversed"), std::string::npos);
    expect_no_wrong_k(text, kK, "sum below 0, slope above");
  }
}

TEST(ZeroOfALog, AtOneSpeedIsUnknown) {
  const Outcome outcome = outcome_of(ramp(0.4, 1, 0.02, 6, 0, 6000, 6060));
  EXPECT_TRUE(outcome.spoilt) << outcome.said;
  EXPECT_THAT(outcome.said,
              HasSubstr("zero_unknown: too few rows with the motor off, or none, and 6000 to 6060 RPM do not tell"));
  const Outcome below = outcome_of(ramp(-3, 1, 0.02, 6, 0, 6000, 6060));
  EXPECT_THAT(below.refused, HasSubstr("thrust does not follow speed²"));
}

TEST(TwoDirections, AreFittedApart) {
  std::string text = "PWM (us),RPM,Force (kgf)\n";
  for (int pwm = 1100; pwm <= 1900; pwm += 20) {
    const double u = (pwm - 1500) / 400.0;
    text += fmt::format("{},{:.0f},{:.4f}\n", pwm, std::abs(u) * 3000, (u > 0 ? 5 : -4) * u * u);
  }
  const Outcome outcome = outcome_of(text);
  ASSERT_TRUE(outcome.leaves_with_0()) << outcome.refused << outcome.said;
  ASSERT_EQ(outcome.k.size(), 2u);
  EXPECT_THAT(outcome.said, HasSubstr("fitted apart: reverse (turned); forward"));
  EXPECT_NEAR(outcome.k[0] / (4 * 9.80665 / std::pow(from_rpm(3000).value(), 2)), 1, 1e-3);
  EXPECT_NEAR(outcome.k[1] / (5 * 9.80665 / std::pow(from_rpm(3000).value(), 2)), 1, 1e-3);
}

TEST(TwoPropellers, AreFittedApartByTheirColumnAndRefusedWithoutOne) {
  std::string named = "prop,rpm,thrust (N)\n", bare = "rpm,thrust (N)\n";
  for (int i = 0; i < 20; ++i) {
    const double rpm = 3000 + 1000.0 * (i % 10), k = i < 10 ? kK : 1.15 * kK;
    named += fmt::format("{},{},{:.5f}\n", i < 10 ? "5x3" : "5x4", rpm, newtons(rpm, k));
    bare += fmt::format("{},{:.5f}\n", rpm, newtons(rpm, k));
  }
  const Outcome apart = outcome_of(named);
  ASSERT_EQ(apart.k.size(), 2u) << apart.refused;
  EXPECT_NEAR(apart.k[1] / apart.k[0], 1.15, 1e-3);
  const Outcome pooled = outcome_of(bare);
  EXPECT_TRUE(pooled.spoilt);
  EXPECT_THAT(pooled.said, HasSubstr("two levels at the same speeds: 1.2e-06 N/(rad/s)² in 7 rows of lines 5 to 11"));
}

TEST(Occlusions, AreNotPooled) {
  std::string text = "phi (deg),rpm,thrust (N)\n";
  for (const double phi : {0.0, 90.0})
    for (int i = 0; i < 10; ++i)
      text += fmt::format("{},{},{:.5f}\n", phi, 3000 + 1000 * i, newtons(3000 + 1000.0 * i, kK * (phi > 0 ? 0.7 : 1)));
  const Outcome outcome = outcome_of(text);
  ASSERT_EQ(outcome.k.size(), 2u) << outcome.refused;
  EXPECT_NEAR(outcome.k[1] / outcome.k[0], 0.7, 1e-3);
}

TEST(Supplies, AreFittedApart) {
  std::string text = "voltage (V),rpm,thrust (N)\n";
  for (const double volts : {11.1, 14.8})
    for (int i = 0; i < 8; ++i)
      text += fmt::format("{},{},{:.5f}\n", volts, 3000 + 50 * volts * i, newtons(3000 + 50 * volts * i));
  EXPECT_EQ(outcome_of(text).k.size(), 2u);
}

TEST(OneK, ThatDoesNotDescribeItsRowsIsRefused) {
  Random random(7);
  std::string text = "rpm,thrust (N)\n";
  for (int i = 0; i < 30; ++i)
    text += fmt::format("{},{:.5f}\n", 3000 + 300 * i, newtons(3000 + 300.0 * i) * (0.4 + 1.2 * share_of(random)));
  const Outcome outcome = outcome_of(text);
  EXPECT_TRUE(outcome.spoilt);
  EXPECT_THAT(outcome.said, HasSubstr("one k does not describe them"));
}

TEST(SteppedSpeed, CostsHalfItsStep) {
  Random random(8);
  std::string text = "time (s),thrust (N),rpm\n";
  for (int i = 0; i < 300; ++i) {
    const double rpm = 900 + 1300.0 * i / 300;
    text += fmt::format("{},{:.5f},{:.0f}\n", 0.1 * i, newtons(rpm, 1e-4) + 0.002 * random.normal(),
                        60 * std::floor(rpm / 60));
  }
  const Outcome outcome = outcome_of(text);
  ASSERT_TRUE(outcome.leaves_with_0()) << outcome.said << outcome.refused;
  EXPECT_THAT(outcome.said, HasSubstr("speed_stepped: the speed comes in steps of 60 RPM"));
  EXPECT_LT(std::abs(outcome.k[0] / 1e-4 - 1), 0.05);
  EXPECT_LT(std::abs(outcome.k[0] - 1e-4), 2 * outcome.u[0]) << "± holds what the counter cuts off";
}

TEST(SetSpeeds, AreNotASteppedOne) {
  Random random(9);
  std::string text = "thrust (N),rpm\n";
  for (int i = 0; i < 300; ++i) {
    const double rpm = 2000 + 500 * (i / 30);
    text += fmt::format("{:.5f},{}\n", newtons(rpm) + 0.002 * random.normal(), rpm);
  }
  EXPECT_EQ(outcome_of(text).said.find("speed_stepped"), std::string::npos);
}

TEST(FrozenSpeed, IsLeftOut) {
  Random random(10);
  std::string text = "time (s),thrust (N),rpm\n";
  for (int i = 0; i < 300; ++i) {
    const double rpm = 3000 + 20.0 * i;
    text += fmt::format("{},{:.5f},{:.2f}\n", 0.1 * i, newtons(rpm) + 0.002 * random.normal(),
                        i >= 200 && i < 260 ? 7000.0 : rpm + random.normal());
  }
  const Outcome outcome = outcome_of(text);
  EXPECT_THAT(outcome.said, HasSubstr("speed_frozen: the same speed row after row while the thrust changes"));
  ASSERT_TRUE(outcome.leaves_with_0()) << outcome.said << outcome.refused;
  EXPECT_NEAR(outcome.k[0] / kK, 1, 0.01);
}

TEST(DoubledSpeed, IsLeftOut) {
  std::string text = "thrust (N),rpm\n";
  for (int i = 0; i < 60; ++i) {
    const double rpm = 3000 + 100.0 * i;
    text += fmt::format("{:.5f},{:.1f}\n", newtons(rpm) * (1 + 0.002 * (i % 3)),
                        i % 12 == 5 ? 2 * rpm
                        : i == 33   ? rpm / 2
                                    : rpm);
  }
  const Outcome outcome = outcome_of(text);
  EXPECT_THAT(outcome.said, HasSubstr("speed_doubled"));
  ASSERT_TRUE(outcome.leaves_with_0()) << outcome.said << outcome.refused;
  EXPECT_NEAR(outcome.k[0] / kK, 1, 0.01);
}

TEST(Glitch, AmongFewRowsIsLeftOut) {
  for (const double factor : {0.5, 0.8, 1.3, 3.0}) {
    std::string text = "thrust (N),rpm\n";
    for (int i = 0; i < 11; ++i) {
      const double rpm = 3000 + 1300.0 * i;
      text += fmt::format("{:.5f},{:.1f}\n", newtons(rpm, kK * (1 + 0.015 * i)) * (i == 9 ? factor : 1), rpm);
    }
    const Outcome outcome = outcome_of(text);
    EXPECT_THAT(outcome.said, HasSubstr("row_unlike")) << factor;
    ASSERT_TRUE(outcome.leaves_with_0()) << outcome.said << outcome.refused;
    EXPECT_NEAR(outcome.k[0] / (1.13 * kK), 1, 0.04) << factor;
  }
}

TEST(PoleCount, IsJudgedOnLiveRows) {
  std::string text = "Thrust (N),Motor Electrical Speed (RPM),Motor Optical Speed (RPM)\n";
  for (int i = 0; i < 40; ++i) {
    const double rpm = 3000 + 200.0 * i;
    text += fmt::format("{:.5f},{:.1f},{:.1f}\n", newtons(rpm), rpm, i < 15 ? rpm * 1.0005 : 6000.0);
  }
  EXPECT_EQ(outcome_of(text).refused.find("poles"), std::string::npos) << "the optical sensor froze";
  expect_no_wrong_k(text, kK, "frozen optical speed");
}

/// Noise, zero, sign, speeds and rest rows at random: nothing more than 5 % wrong leaves with exit 0.
TEST(AnyLog, OfAPropellerLeavesNoWrongKWithExit0) {
  const char* const more = std::getenv("KPHI_LOGS");
  const std::uint64_t count = more == nullptr ? 300 : std::strtoull(more, nullptr, 10);
  for (std::uint64_t seed = 1; seed <= count; ++seed) {
    Random random(seed);
    const double zero = 8 * (share_of(random) - 0.5), noise = std::pow(10, -3 + 2.5 * share_of(random));
    const double low = 500 + 5000 * share_of(random), high = low + 300 + 8000 * share_of(random);
    const int rest = share_of(random) < 0.5 ? 0 : 30;
    expect_no_wrong_k(ramp(zero, share_of(random) < 0.3 ? -1 : 1, noise, seed, rest, low, high), kK,
                      fmt::format("seed {}: zero {:.2f} N, noise {:.3f} N, {:.0f} to {:.0f} RPM, {} rest rows", seed,
                                  zero, noise, low, high, rest)
                          .c_str());
  }
}

}  // namespace log_defects_test
}  // namespace kphi::fit
