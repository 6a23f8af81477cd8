// results/reference was recorded once and must be understood for ever: a reader that changes its mind shows here.
#include "test/daq/campaign_on_bench.hpp"
#include "test/source_dir.hpp"

namespace kphi::daq {
namespace reference_test {

class Reference : public testing::Test {
 protected:
  results::CampaignFolder folder_ =
      results::CampaignFolder::open(std::filesystem::path(kphi::test::source_dir()) / "results/reference");
};

TEST_F(Reference, IsWhole) {
  const auto verification = results::verify_campaign(folder_);
  EXPECT_TRUE(verification.whole()) << verification.problems.front();
  EXPECT_EQ(verification.runs, 3u);
}

TEST_F(Reference, GivesTheStoredStepMeansByteForByte) {
  const auto steps = steps_of(folder_.complete_runs(std::vector<double>{0, 90, 270}));
  ASSERT_EQ(steps.size(), 12u);
  EXPECT_EQ(results::format_steps(steps), results::read_text(folder_.steps()));
  EXPECT_EQ(results::format_steps(means_of(steps)), results::read_text(folder_.means()));
}

}  // namespace reference_test
}  // namespace kphi::daq
