// kill -9 at random moments of a campaign in virtual time, as a process: resumed again and again, it ends as if nothing
// had happened.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <map>
#include <random>
#include <thread>

#include "results/campaign_folder.hpp"
#include "test/daq/bench_fixture.hpp"
#include "test/end_to_end/process.hpp"
#include "test/source_dir.hpp"

namespace kphi::test {
namespace killed_campaign_test {

namespace fs = std::filesystem;
using Seconds = std::chrono::duration<double>;

const std::string kBench = kphi::test::source_dir() + "/profiles/bench_deterministic.yaml";
constexpr int kKilled = 128 + SIGKILL;

/// The folder of the one campaign below `out`, once it is there.
std::optional<results::CampaignFolder> folder_below(const fs::path& out) {
  std::optional<results::CampaignFolder> found;
  if (!fs::exists(out)) return found;
  for (const auto& entry : fs::directory_iterator(out)) {
    if (fs::exists(entry.path() / "runs")) found = results::CampaignFolder::open(entry.path());
  }
  return found;
}

std::map<std::string, std::string> measured_in(const results::CampaignFolder& folder) {
  std::map<std::string, std::string> files;
  for (const auto& run : folder.complete_runs()) files[run.filename().string()] = bytes_of(run);
  for (const auto& table : {folder.steps(), folder.means()}) files[table.filename().string()] = bytes_of(table);
  return files;
}

std::size_t files_with(const results::CampaignFolder& folder, const std::string& word) {
  std::size_t n = 0;
  for (const auto& entry : fs::directory_iterator(folder.runs()))
    n += entry.path().filename().string().find(word) != std::string::npos;
  return n;
}

class KilledCampaign : public testing::TestWithParam<int> {
 protected:
  void SetUp() override {
    std::ofstream(folder_ / "campaign.yaml") << short_campaign_text("0, 90, 180", 2, 3);
    const auto begun = std::chrono::steady_clock::now();
    Process run(command(folder_ / "whole"));
    ASSERT_EQ(run.wait(), 0) << run.err();
    whole_takes_ = std::chrono::steady_clock::now() - begun;
    whole_ = measured_in(*folder_below(folder_ / "whole"));
    fit_ = coefficients_of(*folder_below(folder_ / "whole"));
  }
  [[nodiscard]] std::vector<std::string> command(const fs::path& out) const {
    std::vector<std::string> words{
        KPHI_PROGRAM, "run", (folder_ / "campaign.yaml").string(), "--bench", kBench, "--yes", "--out", out.string()};
    if (const auto begun = folder_below(out)) words.insert(words.end(), {"--resume", begun->path().string()});
    return words;
  }
  static std::string coefficients_of(const results::CampaignFolder& folder) {
    Process fit({KPHI_PROGRAM, "fit", folder.path().string()});
    EXPECT_EQ(fit.wait(), 0) << fit.err();
    return bytes_of(folder.coefficients());
  }
  /// Returns how often it was killed on its way to the end.
  int kill_to_the_end(const fs::path& out, int most) {
    int kills = 0;
    for (bool ended = false; !ended;) {
      Process run(command(out));
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
      EXPECT_EQ(state.accepted[i].sha256, accepted_[i].sha256);
    }
    accepted_ = state.accepted;
    const std::size_t complete = folder->complete_runs().size();
    EXPECT_LE(complete - accepted_.size() + files_with(*folder, ".h5.part") - files_with(*folder, ".interrupted"), 1u)
        << "more than the run of the moment is unfinished";
  }

  TemporaryFolder folder_;
  Seconds whole_takes_{0};
  std::map<std::string, std::string> whole_;
  std::string fit_;
  std::mt19937 random_{20210530};
  std::vector<results::AcceptedRun> accepted_;
};

TEST_P(KilledCampaign, ResumedEachTimeGivesTheRunsTheTablesAndTheFitOfOneThatWasNeverKilled) {
  for (int kills = 0, campaign = 1; kills < GetParam(); ++campaign) {
    SCOPED_TRACE(campaign);
    const fs::path out = folder_ / ("killed" + std::to_string(campaign));
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
    Process verify({KPHI_PROGRAM, "verify", folder->path().string()});
    EXPECT_EQ(verify.wait(), 0) << verify.out();
    fs::remove_all(out);
  }
}

INSTANTIATE_TEST_SUITE_P(Kills, KilledCampaign, testing::Values(KPHI_KILLS));

}  // namespace killed_campaign_test
}  // namespace kphi::test
