// A campaign in virtual time that stops on its way, in every manner that needs no killing, and goes on.
#include "daq/campaign/resume.hpp"

#include "test/daq/campaign_on_bench.hpp"

namespace kphi::daq {
namespace resume_test {

using test::bytes_of;
using test::measured_in;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
namespace fs = std::filesystem;

class Resume : public CampaignOnBench {
 protected:
  Resume() {
    campaign_ = test::short_campaign("0, 90, 180", 2, 2);
    results_.emplace(results::CampaignFolder::create(folder_.path(), "20210530T000000Z", "short"));
  }
  CampaignResult begin(const results::CampaignFolder& folder, const Resumption* resumption = nullptr) {
    DeterministicBench bench(config_, {}, DeterministicBench::Lives::one_run);
    return go(bench, folder, resumption);
  }
  CampaignResult resume(bool accept_changes = false) {
    person_ = {};
    said_.lines.clear();
    const Resumption resumption = inspect(*results_, accept_changes);
    return begin(*results_, &resumption);
  }
  void stop_before(double occlusion_deg) {
    person_.refuse_at_deg = occlusion_deg;
    EXPECT_THROW((void)begin(*results_), NotMounted);
  }
  test::Files uninterrupted() {
    const auto folder = results::CampaignFolder::create(folder_.path(), "whole", "short");
    person_ = {};
    (void)begin(folder);
    return measured_in(folder);
  }
  nlohmann::json resumed_entry() { return journaled(results::kCampaignResumed).at(0); }
  template <class Error>
  std::string refusal(bool accept_changes = false) {
    return test::words_of<Error>([&] { return resume(accept_changes); });
  }
  fs::path run_file(double occlusion_deg, int repetition) { return results_->run("5x3", occlusion_deg, repetition); }
  void rewrite_journal(const std::string& text) { std::ofstream(results_->journal(), std::ios::trunc) << text; }
};

TEST_F(Resume, GoesOnAtTheFirstUnfinishedRunAndGivesTheBytesOfACampaignThatWasNeverStopped) {
  stop_before(90);
  const auto before = measured_in(*results_);
  ASSERT_EQ(before.size(), 4u);
  const CampaignResult result = resume();
  EXPECT_EQ(result.runs, 6);
  EXPECT_EQ(result.steps.steps, 12);
  EXPECT_THAT(person_.mounted_deg, ElementsAre(90, 180)) << "what was mounted then may not be now";
  EXPECT_TRUE(results::verify_campaign(*results_).whole());
  const auto after = measured_in(*results_);
  EXPECT_TRUE(after.at("5x3_phi000_rep2.h5") == before.at("5x3_phi000_rep2.h5"));
  EXPECT_TRUE(after == uninterrupted());
}

TEST_F(Resume, GoesOnInBenchTime) {
  stop_before(180);
  (void)resume();
  std::int64_t last = 0;
  for (const auto& run : runs()) {
    const auto recording = results::read_run(run);
    EXPECT_GT(recording.load_cell.front().arrival_ns, last) << run;
    last = recording.load_cell.back().arrival_ns;
  }
}

TEST_F(Resume, MountsAgainInTheMiddleOfAnOcclusion) {
  (void)begin(*results_);
  // As if it had been killed before the last run was accepted.
  auto lines = bytes_of(results_->journal());
  lines.resize(lines.find("{\"n\":", lines.rfind("\"run_accepted\"") - 80));
  rewrite_journal(lines);
  const auto whole = measured_in(*results_);
  (void)resume();
  EXPECT_THAT(person_.mounted_deg, ElementsAre(180));
  EXPECT_TRUE(measured_in(*results_) == whole);
}

TEST_F(Resume, KeepsAFileThatWasNotAcceptedYetAndMakesTheRunAgain) {
  stop_before(90);
  fs::copy_file(run_file(0, 2), run_file(90, 1));  // renamed, and then the light went out
  (void)resume();
  EXPECT_TRUE(fs::exists(results_->runs() / "5x3_phi090_rep1.unaccepted.h5"));
  EXPECT_THAT(resumed_entry().at("set_aside"), ElementsAre("runs/5x3_phi090_rep1.unaccepted.h5"));
  EXPECT_THAT(said_.lines, Contains(HasSubstr("kept as runs/5x3_phi090_rep1.unaccepted.h5")));
  EXPECT_TRUE(results::verify_campaign(*results_).whole());
}

TEST_F(Resume, KeepsPartsAndAbortedRunsUnderNamesOfTheirOwn) {
  stop_before(90);
  for (const char* name :
       {"5x3_phi090_rep1.h5.part", "5x3_phi090_rep1.interrupted.h5.part", "5x3_phi090_rep1.aborted.h5"}) {
    std::ofstream(results_->runs() / name) << name;
  }
  (void)resume();
  EXPECT_EQ(bytes_of(results_->runs() / "5x3_phi090_rep1.interrupted-2.h5.part"), "5x3_phi090_rep1.h5.part");
  EXPECT_EQ(bytes_of(results_->runs() / "5x3_phi090_rep1.interrupted.h5.part"), "5x3_phi090_rep1.interrupted.h5.part");
  EXPECT_EQ(bytes_of(results_->runs() / "5x3_phi090_rep1.aborted.h5"), "5x3_phi090_rep1.aborted.h5");
  EXPECT_EQ(results_->complete_runs().size(), 6u);
}

TEST_F(Resume, MakesTheTablesWholeAgain) {
  stop_before(180);
  std::ofstream(results_->steps(), std::ios::trunc) << "torn";
  fs::remove(results_->means());
  (void)resume();
  EXPECT_TRUE(measured_in(*results_) == uninterrupted());
}

TEST_F(Resume, CutsATornLastLineOfTheJournal) {
  stop_before(90);
  std::ofstream(results_->journal(), std::ios::app) << R"({"n":99,"t_ns":0,"utc")";
  (void)resume();
  const auto reading = results::read_journal(results_->journal());
  EXPECT_FALSE(reading.torn_last_line);
  EXPECT_TRUE(reading.problems.empty());
  EXPECT_EQ(journal().back().event, "campaign_finished");
}

// With the later runs it might ask for another run, though that plate is no longer mounted.
TEST_F(Resume, DoesNotJudgeAgainTheRepetitionsOfAnOcclusionThatAnotherFollowed) {
  stop_before(180);
  (void)resume();
  std::map<double, int> judged;
  for (const auto& verdict : journaled("repetitions_judged")) ++judged[verdict.at("occlusion_deg").get<double>()];
  EXPECT_EQ(judged, (std::map<double, int>{{0, 1}, {90, 2}, {180, 1}})) << "it stopped just after 90°";
}

// Steps that end by themselves, steps left out, runs added: all by the data, which are the same.
TEST_F(Resume, OfACampaignThatTakesNoMoreThanKNeedsGivesTheBytesOfOneThatWasNeverStopped) {
  std::string text = test::short_campaign_text("0, 90", 2, 2);
  const auto change = [&](const std::string& from, const std::string& to) {
    text.replace(text.find(from), from.size(), to);
  };
  change("repetitions: 2\nrepetitions_extra_max: 0", "repetitions: [2, 3]");
  change("steps: 2, dwell_s: 0.6", "steps: 20, dwell_s: [0.9, 2], until: {k_percent: 0.1}");
  campaign_ = profiles::parse_campaign(text, "until.yaml");
  stop_before(90);
  EXPECT_FALSE(journaled("another_run").empty()) << "choose a k_percent that one more run would exceed";
  (void)resume();
  EXPECT_TRUE(results::verify_campaign(*results_).whole());
  EXPECT_TRUE(measured_in(*results_) == uninterrupted());
}

TEST_F(Resume, BeginsWhatHadOnlyAFolder) {
  results::Journal(results_->journal());
  (void)resume();
  EXPECT_EQ(journal().front().event, "campaign_started");
  EXPECT_TRUE(measured_in(*results_) == uninterrupted());
}

TEST_F(Resume, AgainAndAgainLeavesOneAcceptanceOfEachRun) {
  for (const double at : {90.0, 180.0}) {
    person_.refuse_at_deg = at;
    const Resumption resumption = inspect(*results_, false);
    EXPECT_THROW((void)begin(*results_, &resumption), NotMounted);
  }
  (void)resume();
  EXPECT_EQ(results::state_of(results::read_journal(results_->journal())).accepted.size(), 6u);
  EXPECT_TRUE(inspect(*results_, false).state.finished);
}

TEST_F(Resume, RefusesAnotherCampaignFileUntilToldAndThenSaysAndKeepsBoth) {
  stop_before(90);
  const std::string before = campaign_.text;
  campaign_ = profiles::parse_campaign(test::short_campaign_text("0, 90, 180", 1, 2), "short.yaml");
  const std::string why = refusal<ConfigurationError>();
  EXPECT_THAT(why, AllOf(HasSubstr("the campaign file has changed"), HasSubstr("--accept-changes")));
  EXPECT_THAT(why, HasSubstr(results_->path().string()));
  EXPECT_EQ(why.find('\n'), std::string::npos);
  (void)resume(true);
  EXPECT_THAT(said_.lines, Contains("resuming although the campaign file has changed"));
  EXPECT_THAT(resumed_entry().at("accepted_changes"), ElementsAre("the campaign file has changed"));
  EXPECT_EQ(bytes_of(results_->campaign_file()), campaign_.text);
  EXPECT_EQ(bytes_of(results_->path() / "campaign.replaced.yaml"), before);
  EXPECT_EQ(refusal<ConfigurationError>(), "") << "what was accepted once is what it is now";
}

TEST_F(Resume, KeepsAcceptedRunsThatAChangedCampaignWantsNoMore) {
  stop_before(180);
  campaign_ = profiles::parse_campaign(test::short_campaign_text("180", 1, 2), "short.yaml");
  const CampaignResult result = resume(true);
  EXPECT_EQ(result.runs, 5);
  EXPECT_EQ(results_->complete_runs().size(), 5u);
  EXPECT_TRUE(results::verify_campaign(*results_).whole());
}

TEST_F(Resume, RefusesAnotherBenchFile) {
  stop_before(90);
  config_ = test::deterministic_config(3);
  EXPECT_THAT(refusal<ConfigurationError>(), HasSubstr("the bench file has changed"));
  EXPECT_EQ(refusal<ConfigurationError>(true), "");
}

/// The journal as it would be had its first line said something else; its checksums are right.
void retell(const fs::path& path, const char* key, const std::string& value) {
  auto entries = results::read_journal(path).entries;
  fs::remove(path);
  results::Journal journal(path);
  for (auto& entry : entries) {
    if (entry.data.contains(key)) entry.data[key] = value;
    journal.append(entry.event, entry.data, entry.time_ns, entry.utc);
  }
}

TEST_F(Resume, RefusesAnotherProgramMotorLoadCellOrSupplyAndNamesBoth) {
  config_ = test::with_supply(config_);
  stop_before(90);
  const std::string journal = bytes_of(results_->journal());
  for (const auto& [key, words] :
       std::map<const char*, std::string>{{"tool_version", "the program is \""},
                                          {"motor", "the motor module is \""},
                                          {"supply", "the supply is \"simulated supply\""},
                                          {"load_cell", "the load cell is \"calibration "}}) {
    rewrite_journal(journal);
    retell(results_->journal(), key, "another");
    EXPECT_THAT(refusal<ConfigurationError>(), AllOf(HasSubstr(words), HasSubstr(", was \"another\""))) << key;
  }
  EXPECT_EQ(refusal<ConfigurationError>(true), "");
}

TEST_F(Resume, DoesNotMissWhatAnOlderJournalDoesNotKnow) {
  EXPECT_TRUE(changes_since({{"motor", "a"}}, {{"motor", "a"}, {"load_cell", "b"}}).empty());
}

TEST_F(Resume, NeverAcceptsAChangedOrMissingRun) {
  stop_before(90);
  fs::permissions(run_file(0, 1), fs::perms::owner_write, fs::perm_options::add);
  std::ofstream(run_file(0, 1), std::ios::app) << '\0';
  fs::remove(run_file(0, 2));
  const std::string why = refusal<DataRejected>(true);
  EXPECT_THAT(why, AllOf(HasSubstr("phi000_rep1.h5: SHA-256 does not match"), HasSubstr("phi000_rep2.h5: missing")));
}

TEST_F(Resume, RefusesAChangedJournal) {
  stop_before(90);
  std::string text = bytes_of(results_->journal());
  text.replace(text.find("\"lost\":0"), 8, "\"lost\":1");
  rewrite_journal(text);
  EXPECT_THAT(refusal<DataRejected>(true), HasSubstr("does not match its checksum"));
}

TEST_F(Resume, TellsHowToGoOn) {
  person_.refuse_at_deg = 90;
  try {
    (void)begin(*results_);
    FAIL();
  } catch (const NotMounted& stop) {
    EXPECT_THAT(stop.words().data, HasSubstr("--resume " + results_->path().string()));
  }
}

TEST_F(Resume, ContinuesAfterASafetyStopOnlyWhenSomebodyHasClearedIt) {
  const auto limit = campaign_.limits["thrust_max_n"];
  campaign_.limits["thrust_max_n"] = 2.0;
  EXPECT_THROW((void)begin(*results_), SafetyStop);
  campaign_.limits["thrust_max_n"] = limit;
  Resumption stopped = inspect(*results_, true);
  EXPECT_THAT(stopped.state.safety_stop, HasSubstr("is above 2 N"));
  EXPECT_THROW((void)begin(*results_, &stopped), ConfigurationError);
  stopped.cleared_by = "terminal";
  (void)begin(*results_, &stopped);
  EXPECT_EQ(resumed_entry().at("cleared_safety_stop").at("by"), "terminal");
  EXPECT_EQ(inspect(*results_, true).state.safety_stop, "") << "cleared for good";
}

TEST_F(Resume, LeavesFinishedRunsReadOnlyAndVerifyRemarksWhatIsNot) {
  (void)begin(*results_);
  EXPECT_TRUE(results::verify_campaign(*results_).remarks.empty());
  fs::permissions(run_file(90, 1), fs::perms::owner_write, fs::perm_options::add);
  const auto found = results::verify_campaign(*results_);
  EXPECT_TRUE(found.whole());
  EXPECT_THAT(found.remarks, ElementsAre(HasSubstr("runs: 1 of 6 runs are writable")));
}

}  // namespace resume_test
}  // namespace kphi::daq
