// Campaigns without a terminal: what an operator's answers, and their lack, do to the whole program.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "results/journal.hpp"
#include "results/steps_csv.hpp"
#include "test/daq/bench_fixture.hpp"
#include "test/end_to_end/process.hpp"

namespace kphi::test {
namespace answers_test {

using testing::HasSubstr;

class Answered : public testing::Test {
 protected:
  Answered() {
    write("campaign.yaml", short_campaign_text("0, 90", 1, 2));
    write("bench.yaml", deterministic_config(1).text);
  }
  [[nodiscard]] std::string path(const std::string& name) const { return (folder_.path() / name).string(); }
  void write(const std::string& name, const std::string& text) const { std::ofstream(path(name)) << text; }
  [[nodiscard]] std::vector<std::string> command(const std::vector<std::string>& more) const {
    std::vector<std::string> words{KPHI_PROGRAM, "run",      path("campaign.yaml"), "--bench", path("bench.yaml"),
                                   "--out",      path("out")};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }
  void answers(const std::string& lists) const { write("answers.yaml", "format: kphi-answers/1\n" + lists); }

  TemporaryFolder folder_;
};

TEST_F(Answered, RunsTheWholeCampaignAndWritesDownWhatWasAskedAndAnswered) {
  answers("mountings: [0, 90]\n");
  Process run(command({"--answers", path("answers.yaml")}));
  EXPECT_EQ(run.wait(), 0) << run.err();
  const std::filesystem::path folder = run.out().substr(0, run.out().find('\n'));
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
    answers(lists);
    Process run(command({"--answers", path("answers.yaml")}));
    EXPECT_EQ(run.wait(), 2) << run.err();
    EXPECT_THAT(run.err(), HasSubstr(path("answers.yaml") + words));
    EXPECT_FALSE(std::filesystem::exists(path("out")));
  }
}

TEST_F(Answered, NamesADecisionThatWasNeverAskedForAfterTheCampaignIsKept) {
  answers("mountings: [0, 90]\nrun_again: [true]\n");
  Process run(command({"--answers", path("answers.yaml")}));
  EXPECT_EQ(run.wait(), 2);
  EXPECT_THAT(run.err(), HasSubstr("answers.yaml:3:13: answer 1 of run_again is one too many"));
  const std::filesystem::path folder = run.out().substr(0, run.out().find('\n'));
  EXPECT_EQ(results::read_journal(folder / "journal.jsonl").entries.back().event, "campaign_finished");
}

TEST_F(Answered, AreNoCompanyForYes) {
  answers("mountings: [0, 90]\n");
  Process run(command({"--answers", path("answers.yaml"), "--yes"}));
  EXPECT_EQ(run.wait(), 2);
}

TEST_F(Answered, DryRunHoldsThemAgainstThePlanAndPrintsWhatIsAsked) {
  answers("mountings: [0, 45]\n");
  Process refused(command({"--answers", path("answers.yaml"), "--dry-run", "--json"}));
  EXPECT_EQ(refused.wait(), 2);
  const auto plan = nlohmann::json::parse(refused.out());
  EXPECT_EQ(plan.at("ok"), false);
  EXPECT_EQ(plan.at("mounting_angles_deg"), (std::vector<double>{0, 90}));
  EXPECT_FALSE(std::filesystem::exists(path("out")));
}

TEST_F(Answered, WithoutThemAndWithoutATerminalNobodyIsThere) {
  Process run(command({}));
  EXPECT_EQ(run.wait(), 2);
  EXPECT_THAT(run.err(), HasSubstr("--answers FILE"));
}

}  // namespace answers_test
}  // namespace kphi::test
