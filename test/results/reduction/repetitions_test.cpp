#include "results/reduction/repetitions.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <functional>

#include "base/random.hpp"
#include "compensation/units.hpp"
#include "results/steps_csv.hpp"
#include "test/results/synthetic_run.hpp"

namespace kphi::results::repetitions_test {
using namespace testing;

using test::k_of;

/// Deviation of the weighted mean of a walk between two zeros about the line through them, and what SharedZero says.
struct OfAWalk {
  double found = 0, said = 0;
};

OfAWalk of_a_walk(const std::function<double(int step)>& weight, std::uint64_t seed) {
  constexpr int kSteps = 40, kPieces = 10, kDraws = 4000;
  Random random(seed);
  SharedZero zero;
  double weights = 0, squares = 0;
  for (int i = 0; i < kSteps; ++i) {
    zero.add(kNotMeasured, i, i + 1, weight(i));
    weights += weight(i);
  }
  for (int draw = 0; draw < kDraws; ++draw) {
    std::vector<double> walk{0};
    for (int i = 0; i < kSteps * kPieces; ++i)
      walk.push_back(walk.back() + random.normal() / std::sqrt(kSteps * kPieces));
    double error = 0;
    for (int i = 0; i < kSteps; ++i) {
      const int middle = i * kPieces + kPieces / 2;
      error +=
          weight(i) / weights * (walk[static_cast<std::size_t>(middle)] - walk.back() * middle / (kSteps * kPieces));
    }
    squares += error * error / kDraws;
  }
  return {std::sqrt(squares), zero.u_n(1)};
}

TEST(SharedZero, OfAWalkIsAsUncertainAsTheWalkMakesIt) {
  const OfAWalk even = of_a_walk([](int) { return 1.0; }, 1), rising = of_a_walk([](int i) { return i * i; }, 2);
  EXPECT_NEAR(even.said, even.found, 0.05 * even.found);
  EXPECT_NEAR(rising.said, rising.found, 0.05 * rising.found);
  EXPECT_NEAR(even.said, 1 / std::sqrt(12), 0.01);
  EXPECT_NEAR(rising.said, 0.283, 0.002) << "of ω² over rising speeds: no less than of even weights";
  const OfAWalk last = of_a_walk([](int i) { return i == 39 ? 1.0 : 0; }, 3),
                middle = of_a_walk([](int i) { return i == 20 ? 1.0 : 0; }, 4);
  EXPECT_NEAR(last.said, 0.11, 0.01) << "beside the zero behind the run";
  EXPECT_NEAR(middle.said, 0.5, 0.01);
  EXPECT_NEAR(middle.said, middle.found, 0.05 * middle.found);
}

TEST(SharedZero, WithoutTimesIsThatOfARectangleAndAddsWhatWasMeasured) {
  SharedZero zero;
  for (int i = 0; i < 10; ++i) zero.add(0.003, 0, 0, 1);
  EXPECT_NEAR(zero.u_n(0), 0.003, 1e-12);
  EXPECT_NEAR(zero.u_n(0.012), std::hypot(0.003, 0.012 / std::sqrt(12)), 1e-12);
  EXPECT_EQ(SharedZero().u_n(1), 0);
}

TEST(Repetitions, AverageSoThatThrustOverSpeedSquaredStaysTheCoefficient) {
  std::vector<StepMean> steps;
  for (int rep = 1; rep <= 3; ++rep) {
    StepMean s;
    s.propeller = "5x3";
    s.occlusion_deg = 90;
    s.repetition = rep;
    s.speed_rad_s = 900 + 50 * rep;
    s.thrust_n = 1.3e-6 * s.speed_rad_s * s.speed_rad_s;
    s.thrust_samples = 100;
    s.quality_flags = static_cast<std::uint32_t>(rep == 2 ? QualityFlag::coil_hot : QualityFlag::none);
    s.supply_current_a = rep == 1 ? std::nan("") : 2.0 * rep;
    s.thrust_u_n = 0.003;
    s.thrust_freedom = 20;
    s.speed_glitches = 1;
    steps.push_back(s);
  }
  const auto mean = means_of(steps);
  ASSERT_EQ(mean.size(), 1u);
  EXPECT_EQ(mean[0].repetition, 0);
  EXPECT_NEAR(k_of(mean[0]), 1.3e-6, 1e-18);
  EXPECT_EQ(mean[0].thrust_samples, 300u);
  EXPECT_EQ(mean[0].supply_current_a, 5.0);
  EXPECT_NEAR(mean[0].thrust_u_n, 0.003 / std::sqrt(3.0), 1e-12);
  EXPECT_NEAR(mean[0].thrust_freedom, 60, 1e-9);
  EXPECT_EQ(mean[0].speed_glitches, 3u);
  EXPECT_EQ(quality_flag_names(mean[0].quality_flags), "coil_hot");
  steps[0].thrust_u_n = 0.009;
  EXPECT_NEAR(means_of(steps)[0].thrust_freedom, 20 * 11 * 11 / 83.0, 1e-9) << "Welch-Satterthwaite";
}

TEST(Repetitions, AreGroupedByPropellerOcclusionAndStep) {
  std::vector<StepMean> steps;
  for (const char* propeller : {"b", "a"}) {
    for (const double phi : {90.0, 0.0}) {
      for (int rep = 1; rep <= 2; ++rep) {
        for (int step = 0; step < 3; ++step) {
          StepMean s;
          s.propeller = propeller;
          s.occlusion_deg = phi;
          s.repetition = rep;
          s.step = step;
          s.thrust_n = rep;
          steps.push_back(s);
        }
      }
    }
  }
  const auto means = means_of(steps);
  ASSERT_EQ(means.size(), 12u);
  EXPECT_EQ(means[0].propeller, "b");
  EXPECT_EQ(means[3].occlusion_deg, 0);
  for (const StepMean& mean : means) EXPECT_EQ(mean.thrust_n, 1.5);
}

constexpr double kThrustU = 0.002;

/// Runs of 20 steps; run i has the coefficient 1.5e-6 · (1 + off[i]).
std::vector<StepMean> runs(const std::vector<double>& off, unsigned seed = 1) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, kThrustU);
  std::vector<StepMean> steps;
  for (std::size_t run = 0; run < off.size(); ++run) {
    for (int i = 0; i < 20; ++i) {
      StepMean s;
      s.propeller = "5x3";
      s.repetition = static_cast<int>(run) + 1;
      s.step = i;
      s.speed_rad_s = 200 + 90.0 * i;
      s.thrust_n = 1.5e-6 * (1 + off[run]) * s.speed_rad_s * s.speed_rad_s + noise(random);
      s.thrust_u_n = kThrustU;
      s.thrust_freedom = 30;
      s.zero_u_n = 0;
      steps.push_back(s);
    }
  }
  return steps;
}

RepetitionVerdict judged(const std::vector<StepMean>& steps, const RepetitionRule& rule = {}) {
  const auto verdicts = judge_repetitions(steps, rule);
  EXPECT_EQ(verdicts.size(), 1u);
  return verdicts.at(0);
}

TEST(JudgeRepetitions, IsContentWithThreeThatAgree) {
  int large = 0;
  for (unsigned seed = 1; seed <= 200; ++seed) {
    const auto verdict = judged(runs({0, 0, 0}, seed));
    EXPECT_FALSE(verdict.asks_for_another) << seed << ": " << verdict.reason;
    EXPECT_NEAR(verdict.k, 1.5e-6, 1.5e-6 * 0.001);
    large += verdict.p < 0.05;
  }
  EXPECT_LE(large, 22) << "one in twenty by chance";
  EXPECT_GE(large, 2);
}

TEST(JudgeRepetitions, TellsTheSpreadBetweenFromTheSpreadWithin) {
  const auto verdict = judged(runs({-0.004, 0, 0.004}));
  EXPECT_NEAR(verdict.between_sd, 0.004 * 1.5e-6, 0.0005 * 1.5e-6);
  EXPECT_LT(verdict.within_u, 0.0005 * 1.5e-6);
  EXPECT_GT(verdict.f, 30);
  EXPECT_LT(verdict.p, 0.001);
  EXPECT_FALSE(verdict.asks_for_another) << "0.8 % from end to end is what mounting and air do";
}

TEST(JudgeRepetitions, AsksForAnotherWhenOneOfThreeStandsOutAndKeepsIt) {
  const auto verdict = judged(runs({0, 0.03, 0.0005}));
  EXPECT_TRUE(verdict.asks_for_another);
  EXPECT_THAT(verdict.reason, HasSubstr("repetition 2"));
  ASSERT_EQ(verdict.repetitions.size(), 3u);
  EXPECT_TRUE(verdict.repetitions[1].outlying);
  EXPECT_NEAR(verdict.repetitions[1].k, 1.03 * 1.5e-6, 0.001 * 1.5e-6);
  EXPECT_FALSE(verdict.repetitions[0].outlying);

  const auto after = judged(runs({0, 0.03, 0.0005, -0.0003}));
  EXPECT_FALSE(after.asks_for_another) << "three are good now";
  EXPECT_TRUE(after.repetitions[1].outlying) << "and the failed one is still there";
  EXPECT_THAT(after.reason, HasSubstr("repetition 2"));
}

TEST(MeansOf, KeepWhatIsFarFromTheOthers) {
  const auto steps = runs({0, 0.03, 0.0005});
  ASSERT_TRUE(judged(steps).repetitions[1].outlying);
  const StepMean mean = means_of(steps).at(7);
  EXPECT_NEAR(mean.thrust_n, (steps[7].thrust_n + steps[27].thrust_n + steps[47].thrust_n) / 3, 1e-12);
  EXPECT_TRUE(std::isnan(mean.repetitions_averaged));
}

TEST(MeansOf, LeaveOutAFlaggedStepWhenAnotherRepetitionIsGoodAndSaySo) {
  auto steps = runs({0, 0.001});
  for (auto& step : steps)
    if (step.repetition == 2)
      step.quality_flags =
          static_cast<std::uint32_t>(step.step < 10 ? QualityFlag::zero_drifted : QualityFlag::coil_hot);
  const auto means = means_of(steps);
  EXPECT_EQ(means.at(5).thrust_n, steps.at(5).thrust_n);
  EXPECT_EQ(means.at(5).quality_flags, 0u);
  EXPECT_EQ(means.at(5).repetitions_averaged, 1);
  EXPECT_EQ(means.at(5).repetitions_left_out, 1);
  EXPECT_NEAR(means.at(15).thrust_n, 0.5 * (steps.at(15).thrust_n + steps.at(35).thrust_n), 1e-12) << "hot is harmless";
  const auto again = parse_steps(format_steps(means), "means.csv");
  EXPECT_EQ(again.at(3).repetitions_left_out, 1);
  EXPECT_TRUE(std::isnan(again.at(15).repetitions_left_out));
  for (auto& step : steps) step.quality_flags = static_cast<std::uint32_t>(QualityFlag::zero_drifted);
  EXPECT_NEAR(means_of(steps).at(5).thrust_n, 0.5 * (steps.at(5).thrust_n + steps.at(25).thrust_n), 1e-12)
      << "all are flagged: better that than nothing";
}

TEST(JudgeRepetitions, AsksForAnotherWhenNoneAgreesButNotForEver) {
  EXPECT_TRUE(judged(runs({-0.03, 0, 0.03})).asks_for_another);
  EXPECT_THAT(judged(runs({-0.03, 0, 0.03})).reason, HasSubstr("none stands out"));
  EXPECT_FALSE(judged(runs({-0.06, -0.03, 0, 0.03, 0.06})).asks_for_another);
}

TEST(JudgeRepetitions, AsksForAnotherWhenOneHasTooManyFlaggedSteps) {
  auto steps = runs({0, 0, 0});
  for (auto& step : steps) {
    if (step.repetition == 3 && step.step < 11) step.quality_flags = static_cast<std::uint32_t>(QualityFlag::unsettled);
  }
  const auto verdict = judged(steps);
  EXPECT_TRUE(verdict.asks_for_another);
  EXPECT_FALSE(verdict.repetitions[2].usable);
  for (auto& step : steps) step.quality_flags = static_cast<std::uint32_t>(QualityFlag::coil_hot);
  EXPECT_FALSE(judged(steps).asks_for_another) << "a hot coil changes no coefficient";
}

TEST(JudgeRepetitions, ComparesOnlyLevelsThatAllHave) {
  auto steps = runs({0, 0, 0});
  for (auto& step : steps) {
    // k rises with speed; one run lacks its fast steps.
    step.thrust_n *= 1 + 1e-4 * step.speed_rad_s;
    if (step.repetition == 2 && step.step > 12) step.quality_flags = static_cast<std::uint32_t>(QualityFlag::derated);
  }
  EXPECT_FALSE(judged(steps).repetitions[1].outlying);
}

/// `off` at occlusion 0, and four occlusions more whose runs scatter by `scatter`.
std::vector<StepMean> campaign(const std::vector<double>& off, double scatter, unsigned seed = 1) {
  std::mt19937 random(100 + seed);
  std::normal_distribution<double> normal(0, scatter);
  std::vector<StepMean> steps = runs(off, seed);
  for (const double phi : {45.0, 90.0, 180.0, 270.0}) {
    for (StepMean step : runs({normal(random), normal(random), normal(random)}, seed + static_cast<unsigned>(phi))) {
      step.occlusion_deg = phi;
      steps.push_back(step);
    }
  }
  return steps;
}

TEST(JudgeRepetitions, LearnsFromTheOtherOcclusionsHowMuchRunsScatter) {
  EXPECT_TRUE(judged(runs({0, 0.0001, 0.006})).repetitions[2].outlying) << "alone: two that agree make the third odd";
  for (const auto& verdict : judge_repetitions(campaign({0, 0.0001, 0.006}, 0.003)))
    for (const RepetitionFigure& run : verdict.repetitions) EXPECT_FALSE(run.outlying) << run.p;
  const auto verdicts = judge_repetitions(campaign({0, 0.0001, 0.03}, 0.003));
  EXPECT_TRUE(verdicts.at(0).repetitions[2].outlying);
  EXPECT_NEAR(verdicts.at(0).repetitions[2].away, 0.03, 0.001);
  EXPECT_LT(verdicts.at(0).repetitions[2].p, 0.01);
  EXPECT_THAT(verdicts.at(0).reason, HasSubstr("repetition 3 gives a k that is +3.0"));
}

/// The zero of each run jumps once, at any step, by `jump_n` standard; the line between the two zeros misses the jump.
void let_zeros_jump(std::vector<StepMean>& steps, double jump_n, std::mt19937& random) {
  std::normal_distribution<double> normal(0, jump_n);
  std::uniform_real_distribution<double> uniform;
  for (std::size_t first = 0; first < steps.size(); first += 20) {
    const double moved = normal(random), jump = uniform(random);
    for (std::size_t i = 0; i < 20; ++i) {
      const double part = (static_cast<double>(i) + 0.5) / 20;
      steps[first + i].zero_n = 0.3 + moved * part;
      steps[first + i].thrust_n += moved * ((part > jump ? 1.0 : 0.0) - part);
    }
  }
}

TEST(JudgeRepetitions, CallsARunOutlyingByChanceInOneCampaignOfTwenty) {
  for (const double jump_n : {0.0, 0.05}) {
    int called = 0;
    for (unsigned seed = 1; seed <= 200; ++seed) {
      std::mt19937 random(seed);
      std::normal_distribution<double> normal(0, 0.003);
      auto steps = campaign({normal(random), normal(random), normal(random)}, 0.003, seed);
      let_zeros_jump(steps, jump_n, random);
      bool any = false;
      for (const auto& verdict : judge_repetitions(steps))
        for (const RepetitionFigure& run : verdict.repetitions) any = any || run.outlying;
      called += any;
    }
    EXPECT_GE(called, jump_n > 0 ? 0 : 2) << "a jump is off by half of it at most: it hardly goes beyond its own error";
    EXPECT_LE(called, 18) << jump_n;
  }
}

TEST(JudgeRepetitions, CountsHowFarZerosUsuallyMoveOverGoodSteps) {
  auto steps = runs({0, 0});
  const double quiet = judged(steps).repetitions[0].u;
  for (auto& step : steps) step.zero_n = 0.3 + (step.repetition == 1 ? 0.01 * step.step / 19.0 : 0.0);
  double x = 0, xx = 0;
  for (const auto& step : runs({0})) x += std::pow(step.speed_rad_s, 2), xx += std::pow(step.speed_rad_s, 4);
  const double usual = 0.01 / std::sqrt(2.0);
  const auto u_by = [&](double own) {
    return std::hypot(quiet, std::hypot(usual, own) / std::sqrt(2.0) / std::sqrt(12.0) * x / xx);
  };
  EXPECT_NEAR(judged(steps).repetitions[0].u, u_by(0.01), 1e-15);
  EXPECT_NEAR(judged(steps).repetitions[1].u, u_by(0), 1e-15) << "the zero may have come back by chance";
  steps[0].zero_n = 5;
  steps[0].quality_flags = static_cast<std::uint32_t>(QualityFlag::rebooted);
  EXPECT_LT(judged(steps).repetitions[0].u, 1.01 * u_by(0.01));
}

TEST(JudgeRepetitions, NeverCallsAThousandthOutlying) {
  for (const auto& verdict : judge_repetitions(campaign({0, 0, 0.002}, 0.00001)))
    for (const RepetitionFigure& run : verdict.repetitions) EXPECT_FALSE(run.outlying);
}

TEST(VarianceBetween, IsWhatTheRunsScatterBeyondTheirOwnVariance) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  std::vector<std::vector<RunShare>> occlusions(300);
  for (auto& occlusion : occlusions)
    for (int run = 0; run < 3; ++run) occlusion.push_back({1 + 0.005 * normal(random), 0.003 * 0.003});
  EXPECT_NEAR(std::sqrt(variance_between(occlusions)), 0.004, 0.0003);
  EXPECT_EQ(freedom_between(occlusions), 600);
  for (auto& occlusion : occlusions)
    for (RunShare& run : occlusion) run.variance = 1e-4;
  EXPECT_EQ(variance_between(occlusions), 0);
}

TEST(JudgeRepetitions, WaitsUntilTheWantedOnesAreThere) {
  EXPECT_FALSE(judged(runs({0})).asks_for_another);
  EXPECT_FALSE(judged(runs({0, 0.05})).asks_for_another);
  EXPECT_FALSE(judged(runs({0}), {.wanted = 1}).asks_for_another);
}

/// Reference runs -1, -2, …, in air of density[i] if given.
std::vector<StepMean> reference_runs(const std::vector<double>& off, const std::vector<double>& density = {}) {
  auto steps = runs(off);
  for (StepMean& step : steps) {
    if (!density.empty()) step.air_density_kg_m3 = density[static_cast<std::size_t>(step.repetition - 1)];
    step.repetition = -step.repetition;
  }
  return steps;
}

TEST(ReferenceDrift, IsSeenFromTheFirstRunToTheLast) {
  const auto drift = reference_drift(reference_runs({0, 0.5, -0.02}));
  ASSERT_TRUE(drift);
  EXPECT_NEAR(drift->share, -0.02, 4 * drift->u_share);
  EXPECT_LT(drift->u_share, 0.002);
  EXPECT_TRUE(drift->drifted());
  EXPECT_THAT(drift->to_words(), testing::HasSubstr("the bench has drifted"));
}

TEST(ReferenceDrift, IsNoneWithinHalfAPercentOrItsUncertainty) {
  const auto drift = reference_drift(reference_runs({0, 0.003}));
  ASSERT_TRUE(drift);
  EXPECT_FALSE(drift->drifted());
  EXPECT_GT(drift->share, 2 * drift->u_share) << "significant, but small";
  EXPECT_THAT(drift->to_words(), testing::EndsWith(" %"));
}

TEST(ReferenceDrift, IsHeldAgainstTheAirWhereItIsKnownOfBothRuns) {
  const auto thinner = reference_drift(reference_runs({0, -0.03}, {1.2, 1.2 * 0.97}));
  ASSERT_TRUE(thinner && thinner->same_air);
  EXPECT_FALSE(thinner->drifted()) << thinner->to_words();
  EXPECT_FALSE(reference_drift(reference_runs({0, -0.03}, {1.2, std::nan("")}))->same_air);
  EXPECT_TRUE(reference_drift(reference_runs({0, -0.03}))->drifted());
}

TEST(ReferenceDrift, IsUnknownWithoutTwoGoodRuns) {
  EXPECT_FALSE(reference_drift(reference_runs({0})));
  EXPECT_FALSE(reference_drift({}));
  auto steps = reference_runs({0, 0.02});
  for (StepMean& step : steps) {
    if (step.repetition == -2) step.quality_flags = static_cast<std::uint32_t>(QualityFlag::zero_drifted);
  }
  EXPECT_FALSE(reference_drift(steps));
}

constexpr double kK = 1.3e-6;
constexpr double kU = 0.002;
constexpr int kLevels = 20;

/// Up and down over 20 levels; rising, k is larger by `share`.
std::vector<StepMean> up_and_down(double share, unsigned seed = 1, bool begins_low = true) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, kU), speed(0, 1);
  std::vector<StepMean> steps;
  for (int i = 0; i < 2 * kLevels - 1; ++i) {
    const int config = i < kLevels ? i : 2 * kLevels - 2 - i;
    const int level = begins_low ? config : kLevels - 1 - config;
    const bool rises = (i < kLevels) == begins_low;
    StepMean s;
    s.step = i;
    s.commanded_speed_rad_s = 200 + 90.0 * level;
    s.speed_rad_s = s.commanded_speed_rad_s + speed(random);
    s.thrust_n = kK * (rises ? 1 + share : 1) * s.speed_rad_s * s.speed_rad_s + noise(random);
    s.thrust_u_n = kU;
    s.zero_u_n = 0;
    steps.push_back(s);
  }
  return steps;
}

TEST(Hysteresis, IsFoundWithItsSizeAndUncertainty) {
  const auto found = hysteresis_of(up_and_down(0.01));
  ASSERT_TRUE(found);
  EXPECT_EQ(found->speeds.size(), kLevels - 1u) << "the turning point was held once";
  EXPECT_NEAR(found->share, 0.01, 3 * found->u_share);
  EXPECT_LT(found->u_share, 0.001);
  EXPECT_TRUE(found->significant());
  const auto& fastest = found->speeds.back();
  EXPECT_NEAR(fastest.up_minus_down_n, 0.01 * kK * fastest.speed_rad_s * fastest.speed_rad_s, 4 * fastest.u_n);
  EXPECT_NEAR(fastest.u_n, kU * std::sqrt(2.0), 1e-5);
  auto steps = up_and_down(0);
  for (StepMean& step : steps) step.speed_u_rad_s = 1e-3 * step.speed_rad_s, step.thrust_u_n = 0;
  const auto of_speed = hysteresis_of(steps)->speeds.front();
  EXPECT_NEAR(of_speed.u_n / (2e-3 * std::sqrt(2.0) * kK * std::pow(of_speed.speed_rad_s, 2)), 1, 0.1) << "2 u(w)/w";
}

TEST(Hysteresis, IsNotSeenWhereThereIsNoneAndItsUncertaintyIsHonest) {
  int beyond = 0;
  for (unsigned seed = 1; seed <= 400; ++seed) beyond += hysteresis_of(up_and_down(0, seed))->significant();
  EXPECT_GE(beyond, 7) << "4.6 % of 400 by chance";
  EXPECT_LE(beyond, 32);
}

TEST(Hysteresis, IsCountedUpMinusDownAlsoWhenAProfileBeginsAtItsTop) {
  EXPECT_NEAR(hysteresis_of(up_and_down(0.01, 1, false))->share, 0.01, 0.002);
}

TEST(Hysteresis, LeavesOutFlaggedSteps) {
  auto steps = up_and_down(0);
  steps[3].thrust_n = 1e3;
  steps[3].quality_flags = static_cast<std::uint32_t>(QualityFlag::unsettled);
  const auto found = hysteresis_of(steps);
  EXPECT_EQ(found->speeds.size(), kLevels - 2u);
  EXPECT_LT(std::abs(found->share), 0.002);
}

TEST(Hysteresis, IsUnknownWithoutAWayBack) {
  auto steps = up_and_down(0);
  steps.resize(kLevels);
  EXPECT_FALSE(hysteresis_of(steps));
  EXPECT_FALSE(hysteresis_of({}));
}

TEST(Hysteresis, IsToldInOneLine) {
  EXPECT_THAT(
      hysteresis_of(up_and_down(0.01))->to_words(),
      testing::MatchesRegex("thrust going up minus going down: \\+[01]\\.[0-9]+ ± 0\\.[0-9]+ % of k; at most "
                            "\\+0\\.[0-9]+ ± 0\\.[0-9]+ N at [0-9]+ RPM; [0-9]+ of 19 speeds beyond twice their "
                            "uncertainty"));
  EXPECT_THAT(hysteresis_of(up_and_down(0, 2))->to_words(), testing::HasSubstr("no hysteresis seen"));
}

}  // namespace kphi::results::repetitions_test
