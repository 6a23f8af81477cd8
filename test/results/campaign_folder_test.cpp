#include "results/campaign_folder.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "results/journal.hpp"
#include "test/results/recordings.hpp"
#include "test/results/synthetic_run.hpp"
#include "test/temporary_folder.hpp"

namespace kphi::results {
namespace campaign_folder_test {

using kphi::test::TemporaryFolder;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

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
  std::vector<std::string> names;
  for (const auto& path : folder.reference_runs()) names.push_back(path.filename().string());
  EXPECT_THAT(names, ElementsAre("5x3_rep7_ref1_phi000_ref1.h5", "5x3_rep7_ref1_phi000_ref2.h5",
                                 "5x3_rep7_ref1_phi000_ref10.h5"));
  ASSERT_EQ(folder.complete_runs().size(), 1u);
  EXPECT_EQ(folder.complete_runs()[0].filename(), "5x3_rep7_ref1_phi000_rep1.h5");
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
  std::vector<std::string> names;
  for (const auto& path : folder.complete_runs(order)) names.push_back(path.filename().string());
  EXPECT_THAT(names, ElementsAre("5x3_phi270_rep1.h5", "5x3_phi270_rep2.h5", "5x3_phi270_rep10.h5",
                                 "5x3_phi000_rep1.h5", "5x3_phi000_rep2.h5", "5x3_phi000_rep10.h5",
                                 "5x3_phi090_rep1.h5", "5x3_phi090_rep2.h5", "5x3_phi090_rep10.h5"));
  EXPECT_EQ(folder.complete_runs().front().filename(), "5x3_phi000_rep1.h5");
  EXPECT_EQ(folder.other_runs().size(), 2u);
}

class VerifiedCampaign : public ::testing::Test {
 protected:
  void SetUp() override {
    const std::string sha = test::write_run(run_, test::make_run({}));
    Journal(folder_.journal())
        .append(kRunAccepted, {{"file", "runs/" + run_.filename().string()}, {"sha256", sha}}, 0, "");
  }
  TemporaryFolder parent_;
  CampaignFolder folder_ = CampaignFolder::create(parent_.path(), "u", "c");
  std::filesystem::path run_ = folder_.run("5x3", 90, 2);
};

TEST_F(VerifiedCampaign, IsWholeAsItWasLeft) {
  const CampaignVerification found = verify_campaign(folder_);
  EXPECT_THAT(found.problems, IsEmpty());
  EXPECT_EQ(found.runs, 1u);
  EXPECT_EQ(found.entries, 1u);
}

TEST_F(VerifiedCampaign, EveryFlippedByteOfARunShows) {
  std::filesystem::permissions(run_, std::filesystem::perms::owner_write, std::filesystem::perm_options::add);
  const std::string whole = read_text(run_);
  for (std::size_t at = 5; at < whole.size(); at += whole.size() / 12) {
    std::string bytes = whole;
    bytes[at] = static_cast<char>(bytes[at] ^ 0x10);
    std::ofstream(run_, std::ios::binary) << bytes;
    ASSERT_THAT(verify_campaign(folder_).problems, Contains(HasSubstr("SHA-256 does not match the journal"))) << at;
  }
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

}  // namespace campaign_folder_test
}  // namespace kphi::results
