// Campaigns without a terminal: what an operator's answers, and their lack, do to the whole program.
#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "results/journal.hpp"
#include "results/steps_csv.hpp"
#include "test/end_to_end/program.hpp"

namespace kphi::test::answers_test {

using testing::HasSubstr;

class Answered : public testing::Test, protected VirtualCampaign {
 protected:
  Answered() : VirtualCampaign(short_campaign_text("0, 90", 1, 2)) {}
  /// Runs the campaign with these answers.
  [[nodiscard]] Ended answered(const std::string& lists, int exit_code, const std::vector<std::string>& more = {}) {
    write("answers.yaml", "format: kphi-answers/1\n" + lists);
    return ran(joined(command({"--answers", path("answers.yaml")}), more), exit_code);
  }
};

TEST_F(Answered, RunsTheWholeCampaignAndWritesDownWhatWasAskedAndAnswered) {
  const std::filesystem::path folder = answered("mountings: [0, 90]\n", 0).folder();
  EXPECT_EQ(results::read_steps(folder / "steps.csv").size(), 4u);
  std::vector<std::string> told;
  for (const auto& entry : results::read_journal(folder / "journal.jsonl").entries) {
    if (entry.event.starts_with("operator_")) told.push_back(entry.data.at("words"));
    if (entry.event == "mounted") told.push_back(entry.data.at("confirmed_by"));
  }
  EXPECT_THAT(told, testing::ElementsAre("mounted angle for propeller 5x3, 0°?", "0", path("answers.yaml"),
                                         "mounted angle for propeller 5x3, 90°?", "90", path("answers.yaml")));
}

TEST_F(Answered, RefusesWrongMissingAndLeftOverMountingsBeforeAnythingIsTouched) {
  for (const auto& [lists, words] : {std::pair("mountings: [0, 45]\n", ":2:16: mounting 2 is 45°"),
                                     std::pair("mountings: [0]\n", ":2:13: mountings ends after 1 of 2"),
                                     std::pair("mountings: [0, 90, 90]\n", ":2:20: mounting 3 is one too many"),
                                     std::pair("mountings: [0, ninety]\n", ":2:16: mountings[1]: ")}) {
    EXPECT_THAT(answered(lists, 2).err, HasSubstr(path("answers.yaml") + words));
    EXPECT_FALSE(std::filesystem::exists(path("out")));
  }
}

TEST_F(Answered, NamesADecisionThatWasNeverAskedForAfterTheCampaignIsKept) {
  const Ended run = answered("mountings: [0, 90]\nrun_again: [true]\n", 2);
  EXPECT_THAT(run.err, HasSubstr("answers.yaml:3:13: answer 1 of run_again is one too many"));
  EXPECT_EQ(results::read_journal(run.folder() + "/journal.jsonl").entries.back().event, "campaign_finished");
}

TEST_F(Answered, AreNoCompanyForYes) { (void)answered("mountings: [0, 90]\n", 2, {"--yes"}); }

TEST_F(Answered, DryRunHoldsThemAgainstThePlanAndPrintsWhatIsAsked) {
  const auto plan = nlohmann::json::parse(answered("mountings: [0, 45]\n", 2, {"--dry-run", "--json"}).out);
  EXPECT_EQ(plan.at("ok"), false);
  EXPECT_EQ(plan.at("mounting_angles_deg"), (std::vector<double>{0, 90}));
  EXPECT_FALSE(std::filesystem::exists(path("out")));
}

TEST_F(Answered, WithoutThemAndWithoutATerminalNobodyIsThere) {
  EXPECT_THAT(ran(command({}), 2).err, HasSubstr("--answers FILE"));
}

}  // namespace kphi::test::answers_test
