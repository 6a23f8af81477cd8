#include "compensation/flight/verdict.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "test/compensation/flight/flight_fixture.hpp"

namespace kphi::flight {
namespace verdict_test {

using testing::HasSubstr;
using testing::SizeIs;

#ifdef KPHI_SANITIZED
constexpr std::size_t kDraws = 9;  // ten times as slow
#else
constexpr std::size_t kDraws = 24;
#endif

/// The bench's line with another K_T, and another fall of k(φ)/K_T.
compensation::ThrustCurve wrong(double k_t, double fall) {
  const compensation::ThrustCurve right = bench_line();
  const compensation::Line line = compensation::line_of(right);
  return *compensation::ThrustCurve::from_line(right.thrust_coefficient() * k_t, line.intercept * k_t,
                                               line.slope_per_rad * k_t * fall, right.largest_fitted());
}

struct Judged {
  Findings findings;
  Judgement judgement;
};

Judged judged(const compensation::ThrustCurve& curve, const Rotors<std::size_t>& wiring = {0, 1, 2, 3}) {
  Scene scene = example_scene();
  scene.curves = four(curve);
  scene.truth.wiring = wiring;
  const Findings findings = findings_of(fly_draws(scene, example_shadow(), kDraws, 2));
  return {findings, judgement_of(findings)};
}

TEST(Verdict, OfTheRightCoefficientsIsFitToFly) {
  const auto [findings, judgement] = judged(bench_line());
  EXPECT_EQ(judgement.fitness, Fitness::fit_to_fly) << words_of(judgement, findings);
  EXPECT_THAT(words_of(judgement, findings), HasSubstr(fmt::format("lost in 0 of {} draws with compensation", kDraws)));
}

TEST(Verdict, OfAThrustCoefficientThatIsWrongByTwoIsThatItLosesTheVehicle) {
  for (const double factor : {0.5, 2.0}) {
    const auto [findings, judgement] = judged(wrong(factor, 1));
    EXPECT_EQ(judgement.fitness, Fitness::loses_the_vehicle) << factor;
    EXPECT_GT(findings.lost_compensated, kDraws - 3);
    EXPECT_THAT(words_of(judgement, findings),
                HasSubstr(fmt::format(" of {} draws, with compensation or in X", kDraws)));
  }
}

TEST(Verdict, OfAThrustCoefficientThatIsALittleWrongNamesItAndItsSign) {
  EXPECT_THAT(judged(wrong(1.15, 1)).judgement.doubts[0], HasSubstr("K_T of the file is too large"));
  EXPECT_THAT(judged(wrong(0.87, 1)).judgement.doubts[0], HasSubstr("K_T of the file is too small"));
}

TEST(Verdict, OfALineThatFallsTooSteeplyTooLittleOrRisesSaysSo) {
  EXPECT_THAT(judged(wrong(1, 2)).judgement.doubts, testing::Contains(HasSubstr("over-compensates")));
  for (const double fall : {0.0, -1.0})
    EXPECT_THAT(judged(wrong(1, fall)).judgement.doubts, testing::Contains(HasSubstr("does not help"))) << fall;
}

TEST(Verdict, SaysWhatItIsBlindTo) {
  const Scene scene = example_scene();
  const BlindZone blind = blind_zone_of(scene, example_shadow());
  const auto verdict_of = [&](double fall, double k_t) {
    Scene changed = scene;
    changed.curves = four(*bench_line().perturbed(ThrustCoefficient(0), fall));
    changed.truth.thrust_coefficient = scene.truth.thrust_coefficient / k_t;
    return judgement_of(findings_of({{changed, fly_all(changed, example_shadow())}})).fitness;
  };
  EXPECT_LT(blind.least_fall, 1);
  EXPECT_GT(blind.most_fall, 1.2) << "a fall half as steep again passes";
  EXPECT_LT(blind.most_fall, 3);
  EXPECT_GT(blind.least_k_t, 0.8);
  EXPECT_LT(blind.most_k_t, 1.2);
  for (const auto& [fall, k_t] :
       {std::pair{blind.least_fall, 1.0}, {blind.most_fall, 1.0}, {1.0, blind.least_k_t}, {1.0, blind.most_k_t}})
    EXPECT_EQ(verdict_of(fall, k_t), Fitness::fit_to_fly) << fall << " " << k_t;
  for (const auto& [fall, k_t] : {std::pair{0.0, 1.0}, {3.0, 1.0}, {1.0, 0.8}, {1.0, 1.2}})
    EXPECT_NE(verdict_of(fall, k_t), Fitness::fit_to_fly) << fall << " " << k_t;
  EXPECT_THAT(words_of(blind, true), HasSubstr(fmt::format("{:g} to {:g} times", blind.least_fall, blind.most_fall)));
  EXPECT_THAT(words_of(blind, false), HasSubstr("the air has that of the file"));
}

TEST(Verdict, OfArmsThatAreWiredCrosswiseIsNotFitToFly) {
  EXPECT_NE(judged(bench_line(), {2, 1, 0, 3}).judgement.fitness, Fitness::fit_to_fly);
}

TEST(Verdict, OfOneSetOfCircumstancesSaysThatThereAreMore) {
  const Findings findings = findings_of({{clean_scene(), fly_all(clean_scene(), example_shadow())}});
  EXPECT_THAT(words_of(judgement_of(findings), findings), HasSubstr("--draws 300"));
}

}  // namespace verdict_test
}  // namespace kphi::flight
