#include "profiles/campaign_text.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "test/source_dir.hpp"

namespace kphi::profiles {
namespace campaign_text_test {

using ::testing::HasSubstr;

Campaign shipped() { return load_campaign(test::source_dir() + "/profiles/icra2021_5in_3blade.yaml"); }

Campaign other(Campaign campaign) {
  campaign.occlusions_deg = {0, 45, 270};
  campaign.repetitions = 2;
  campaign.order.remount_each_repetition = !campaign.order.remount_each_repetition;
  campaign.profile.steps = 10;
  campaign.profile.dwell = Seconds(1.6);
  campaign.zero = Seconds(1);
  return campaign;
}

void expect_as_wanted(const Campaign& campaign) {
  const Campaign wanted = other(campaign);
  const Campaign read = parse_campaign(changed_text(campaign, wanted), "x.yaml");
  EXPECT_EQ(read.occlusions_deg, wanted.occlusions_deg);
  EXPECT_EQ(read.repetitions, wanted.repetitions);
  EXPECT_EQ(read.order.remount_each_repetition, wanted.order.remount_each_repetition);
  EXPECT_EQ(read.profile.steps, wanted.profile.steps);
  EXPECT_EQ(read.profile.dwell.value(), wanted.profile.dwell.value());
  EXPECT_EQ(read.zero.value(), wanted.zero.value());
  EXPECT_EQ(read.limits["thrust_max_n"], campaign.limits["thrust_max_n"]);
}

TEST(CampaignText, WritesANumberForARangeOfRepetitionsAndBack) {
  Campaign fixed = shipped();
  fixed.text.replace(fixed.text.find("dwell_s: 2.0"), 12, "dwell_s: [1.2, 4]\n  until: {k_percent: 0.2}");
  fixed = parse_campaign(fixed.text, "x.yaml");
  Campaign open = fixed;
  open.repetitions = 2;
  open.repetitions_most = 5;
  const Campaign read = parse_campaign(changed_text(fixed, open), "x.yaml");
  EXPECT_EQ(read.repetitions_most, 5);
  EXPECT_EQ(changed_text(read, fixed), fixed.text);
}

TEST(CampaignText, KeepsEverythingThatIsNotChanged) {
  const Campaign campaign = shipped();
  EXPECT_EQ(changed_text(campaign, campaign), campaign.text);
  const std::string text = changed_text(campaign, other(campaign));
  EXPECT_THAT(text, HasSubstr("occlusions_deg: [0, 45, 270]  # sector plates"));
  EXPECT_THAT(text, HasSubstr("  dwell_s: 1.6\n"));
  EXPECT_THAT(text, HasSubstr("thrust_max_n: 20       # the load cell"));
  expect_as_wanted(campaign);
}

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  const std::size_t at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return text.replace(at, what.size(), by);
}

TEST(CampaignText, TakesEveryLayout) {
  const std::string shipped_order =
      "order:\n  remount_each_repetition: true  # only so does their spread hold what a mounting changes\n";
  const std::string text = replaced(shipped().text, shipped_order, "");
  const std::string line =
      "occlusions_deg: [0, 45, 90, 180, 270]  # sector plates; 0 is no plate, gives K_T; the report draws them\n";
  const std::string repetitions = "repetitions: 3           # of each\n";
  for (const char* block : {"occlusions_deg:\n  - 0\n  - 45  # small\n  - 90\n", "occlusions_deg:\n- 0\n- 90\n",
                            "occlusions_deg: [ 0,\n   90 ]\n"})
    expect_as_wanted(parse_campaign(replaced(text, line, block), "x.yaml"));
  expect_as_wanted(parse_campaign(replaced(text, repetitions, ""), "x.yaml"));
  for (const char* order :
       {"order: {runs: listed}\n", "order:\n  # why\n  runs: listed\n", "order: {remount_each_repetition: true}\n",
        "order:\n    remount_each_repetition: true # always\n    reference: true\n"})
    expect_as_wanted(parse_campaign(replaced(text, repetitions, repetitions + order), "x.yaml"));
  const std::string profile = text.substr(text.find("profile:"), text.find("zero_s:") - text.find("profile:"));
  expect_as_wanted(parse_campaign(
      replaced(text, profile, "profile: {steps: 40, dwell_s: 2.0, first_rpm: 100, last_rpm: 19100}  # ° in one\n"),
      "x.yaml"));
}

}  // namespace campaign_text_test
}  // namespace kphi::profiles
