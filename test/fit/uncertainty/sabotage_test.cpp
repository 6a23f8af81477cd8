// What people do to a campaign: one mistake each, on top of everything that goes wrong on a bench anyway. What its
// steps can tell must be stopped or named with its cause; what they cannot is listed here, too.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <vector>

#include "base/error.hpp"
#include "test/fit/bench_study.hpp"

namespace kphi::fit {
namespace sabotage_test {

using results::StepMean;

constexpr double kGravity = 9.80665;

struct Mistake {
  const char* name;
  std::function<void(StepMean&)> make;
  /// Of the words that name it any one is enough; none: the steps cannot tell.
  std::vector<std::string> named_as;
};

std::function<void(StepMean&)> thrust_times(double factor) {
  return [factor](StepMean& step) { step.thrust_n *= factor; };
}

std::function<void(StepMean&)> speed_times(double factor) {
  return [factor](StepMean& step) {
    step.speed_rad_s *= factor;
    step.commanded_speed_rad_s *= factor;
  };
}

std::function<void(StepMean&)> exchanged(double a, double b) {
  return [a, b](StepMean& step) {
    if (step.occlusion_deg == a || step.occlusion_deg == b) step.occlusion_deg = a + b - step.occlusion_deg;
  };
}

double shaft_power_w(const StepMean& step) { return std::abs(step.torque_nm) * step.speed_rad_s; }

/// As if the plate `on` was there instead of that of `named`; in one repetition or (0) in all.
std::function<void(StepMean&)> instead(double named, double on, int repetition = 0) {
  const StudyTruth truth = without_kink();
  return [=](StepMean& step) {
    if (step.occlusion_deg == named && (repetition == 0 || step.repetition == repetition))
      step.thrust_n *= truth.k(on) / truth.k(named);
  };
}

const std::vector<Mistake>& mistakes() {
  static const std::vector<std::string> kUnit{"C_T", "ideal disk", "do not belong together", "the shaft gives"};
  static const std::vector<std::string> kPlate{"a larger occlusion", "is not a line", "plate", "k hardly falls"};
  static const std::vector<Mistake> all{
      {"thrust in gram-force", thrust_times(1000 / kGravity), kUnit},
      {"thrust in kilogram-force", thrust_times(1 / kGravity), kUnit},
      {"thrust in pound-force", thrust_times(1 / 4.44822), kUnit},
      {"thrust in ounce-force", thrust_times(1 / 0.278014), kUnit},
      {"thrust in millinewton", thrust_times(1000), kUnit},
      {"thrust of four rotors", thrust_times(4), kUnit},
      {"sign of the thrust", thrust_times(-1), {"must be positive"}},
      {"another axis", thrust_times(0.02), kUnit},
      {"speed in RPM", speed_times(9.5493), kUnit},
      {"electrical speed, seven pole pairs", speed_times(7), kUnit},
      {"speed of a gear of two", speed_times(0.5), kUnit},
      {"torque in newton centimetre", [](StepMean& step) { step.torque_nm *= 100; }, kUnit},
      {"a tenth of the torque", [](StepMean& step) { step.torque_nm *= 0.1; }, kUnit},
      {"density with hectopascal for pascal", [](StepMean& step) { step.air_density_kg_m3 *= 0.01; }, kUnit},
      {"occlusions in radians", [](StepMean& step) { step.occlusion_deg *= kPi / 180; }, {"radians"}},
      {"plates of 45° and 90° exchanged", exchanged(45, 90), kPlate},
      {"plates of 90° and 180° exchanged", exchanged(90, 180), kPlate},
      {"plates of 180° and 270° exchanged", exchanged(180, 270), kPlate},
      {"the plate of 45° left on at 0°", instead(0, 45), kPlate},
      {"the plate of 90° left on at 0°", instead(0, 90), kPlate},
      {"no plate at 45°", instead(45, 0), kPlate},
      {"no plate at 90°", instead(90, 0), kPlate},
      {"the plate of 90° at 180°", instead(180, 90), kPlate},
      {"no plate in one run at 90°", instead(90, 0, 2), {"repetition 2 at 90° is"}},
      {"a plate slipped by 15° in one run", instead(180, 165, 3), {"repetition 3 at 180° is"}},
      {"a 6-inch propeller in one run",
       [](StepMean& step) {
         if (step.occlusion_deg == 45 && step.repetition == 1) step.thrust_n *= 2;
       },
       {"repetition 1 at 45° is"}},
      {"the zero of one run is of another day",
       [](StepMean& step) {
         if (step.occlusion_deg == 0 && step.repetition == 3) step.thrust_n += 0.5;
       },
       {"repetition 3 at 0° is", "k falls with speed", "k rises with speed"}},
      {"no zero was taken", [](StepMean& step) { step.thrust_n += 0.5; }, {"k falls with speed"}},
      {"a current shunt of a tenth",
       [](StepMean& step) {
         step.supply_voltage_v = 12;
         step.supply_current_a = 0.1 * shaft_power_w(step) / 12 / 0.7;
       },
       kUnit},
      {"one run of a cell with another calibration",
       [](StepMean& step) {
         if (step.occlusion_deg == 90 && step.repetition == 2) step.thrust_n *= 1.05;
       },
       {"repetition 2 at 90° is"}},
      {"the runs of one occlusion from another propeller",
       [](StepMean& step) {
         if (step.occlusion_deg == 180) step.thrust_n *= 1.6;
       },
       kPlate},
      {"one run with seven for six pole pairs",
       [](StepMean& step) {
         if (step.occlusion_deg != 0 || step.repetition != 1) return;
         step.speed_rad_s *= 7.0 / 6;
         step.commanded_speed_rad_s *= 7.0 / 6;
       },
       {"repetition 1 at 0° is"}},
      {"the propeller of one run turns the other way",
       [](StepMean& step) {
         if (step.occlusion_deg != 45 || step.repetition != 3) return;
         step.thrust_n *= -0.5;
       },
       {"repetition 3 at 45° is", "must be positive", "reversed"}},
      // What no step can tell: the part of ± that holds it, if any, is named in the budget.
      {"a cell that reads 4 % too much", thrust_times(1.04), {}},
      {"twelve poles for fourteen", speed_times(7.0 / 6), {}},
      {"a torque arm of 1.2 times", [](StepMean& step) { step.torque_nm *= 1.2; }, {}},
      {"all plates 5° too small",
       [](StepMean& step) {
         const StudyTruth truth = without_kink();
         if (step.occlusion_deg > 0) step.thrust_n *= truth.k(step.occlusion_deg - 5) / truth.k(step.occlusion_deg);
       },
       {}},
  };
  return all;
}

/// What kphi says of a campaign: the refusal, or its doubts.
std::vector<std::string> said_of(const StudyCampaign& campaign) {
  try {
    const Identification found = identify(campaign.steps);
    if (!(found.thrust_coefficient().value > 0)) return {"K_T must be positive"};
    std::vector<std::string> texts;
    for (const Doubt& doubt : analyse(found, study_options({})).flight.doubts) texts.push_back(doubt.text);
    return texts;
  } catch (const Error& refused) {
    return {refused.what()};
  }
}

bool names(const std::vector<std::string>& said, const Mistake& mistake) {
  return std::ranges::any_of(said, [&](const std::string& text) {
    return std::ranges::any_of(mistake.named_as,
                               [&](const std::string& word) { return text.find(word) != std::string::npos; });
  });
}

TEST(Sabotage, IsStoppedOrNamedWhereTheStepsCanTell) {
  constexpr unsigned kEach = 10;
  int tellable = 0, told = 0;
  for (const Mistake& mistake : mistakes()) {
    int found = 0;
    for (unsigned seed = 1; seed <= kEach; ++seed) {
      StudyCampaign campaign = study_campaign(without_kink(), 100 + seed);
      std::ranges::for_each(campaign.steps, mistake.make);
      const std::vector<std::string> said = said_of(campaign);
      found += names(said, mistake) ? 1 : 0;
      for (std::size_t i = mistake.named_as.empty() ? 1 : said.size(); i < said.size(); ++i)
        ADD_FAILURE() << mistake.name << ": " << said[i];
    }
    if (mistake.named_as.empty()) continue;
    tellable += kEach;
    told += found;
    EXPECT_GE(found, 8) << mistake.name;
    if (found < 10) std::printf("%s %d\n", mistake.name, found);
  }
  std::printf("told %d of %d\n", told, tellable);
  EXPECT_GE(told, 0.95 * tellable) << told << " of " << tellable;
}

TEST(Sabotage, IsNotSeenInCleanCampaigns) {
  constexpr unsigned kCampaigns = 1000;
  int named = 0;
  for (unsigned seed = 1; seed <= kCampaigns; ++seed)
    named += said_of(study_campaign(without_kink(), 1000 + seed)).empty() ? 0 : 1;
  std::printf("named %d of %u\n", named, kCampaigns);
  EXPECT_LE(named, 20) << "2 %";
}

}  // namespace sabotage_test
}  // namespace kphi::fit
