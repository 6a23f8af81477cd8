#include "results/campaign_folder.hpp"

#include <gmock/gmock.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "results/journal.hpp"
#include "results/reduction/reduction.hpp"
#include "results/run_reader.hpp"
#include "results/steps_csv.hpp"
#include "test/results/recordings.hpp"
#include "test/results/synthetic_run.hpp"
#include "test/temporary_folder.hpp"
#include "test/verb.hpp"

namespace kphi::results::campaign_folder_test {

using kphi::test::Said;
using kphi::test::say;
using kphi::test::TemporaryFolder;
using namespace testing;

std::vector<std::string> names_of(const std::vector<std::filesystem::path>& paths) {
  std::vector<std::string> names;
  for (const auto& path : paths) names.push_back(path.filename().string());
  return names;
}

TEST(CampaignFolder, NamesRunsSoThatTheySort) {
  EXPECT_EQ(run_file_name("5x3", 90, 2), "5x3_phi090_rep2.h5");
  EXPECT_EQ(run_file_name("5x3", 0, 1), "5x3_phi000_rep1.h5");
  EXPECT_EQ(run_file_name("a/b", 22.5, 1), "a_b_phi022.5_rep1.h5");
  EXPECT_EQ(run_file_name("5x3", 0, -2), "5x3_phi000_ref2.h5");
}

TEST(CampaignFolder, TellsReferenceRunsFromRepetitions) {
  const TemporaryFolder parent;
  const auto folder = CampaignFolder::create(parent.path(), "u", "c");
  for (const int repetition : {-10, -2, -1, 1}) std::ofstream(folder.run("5x3_rep7_ref1", 0, repetition)) << "x";
  std::ofstream(folder.runs() / "5x3_phi000_ref3.aborted.h5") << "x";
  EXPECT_THAT(
      names_of(folder.reference_runs()),
      ElementsAre("5x3_rep7_ref1_phi000_ref1.h5", "5x3_rep7_ref1_phi000_ref2.h5", "5x3_rep7_ref1_phi000_ref10.h5"));
  EXPECT_THAT(names_of(folder.complete_runs()), ElementsAre("5x3_rep7_ref1_phi000_rep1.h5"));
  EXPECT_EQ(folder.other_runs().size(), 1u) << "a reference run is complete, too";
}

TEST(CampaignFolder, IsNeverUsedTwice) {
  const TemporaryFolder parent;
  const auto a = CampaignFolder::create(parent.path(), "20210530T080000Z", "my campaign");
  const auto b = CampaignFolder::create(parent.path(), "20210530T080000Z", "my campaign");
  const auto c = CampaignFolder::create(parent.path(), "20210530T080000Z", "my campaign");
  EXPECT_EQ(a.path().filename(), "20210530T080000Z_my_campaign");
  EXPECT_EQ(b.path().filename(), "20210530T080000Z_my_campaign-2");
  EXPECT_EQ(c.path().filename(), "20210530T080000Z_my_campaign-3");
  EXPECT_TRUE(std::filesystem::is_directory(a.runs()));
  EXPECT_TRUE(std::filesystem::is_directory(a.figures()));
  EXPECT_THROW((void)CampaignFolder::open(parent.path()), RecordError);
}

TEST(CampaignFolder, ListsCompleteRunsInCampaignOrder) {
  const TemporaryFolder parent;
  const auto folder = CampaignFolder::create(parent.path(), "u", "c");
  for (const double phi : {0.0, 90.0, 270.0}) {
    for (const int rep : {1, 2, 10}) std::ofstream(folder.run("5x3", phi, rep)) << "x";
  }
  std::ofstream(folder.runs() / "5x3_phi045_rep1.aborted.h5") << "x";
  std::ofstream(folder.runs() / "5x3_phi045_rep1.h5.part") << "x";
  const std::vector<double> order{270, 0, 90};
  EXPECT_THAT(names_of(folder.complete_runs(order)),
              ElementsAre("5x3_phi270_rep1.h5", "5x3_phi270_rep2.h5", "5x3_phi270_rep10.h5", "5x3_phi000_rep1.h5",
                          "5x3_phi000_rep2.h5", "5x3_phi000_rep10.h5", "5x3_phi090_rep1.h5", "5x3_phi090_rep2.h5",
                          "5x3_phi090_rep10.h5"));
  EXPECT_EQ(folder.complete_runs().front().filename(), "5x3_phi000_rep1.h5");
  EXPECT_EQ(folder.other_runs().size(), 2u);
}

class VerifiedCampaign : public ::testing::Test {
 protected:
  void SetUp() override {
    digests_ = test::write_run(run_, test::make_run({}));
    accept({{"sha256", digests_.sha256}, {"contents_xxh128", digests_.contents_xxh128}});
  }
  void accept(nlohmann::json digests) {
    digests["file"] = "runs/" + run_.filename().string();
    Journal(folder_.journal()).append(kRunAccepted, digests, 0, "");
  }
  /// A byte of a text in it, which no checksum of its columns covers.
  void change_the_run() {
    test::make_writable(run_);
    std::string bytes = read_text(run_);
    bytes[bytes.find("5 inch, 3 blades")] = '6';
    std::ofstream(run_, std::ios::binary) << bytes;
  }
  TemporaryFolder parent_;
  CampaignFolder folder_ = CampaignFolder::create(parent_.path(), "u", "c");
  std::filesystem::path run_ = folder_.run("5x3", 90, 2);
  RunDigests digests_;
};

TEST_F(VerifiedCampaign, IsWholeAsItWasLeft) {
  const CampaignVerification found = verify_campaign(folder_);
  EXPECT_THAT(found.problems, IsEmpty());
  EXPECT_EQ(found.runs, 1u);
  EXPECT_EQ(found.entries, 1u);
}

TEST_F(VerifiedCampaign, EveryFlippedByteOfARunShows) {
  test::make_writable(run_);
  const std::string whole = read_text(run_);
  for (std::size_t at = 5; at < whole.size(); at += whole.size() / 12) {
    std::string bytes = whole;
    bytes[at] = static_cast<char>(bytes[at] ^ 0x10);
    std::ofstream(run_, std::ios::binary) << bytes;
    ASSERT_THAT(verify_campaign(folder_).problems, Contains(HasSubstr("SHA-256 does not match the journal"))) << at;
  }
}

TEST_F(VerifiedCampaign, NoCommandTakesARunThatWasChanged) {
  EXPECT_NO_THROW(require_unchanged_run(run_, digests_beside(run_)));
  EXPECT_NO_THROW(require_unchanged_run(run_, {})) << "by its own checksums";
  change_the_run();
  EXPECT_THAT(test::error_of<DataRejected>([&] { require_unchanged_run(run_, digests_beside(run_)); }),
              HasSubstr("SHA-256 does not match the journal; restore it from a copy"));
  std::filesystem::remove(folder_.journal());
  EXPECT_THROW(require_unchanged_run(run_, digests_beside(run_)), DataRejected);
}

TEST_F(VerifiedCampaign, WhatIsReadOfARunIsWhatWasWritten) {
  LoadCellColumns cell;
  const auto digests = digests_beside(run_);
  EXPECT_NO_THROW((void)read_unchanged_run(run_, digests, cell));
  const auto another = folder_.run("5x3", 90, 3);
  test::write_run(another, test::make_run({.seed = 7}));
  std::filesystem::rename(another, run_);
  EXPECT_THAT(test::error_of<DataRejected>([&] { (void)read_unchanged_run(run_, digests, cell); }),
              HasSubstr("SHA-256 does not match the journal; restore it from a copy"));
}

TEST_F(VerifiedCampaign, NoFlippedByteOfARunChangesWhatIsRead) {
  LoadCellColumns cell;
  const auto digests = digests_beside(run_);
  const auto steps = format_steps(reduce(read_unchanged_run(run_, digests, cell), cell));
  test::make_writable(run_);
  const std::string whole = read_text(run_);
  int refused = 0;
  for (std::size_t at = 3; at < whole.size(); at += whole.size() / 300) {
    std::string bytes = whole;
    bytes[at] = static_cast<char>(bytes[at] ^ 0x10);
    std::ofstream(run_, std::ios::binary) << bytes;
    try {
      ASSERT_EQ(format_steps(reduce(read_unchanged_run(run_, digests, cell), cell)), steps) << at;
    } catch (const DataRejected&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 150) << "all but what a reduction does not read";
}

TEST_F(VerifiedCampaign, AnOlderJournalKnowsTheSha256Alone) {
  LoadCellColumns cell;
  std::filesystem::remove(folder_.journal());
  accept({{"sha256", digests_.sha256}});
  EXPECT_NO_THROW((void)read_unchanged_run(run_, digests_beside(run_), cell));
  change_the_run();
  EXPECT_THAT(test::error_of<DataRejected>([&] { (void)read_unchanged_run(run_, digests_beside(run_), cell); }),
              HasSubstr("SHA-256 does not match the journal; restore it from a copy"));
}

TEST_F(VerifiedCampaign, AMissingAndAnUnknownRunShow) {
  std::filesystem::rename(run_, folder_.run("5x3", 90, -1));
  const auto problems = verify_campaign(folder_).problems;
  EXPECT_THAT(problems, Contains(HasSubstr("rep2.h5: missing, but in the journal")));
  EXPECT_THAT(problems, Contains(HasSubstr("ref1.h5: not in the journal")));
}

TEST_F(VerifiedCampaign, WithoutItsJournalItIsNotWhole) {
  std::filesystem::remove(folder_.journal());
  EXPECT_THAT(verify_campaign(folder_).problems, Contains(HasSubstr("journal.jsonl: missing")));
}

TEST_F(VerifiedCampaign, InfoTellsWhatIsInARun) {
  const Said said = say("info " + run_.string());
  EXPECT_EQ(said.code, 0);
  EXPECT_THAT(said.out, HasSubstr("5 inch, 3 blades"));
  const auto json = nlohmann::json::parse(say("info --json " + run_.string()).out);
  EXPECT_EQ(json.at("occlusion_deg"), 90);
  EXPECT_EQ(json.at("steps"), 3);
}

TEST_F(VerifiedCampaign, InfoTellsWhatHappenedToTheStreamAndHowItDid) {
  RunRecording run = test::make_run({});
  run.events.push_back({EventKind::restarted, 3'000'000'000, 12, "3.000 s: the stream began anew"});
  run.health.skew_ppm = 17.25;
  run.motor_counts[2] = 4;
  const auto file = folder_.run("5x3", 180, 1);
  (void)test::write_run(file, run);
  const Said said = say("info " + file.string());
  EXPECT_THAT(said.out, HasSubstr("3.000 s: the stream began anew"));
  EXPECT_THAT(said.out, HasSubstr("17.25"));
  const auto json = nlohmann::json::parse(say("info --json " + file.string()).out);
  EXPECT_EQ(json.at("events").at(0).at("kind"), "restarted");
  EXPECT_EQ(json.at("health").at("skew_ppm"), 17.25);
  EXPECT_EQ(json.at("motor_timeouts"), 4);
  EXPECT_TRUE(json.at("box_bias").is_null()) << "none was taken";
}

TEST_F(VerifiedCampaign, InfoTellsWhatIsInAFolder) {
  std::ofstream(folder_.runs() / "5x3_phi180_rep1.h5.part") << "x";
  EXPECT_THAT(say("info " + folder_.path().string()).out, HasSubstr("runs        1"));
  const auto json = nlohmann::json::parse(say("info --json " + folder_.path().string()).out);
  EXPECT_EQ(json.at("runs").size(), 1u);
  EXPECT_EQ(json.at("not_complete").size(), 1u);
}

TEST_F(VerifiedCampaign, VerifyEndsWith0ForWholeThings) {
  EXPECT_EQ(say("verify " + run_.string()).code, 0);
  const Said said = say("verify --json " + folder_.path().string());
  EXPECT_EQ(said.code, 0);
  EXPECT_EQ(nlohmann::json::parse(said.out).at("whole"), true);
}

TEST_F(VerifiedCampaign, VerifyEndsWith5AndOneLinePerProblem) {
  test::make_writable(run_);
  std::filesystem::resize_file(run_, 1000);
  const Said run = say("verify " + run_.string());
  EXPECT_EQ(run.code, 5);
  EXPECT_EQ(std::count(run.out.begin(), run.out.end(), '\n'), 1);
  const Said folder = say("verify " + folder_.path().string());
  EXPECT_EQ(folder.code, 5);
  EXPECT_EQ(std::count(folder.out.begin(), folder.out.end(), '\n'), 2);
}

}  // namespace kphi::results::campaign_folder_test
