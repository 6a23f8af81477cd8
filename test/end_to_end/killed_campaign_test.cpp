// kill -9 at random moments of a campaign in virtual time, as a process: resumed again and again, it ends as if nothing
// had happened.
#include <gmock/gmock.h>
#include <signal.h>

#include <random>
#include <thread>

#include "test/end_to_end/program.hpp"
#include "test/source_dir.hpp"

namespace kphi::test::killed_campaign_test {

namespace fs = std::filesystem;
using Seconds = std::chrono::duration<double>;

constexpr int kKilled = 128 + SIGKILL;

std::optional<results::CampaignFolder> folder_below(const fs::path& out) { return campaign_below(out, "runs"); }

std::size_t files_with(const results::CampaignFolder& folder, const std::string& word) {
  std::size_t n = 0;
  for (const auto& entry : fs::directory_iterator(folder.runs()))
    n += entry.path().filename().string().find(word) != std::string::npos;
  return n;
}

class KilledCampaign : public testing::TestWithParam<int> {
 protected:
  void SetUp() override {
    const auto begun = std::chrono::steady_clock::now();
    const results::CampaignFolder whole = results::CampaignFolder::open(ran(here_.command()).folder());
    whole_takes_ = std::chrono::steady_clock::now() - begun;
    whole_ = measured_in(whole);
    fit_ = coefficients_of(whole);
  }
  static std::string coefficients_of(const results::CampaignFolder& folder) {
    (void)ran({kphi(), "fit", "--accept", "--no-report", folder.path().string()});
    return bytes_of(folder.coefficients());
  }
  /// Returns how often it was killed on its way to the end.
  int kill_to_the_end(const fs::path& out, int most) {
    int kills = 0;
    for (bool ended = false; !ended;) {
      Process run(here_.resuming_command(out, "runs"));
      if (kills < most) {
        std::this_thread::sleep_for(whole_takes_ * std::uniform_real_distribution<>(0, 0.4)(random_));
        run.signal(SIGKILL);
      }
      const int code = run.wait();
      ended = code == 0;
      EXPECT_TRUE(ended || code == kKilled) << code << run.err();
      if (!ended && code != kKilled) return kills;
      kills += !ended;
      look_at(out);
    }
    return kills;
  }
  /// What was accepted once is there, unchanged; nothing but the run of the moment is unfinished.
  void look_at(const fs::path& out) {
    const auto folder = folder_below(out);
    if (!folder || !fs::exists(folder->journal())) return;
    const auto state = results::state_of(results::read_journal(folder->journal()));
    EXPECT_TRUE(results::changed_runs(*folder, state).empty());
    ASSERT_GE(state.accepted.size(), accepted_.size()) << "an acceptance is lost";
    for (std::size_t i = 0; i < accepted_.size(); ++i) {
      EXPECT_EQ(state.accepted[i].file, accepted_[i].file);
      EXPECT_EQ(state.accepted[i].digests.sha256, accepted_[i].digests.sha256);
    }
    accepted_ = state.accepted;
    const std::size_t complete = folder->complete_runs().size();
    EXPECT_LE(complete - accepted_.size() + files_with(*folder, ".h5.part") - files_with(*folder, ".interrupted"), 1u)
        << "more than the run of the moment is unfinished";
  }

  const VirtualCampaign here_{short_campaign_text("0, 90, 180", 2, 3),
                              bytes_of(source_dir() + "/profiles/bench_deterministic.yaml")};
  Seconds whole_takes_{0};
  Files whole_;
  std::string fit_;
  std::mt19937 random_{20210530};
  std::vector<results::AcceptedRun> accepted_;
};

TEST_P(KilledCampaign, ResumedEachTimeGivesTheRunsTheTablesAndTheFitOfOneThatWasNeverKilled) {
  for (int kills = 0, campaign = 1; kills < GetParam(); ++campaign) {
    SCOPED_TRACE(campaign);
    const fs::path out = here_.path("killed" + std::to_string(campaign));
    accepted_.clear();
    const int killed = kill_to_the_end(out, GetParam() - kills);
    if (HasFailure()) return;
    kills += killed;
    const auto folder = folder_below(out);
    ASSERT_TRUE(folder);
    EXPECT_EQ(accepted_.size(), 6u);
    EXPECT_LE(files_with(*folder, ".interrupted") + files_with(*folder, ".unaccepted"),
              static_cast<std::size_t>(killed))
        << "a kill costs one run at most";
    EXPECT_TRUE(measured_in(*folder) == whole_);
    EXPECT_EQ(coefficients_of(*folder), fit_);
    (void)ran({kphi(), "verify", folder->path().string()});
    fs::remove_all(out);
  }
}

INSTANTIATE_TEST_SUITE_P(Few, KilledCampaign, testing::Values(20));
INSTANTIATE_TEST_SUITE_P(Many, KilledCampaign, testing::Values(200));

}  // namespace kphi::test::killed_campaign_test
