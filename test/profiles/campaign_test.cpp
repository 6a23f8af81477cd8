#include "profiles/campaign.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "profiles/profile_reader.hpp"
#include "test/profiles/refusals.hpp"

namespace kphi::profiles {
namespace campaign_test {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::StartsWith;

/// What the campaign says with `from` replaced by `to`.
std::vector<std::string> refused(const std::string& from, const std::string& to) {
  return refusals([&] { return parse_campaign(changed(kCampaignText, from, to), "c.yaml"); });
}

TEST(Campaign, IsReadIntoSiUnits) {
  const Campaign campaign = parse_campaign(kCampaignText, "c.yaml");
  EXPECT_EQ(campaign.name, "short");
  EXPECT_EQ(campaign.operator_name, "Ada");
  EXPECT_EQ(campaign.propeller.id, "5x3");
  EXPECT_EQ(campaign.propeller.name, "five inches, three blades");
  EXPECT_EQ(campaign.propeller.diameter_in, 5);
  EXPECT_EQ(campaign.propeller.blades, 3);
  EXPECT_THAT(campaign.occlusions_deg, ElementsAre(0, 45, 90));
  EXPECT_EQ(campaign.repetitions, 2);
  EXPECT_EQ(campaign.profile.steps, 4);
  EXPECT_EQ(campaign.profile.dwell, Seconds(2));
  EXPECT_EQ(campaign.profile.first, from_rpm(100));
  EXPECT_EQ(campaign.profile.last, from_rpm(19100));
  EXPECT_EQ(campaign.zero, Seconds(3));
  EXPECT_EQ(campaign.minimum_discard, Seconds(0.5));
  EXPECT_FALSE(campaign.box_bias) << "never unasked";
  EXPECT_EQ(campaign.supply, Volts(12));
  EXPECT_EQ(campaign.limits["speed_max_rpm"], 19100);
  EXPECT_EQ(campaign.limits["thrust_max_n"], 20);
  EXPECT_EQ(campaign.limits["supply_current_max_a"], 35);
  EXPECT_EQ(campaign.limits["coil_temperature_max_degc"], 110);
  EXPECT_EQ(campaign.text, kCampaignText);
  EXPECT_EQ(campaign.path, "c.yaml");
}

TEST(Campaign, HasThreeRepetitionsAndNoOperatorUnlessItSaysSo) {
  const std::string text = changed(changed(kCampaignText, "repetitions: 2\n", ""), "operator: Ada\n", "");
  const Campaign campaign = parse_campaign(text, "c.yaml");
  EXPECT_EQ(campaign.repetitions, 3);
  EXPECT_EQ(campaign.operator_name, "");
}

TEST(Campaign, RunsAsListedUpwardsOnceMountedUnlessItsOrderSaysOtherwise) {
  const Campaign plain = parse_campaign(kCampaignText, "c.yaml");
  EXPECT_EQ(to_words(plain.order), "runs listed, steps up");
  EXPECT_EQ(plain.repetitions_extra_max, 1);
  EXPECT_FALSE(plain.profile.slew_rad_s2);
  const Campaign campaign = parse_campaign(
      changed(kCampaignText, "last_rpm: 19100\n", "last_rpm: 19100\n  slew_rpm_s: 3000\n") +
          "repetitions_extra_max: 2\n"
          "order: {runs: shuffled, steps: down, seed: 9, remount_each_repetition: true, reference: true}\n",
      "c.yaml");
  EXPECT_EQ(campaign.order.runs, RunOrderKind::shuffled);
  EXPECT_EQ(campaign.order.steps, StepOrderKind::down);
  EXPECT_EQ(campaign.order.seed, 9u);
  EXPECT_TRUE(campaign.order.remount_each_repetition);
  EXPECT_TRUE(campaign.order.reference);
  EXPECT_EQ(campaign.repetitions_extra_max, 2);
  EXPECT_DOUBLE_EQ(campaign.profile.slew_rad_s2.value(), from_rpm(3000).value());
}

TEST(Campaign, MayRunDownwards) {
  const auto text =
      changed(changed(kCampaignText, "first_rpm: 100", "first_rpm: 9000"), "last_rpm: 19100", "last_rpm: 50");
  const auto levels = parse_campaign(text, "c.yaml").profile.levels();
  EXPECT_EQ(levels.front(), from_rpm(9000));
  EXPECT_EQ(levels.back(), from_rpm(50));
}

TEST(StepProfile, HasThePapersIncrementsAndBothEndsExactly) {
  const StepProfile profile{40, Seconds(2), from_rpm(100), from_rpm(19100)};
  const auto levels = profile.levels();
  ASSERT_EQ(levels.size(), 40u);
  EXPECT_EQ(levels.front(), from_rpm(100));
  EXPECT_EQ(levels.back(), from_rpm(19100));
  for (std::size_t i = 1; i < levels.size(); ++i) {
    EXPECT_NEAR(to_rpm(levels[i] - levels[i - 1]), 487.179, 5e-4) << "step " << i;
  }
  const StepProfile six_inch{40, Seconds(2), from_rpm(100), from_rpm(17188)};
  EXPECT_NEAR(to_rpm(six_inch.levels()[1] - six_inch.levels()[0]), 438.154, 5e-4);
}

TEST(StepProfile, EndsExactlyForEveryNumberOfSteps) {
  for (int steps = 2; steps <= 1000; ++steps) {
    const StepProfile profile{steps, Seconds(1), from_rpm(100), from_rpm(19100)};
    const auto levels = profile.levels();
    ASSERT_EQ(static_cast<int>(levels.size()), steps);
    ASSERT_EQ(levels.front(), profile.first);
    ASSERT_EQ(levels.back(), profile.last);
  }
}

TEST(Campaign, EachMistakeEarnsItsRefusal) {
  expect_refusals(
      refused,
      {// Refuses speeds above its own limit
       {"last_rpm: 19100", "last_rpm: 25000",
        "15:13: profile.last_rpm: 25000 is above 19100 RPM (limits.speed_max_rpm); lower it, or raise "
        "the limit if propeller and motor tolerate it"},
       {"first_rpm: 100", "first_rpm: 19101", "14:14: profile.first_rpm: 19101 is above…"},
       // A range of dwells and what ends a step belong together
       {"dwell_s: 2.0", "dwell_s: [0.7, 4]\n  until: {k_percent: 0.2}", ""},
       {"dwell_s: 2.0", "dwell_s: [0.7, 4]",
        "13:12: profile.dwell_s: a range without until; add until: {k_percent: 0.2}, or give one time"},
       {"dwell_s: 2.0", "dwell_s: 2.0\n  until: {k_percent: 0.2}",
        "13:12: profile.dwell_s: with until, a step lasts between two times; write dwell_s: [least, most], such as "
        "[0.7, 4]"},
       {"dwell_s: 2.0", "dwell_s: [4, 0.7]\n  until: {k_percent: 0.2}",
        "13:16: profile.dwell_s[1]: 0.7 is not above 4 s (profile.dwell_s[0]); write the shorter time first"},
       {"dwell_s: 2.0", "dwell_s: [0.4, 4]\n  until: {k_percent: 0.2}",
        "13:13: profile.dwell_s[0]: 0.4 is not above 0.5 s (minimum_discard_s); dwell longer, or nothing is left to "
        "average"},
       // So do a range of repetitions and what ends them
       {"repetitions: 2", "repetitions: [2, 5]",
        "10:14: repetitions: a range without profile.until; add until: {k_percent: 0.2}, or give one number"},
       {"repetitions: 2", "repetitions: [2, 2.5]", "10:18: repetitions[1]: expected a whole…"},
       {"repetitions: 2", "repetitions: [1, 5]", "10:15: repetitions[0]: 1 is below 2; write a value from 2 to 20"},
       {"repetitions: 2", "repetitions: [2, 5, 6]", "10:14: repetitions: …"},
       // Refuses dwells that leave nothing to average
       {"dwell_s: 2.0", "dwell_s: 0.5",
        "13:12: profile.dwell_s: 0.5 is not above 0.5 s (minimum_discard_s); dwell longer, or nothing "
        "is left to average"},
       {"dwell_s: 2.0", "dwell_s: 0.51", ""},
       // Shuffles with a seed only
       {"repetitions: 2", "repetitions: 2\norder: {runs: shuffled}",
        "11:15: order.runs: shuffled without a seed; add seed: and any whole number; the same seed gives the same "
        "order"},
       {"repetitions: 2", "repetitions: 2\norder: {steps: shuffled}", "11:16: order.steps: shuffled without…"},
       {"repetitions: 2", "repetitions: 2\norder: {steps: sideways}", "11:16: order.steps: …"},
       {"repetitions: 2", "repetitions: 2\norder: {runs: shuffled, seed: -1}", "11:31: order.seed: …"},
       // Refuses an occlusion listed twice
       {"[0, 45, 90]", "[0, 45, 45.0]",
        "9:25: occlusions_deg[2]: 45° is already listed at [1]; list each occlusion once; "
        "repetitions sets how often it is run"},
       // Refuses occlusions outside the circle
       {"[0, 45, 90]", "[0, 360]",
        "9:21: occlusions_deg[1]: 360 is not below 360 degrees; write a value from 0 to below 360 degrees"},
       {"[0, 45, 90]", "[-1]",
        "9:18: occlusions_deg[0]: -1 is below 0 degrees; write a value from 0 to below 360 degrees"},
       {"[0, 45, 90]", "[359.5]", ""},
       {"[0, 45, 90]", "[]", "9:17: occlusions_deg: 0 values; write at least 1"},
       {"[0, 45, 90]", "45", "9:17: occlusions_deg: expected a list, found 45; write a list: [45]"},
       // Limits the voltage on both sides of the supply
       {"  thrust_max_n", "  supply_voltage_min_v: 12\n  thrust_max_n",
        "21:25: limits.supply_voltage_min_v: 12 V is not below the 12 V of supply_v; lower it: the motor would never "
        "turn"},
       {"  thrust_max_n", "  supply_voltage_max_v: 12\n  thrust_max_n",
        "21:25: limits.supply_voltage_max_v: 12 V is not above the 12 V of supply_v; raise it: the motor would never "
        "turn"},
       // Lets the coil cool down below where it pauses
       {"  thrust_max_n", "  cooling: {pause_above_degc: 70, resume_below_degc: 70}\n  thrust_max_n", ""},
       // Refuses missing keys at the object that lacks them
       {"  thrust_max_n: 20\n", "",
        "19:1: limits.thrust_max_n is missing; add the key thrust_max_n (above it the motor coasts)"},
       {"supply_v: 12.0\n", "", "1:1: supply_v is missing; add the key supply_v…"},
       // Refuses empty values at their key
       {"zero_s: 3.0", "zero_s:",
        "16:1: zero_s: expected a number, found nothing; write a number here (motor off, before and after each run)"},
       // Refuses wrong types
       {"id: 5x3", "id: 53", "5:7: propeller.id: expected text, found 53; quote it: \"53\""},
       {"steps: 4", "steps: \"4\"", "12:10: profile.steps: expected a whole number, found text \"4\"…"},
       {"supply_v: 12.0", "supply_v: {v: 12}", "18:11: supply_v: expected a number, found keys…"},
       {"supply_v: 12.0", "supply_v: true", "18:11: supply_v: expected a number, found true…"},
       // Wants a name that says something, and can be that of a file
       {"name: five inches, three blades", "name: \"\"",
        "6:9: propeller.name: this text is empty; write maker and type, as on the hub"},
       {"name: short", "name: \"a\\nb\"", "2:7: …"},
       // Knows its own format
       {"kphi-campaign/1", "kphi-campaign/2",
        "1:9: format: text \"kphi-campaign/2\" is not allowed; write kphi-campaign/1"},
       // Says which values are allowed
       {"steps: 4", "steps: 2000", "12:10: profile.steps: 2000 is above 1000; write a value from 2 to 1000"},
       {"dwell_s: 2.0", "dwell_s: 0",
        "13:12: profile.dwell_s: 0 is not above 0 s; write a value from above 0 to 600 s"},
       {"blades: 3", "blades: 1", "8:11: propeller.blades: 1 is below 2; write a value from 2 to 8"},
       // Names the key that was meant
       {"steps: 4", "stesp: 4", "12:3: stesp is not a key of profile; did you mean steps?"},
       {"repetitions", "repetitons", "10:1: repetitons is not a key; did you mean repetitions?"},
       // Says that the unit is part of the key
       {"dwell_s: 2.0", "dwell_ms: 2000",
        "13:3: dwell_ms is not a key of profile; the unit is part of the key: write dwell_s and the "
        "value in s"},
       {"last_rpm", "last",
        "15:3: last is not a key of profile; the unit is part of the key: write last_rpm and the value "
        "in RPM"},
       {"dwell_s: 2.0", "dwell_s: 2 s",
        "13:12: profile.dwell_s: text \"2 s\" does not fit; write the seconds alone, or [least, most] with until"},
       // Says where a key belongs
       {"zero_s: 3.0\n", "zero_s: 3.0\nthrust_max_n: 3\n", "17:1: thrust_max_n is not a key; it belongs to limits"},
       {"  steps: 4\n", "  steps: 4\n  zero_s: 3\n",
        "13:3: zero_s is not a key of profile; it belongs to the top of the file"},
       {"  steps: 4\n", "  steps: 4\n  colour: red\n",
        "13:3: colour is not a key of profile; known here: dwell_s, first_rpm, last_rpm, slew_rpm_s, steps, until"}});
}

Campaign until(const std::string& repetitions) {
  return parse_campaign(changed(changed(kCampaignText, "dwell_s: 2.0", "dwell_s: [0.7, 4]\n  until: {k_percent: 0.2}"),
                                "repetitions: 2", repetitions),
                        "c.yaml");
}

TEST(Campaign, WithUntilMayLeaveTheNumberOfRunsOpen) {
  EXPECT_EQ(until("repetitions: 2").repetitions_most, std::nullopt);
  const Campaign open = until("repetitions: [2, 5]");
  EXPECT_EQ(open.repetitions, 2);
  EXPECT_EQ(open.repetitions_most, 5);
  EXPECT_EQ(
      refusals([] { return until("repetitions: [5, 2]"); }),
      std::vector<std::string>{"10:18: repetitions[1]: 2 is not above 5 (repetitions[0]); write the smaller number "
                               "first"});
  EXPECT_EQ(
      refusals([] { return until("repetitions: [2, 5]\nrepetitions_extra_max: 1"); }),
      std::vector<std::string>{"11:24: repetitions_extra_max: repetitions is a range, which says how many at most; "
                               "remove one of them"});
}

struct Range {
  const char* from;
  const char* key;
  std::vector<std::string> refused;
  std::vector<std::string> accepted;
};

TEST(Campaign, HoldsEveryRange) {
  const std::vector<Range> ranges{
      {"steps: 4", "steps: ", {"1", "0", "-4", "1001", "2.5", "4.0"}, {"2", "1000"}},
      {"repetitions: 2", "repetitions: ", {"0", "21", "1.5"}, {"1", "20"}},
      {"dwell_s: 2.0", "dwell_s: ", {"0", "-1", "601"}, {"600", "1"}},
      {"first_rpm: 100", "first_rpm: ", {"0", "-100", "100001"}, {"1"}},
      {"zero_s: 3.0", "zero_s: ", {"0", "601"}, {"0.1", "600"}},
      {"minimum_discard_s: 0.5", "minimum_discard_s: ", {"-0.1", "601"}, {"0"}},
      {"supply_v: 12.0", "supply_v: ", {"0", "61"}, {"60"}},
      {"diameter_in: 5", "diameter_in: ", {"0.5", "41"}, {"1", "40"}},
      {"blades: 3", "blades: ", {"1", "9", "2.5"}, {"2", "8"}},
      {"speed_max_rpm: 19100", "speed_max_rpm: ", {"0", "100001", "19099"}, {"19100", "100000"}},
      {"thrust_max_n: 20", "thrust_max_n: ", {"0", "1001"}, {"1000"}},
      {"supply_current_max_a: 35", "supply_current_max_a: ", {"0", "501"}, {"500"}},
      {"coil_temperature_max_degc: 110", "coil_temperature_max_degc: ", {"19", "201"}, {"20", "200"}},
  };
  for (const Range& range : ranges) {
    for (const auto& value : range.refused)
      EXPECT_EQ(refused(range.from, range.key + value).size(), 1u) << range.key << value;
    for (const auto& value : range.accepted)
      EXPECT_THAT(refused(range.from, range.key + value), IsEmpty()) << range.key << value;
  }
}

TEST(Campaign, MayLetTheCoilCoolDownBetweenRuns) {
  EXPECT_FALSE(parse_campaign(kCampaignText, "c.yaml").limits.cooling);
  const auto with = [](const std::string& cooling) {
    return changed(kCampaignText,
                   "coil_temperature_max_degc:", "cooling: {" + cooling + "}\n  coil_temperature_max_degc:");
  };
  const auto cooling = parse_campaign(with("pause_above_degc: 70, resume_below_degc: 45"), "c.yaml").limits.cooling;
  ASSERT_TRUE(cooling);
  EXPECT_EQ(cooling->pause_above.value(), 70);
  EXPECT_EQ(cooling->resume_below.value(), 45);
  EXPECT_THROW((void)parse_campaign(with("pause_above_degc: 45, resume_below_degc: 70"), "c.yaml"), ConfigurationError);
  EXPECT_THROW((void)parse_campaign(with("pause_above_degc: 45"), "c.yaml"), ConfigurationError);
}

TEST(Campaign, RefusesATextThatIsNoCampaignAtAll) {
  const auto whole = [](const std::string& text) { return refusals([&] { return parse_campaign(text, "c.yaml"); }); };
  EXPECT_THAT(whole("format: kphi-campaign/1\nname: x\n"),
              testing::Contains("1:1: profile is missing; add the key profile (the speeds of a run)"));
  EXPECT_THAT(whole("[1, 2]"), ElementsAre(StartsWith("1:1: the file: expected keys, found a list")));
  EXPECT_THAT(whole(kBenchText),
              ElementsAre("1:9: this is a bench file, expected a campaign file; name a file that begins with format: "
                          "kphi-campaign/1"));
  EXPECT_THAT(
      refused("limits:\n", "limits:\nlimitz:\n"),
      ElementsAre(StartsWith("19:1: limits: expected keys, found nothing"), StartsWith("20:1: limitz is not a key")));
}

TEST(Campaign, RefusesNamesThatCannotBeFileNames) {
  for (const char* id : {"../x", "a/b", "\"\"", "\"a b\"", "-a", ".hidden", "φ", "a2345678901234567890123456789012x"}) {
    EXPECT_THAT(refused("id: 5x3", std::string("id: ") + id), ElementsAre(StartsWith("5:7: propeller.id: text ")))
        << id;
  }
}

TEST(Campaign, SaysAllThatIsWrongAtOnceAndEachThingOnce) {
  std::string text = changed(kCampaignText, "steps: 4", "stesp: 4");
  text = changed(text, "repetitions: 2", "repetitions: 010");
  text = changed(text, "supply_v: 12.0", "supply_v: 120");
  text = changed(text, "  thrust_max_n: 20\n", "");
  EXPECT_THAT(refusals([&] { return parse_campaign(text, "c.yaml"); }),
              ElementsAre(StartsWith("10:14: 010 looks octal"), StartsWith("12:3: stesp is not a key"),
                          StartsWith("18:11: supply_v: 120 is above 60 V"),
                          StartsWith("19:1: limits.thrust_max_n is missing")));
}

TEST(ProfileReader, RefusesEachKeyThatNobodyReads) {
  const auto unread = [](const auto& read) {
    return refusals([&] {
      ProfileReader file(kCampaignText + std::string("order: {}\n"), "c.yaml", FileKind::campaign);
      read(file);
      file.finish();
      return 0;
    });
  };
  const auto all = unread([](ProfileReader&) {});
  EXPECT_EQ(all.size(), 21u) << "23 lines; three begin an object, one is the format, one a list of three";
  EXPECT_THAT(all, testing::Contains("20:18: limits.speed_max_rpm: this kphi does not use it; remove it, and report "
                                     "this mistake of kphi"));
  const auto rest = unread([](ProfileReader& file) {
    static_cast<void>(file.get<std::vector<double>>("/occlusions_deg"));
    static_cast<void>(file.has("/limits/speed_max_rpm"));
    static_cast<void>(file.number("/supply_v"));
  });
  EXPECT_EQ(rest.size(), all.size() - 4) << "whether a key is there does not count as reading it";
}

TEST(Campaign, NamesItsFile) {
  EXPECT_THAT([] { static_cast<void>(load_campaign("/no/such.yaml")); },
              testing::ThrowsMessage<ConfigurationError>(StartsWith("/no/such.yaml: cannot be opened")));
  EXPECT_THAT([] { static_cast<void>(parse_campaign("a: [", "dir/c.yaml")); },
              testing::ThrowsMessage<ConfigurationError>(StartsWith("dir/c.yaml:")));
}

}  // namespace campaign_test
}  // namespace kphi::profiles
