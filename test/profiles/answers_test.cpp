#include "profiles/answers.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "test/profiles/refusals.hpp"

namespace kphi::profiles {
namespace answers_test {

using testing::ElementsAre;
using testing::StartsWith;

constexpr const char* kText =
    "format: kphi-answers/1\n"    // 1
    "mountings: [0, 45,\n"        // 2
    "            90]\n"           // 3
    "run_again: [true, false]\n"  // 4
    ;

/// What require_mountings says; empty when it is content.
std::string refused(const std::vector<double>& expected_deg, const std::string& text = kText) {
  Plan plan;
  for (const double angle : expected_deg) plan.runs.push_back({.occlusion_deg = angle});
  try {
    require_mountings(parse_answers(text, "a.yaml"), plan);
  } catch (const ConfigurationError& error) {
    return error.what();
  }
  return {};
}

TEST(Answers, AreReadWithTheirPlaces) {
  const Answers answers = parse_answers(kText, "a.yaml");
  ASSERT_EQ(answers.mountings.size(), 3u);
  EXPECT_EQ(answers.mountings[2].value, 90);
  EXPECT_EQ(answers.place(answers.mountings[2].mark), "a.yaml:3:13");
  ASSERT_EQ(answers.run_again.size(), 2u);
  EXPECT_TRUE(answers.run_again[0].value);
  EXPECT_FALSE(answers.run_again[1].value);
}

TEST(Answers, MayBeJson) {
  const Answers answers = parse_answers(R"({"format": "kphi-answers/1", "mountings": [0.5]})", "a.json");
  EXPECT_EQ(answers.mountings.at(0).value, 0.5);
  EXPECT_TRUE(answers.run_again.empty());
}

TEST(Answers, OfTheWrongKindAreRefusedAtTheirPlace) {
  const auto refusals_of = [](const std::string& text) {
    return refusals([&] { return parse_answers(text, "a.yaml"); });
  };
  EXPECT_THAT(refusals_of(changed(kText, "45", "half")), ElementsAre(StartsWith("2:16: mountings[1]: ")));
  EXPECT_THAT(refusals_of(changed(kText, "90]", "360]")), ElementsAre(StartsWith("3:13: mountings[2]: ")));
  EXPECT_THAT(refusals_of(changed(kText, "true,", "maybe,")), ElementsAre(StartsWith("4:13: run_again[0]: ")));
  EXPECT_THAT(refusals_of(changed(kText, "run_again", "run_agian")), ElementsAre(testing::HasSubstr("run_again")));
}

TEST(RequireMountings, IsContentWithJustThose) { EXPECT_EQ(refused({0, 45, 90}), ""); }

TEST(RequireMountings, RefusesAnswersWhereMoreMayFollow) {
  Plan plan;
  plan.runs = {{.occlusion_deg = 0}};
  plan.mounts_more = true;
  try {
    require_mountings(parse_answers("format: kphi-answers/1\nmountings: [0]\n", "a.yaml"), plan);
    FAIL() << "accepted";
  } catch (const ConfigurationError& error) {
    EXPECT_THAT(error.what(), StartsWith("a.yaml:2:13: repetitions is a range and each is remounted"));
  }
}

TEST(RequireMountings, NamesTheFirstThatIsWrongMissingOrLeftOver) {
  EXPECT_EQ(refused({0, 90, 45}),
            "a.yaml:2:16: mounting 2 is 45°, the campaign needs 90°; kphi run --dry-run lists them");
  EXPECT_EQ(refused({0, 45, 90, 180}),
            "a.yaml:3:13: mountings ends after 3 of 4: the next one is 180°; kphi run --dry-run lists "
            "them");
  EXPECT_EQ(refused({0, 45}), "a.yaml:3:13: mounting 3 is one too many: the campaign needs 2; remove it");
  EXPECT_THAT(refused({0}, "format: kphi-answers/1\nmountings: []\n"),
              StartsWith("a.yaml:2:12: mountings ends after 0"));
}

}  // namespace answers_test
}  // namespace kphi::profiles
