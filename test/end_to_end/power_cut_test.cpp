// The power is cut under a campaign: what its file system's device holds at that moment is copied and mounted anew.
#include <gmock/gmock.h>
#include <signal.h>
#include <unistd.h>

#include <random>
#include <set>

#include "base/error.hpp"
#include "daq/campaign/resume.hpp"
#include "results/run_reader.hpp"
#include "test/end_to_end/mounted_image.hpp"
#include "test/end_to_end/program.hpp"
#include "test/source_dir.hpp"

namespace kphi::test::power_cut_test {

namespace fs = std::filesystem;

constexpr int kRuns = 6;
constexpr int kCuts = 8;             // at any write to the device
constexpr std::size_t kResumed = 3;  // of all copies
constexpr unsigned kSeed = 20210530;

constexpr const char* kBegun = "journal.jsonl";

/// A config where loop devices cost least.
fs::path memory() { return ::access("/dev/shm", W_OK) == 0 ? "/dev/shm" : fs::temp_directory_path(); }

struct Copy {
  fs::path image;
  int announced = 0;  ///< runs of which the program had said that they are accepted
  std::string when;
};

class PowerCut : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override {
    try {
      have_own_mounts();
      make_file_system(folder_ / "image", GetParam());
      disk_.emplace(folder_ / "image", GetParam(), folder_ / "disk");
    } catch (const MountError& error) {
      GTEST_SKIP() << "no " << GetParam() << " to cut the power of: " << error.what();
    }
  }
  [[nodiscard]] std::vector<std::string> command(const fs::path& out) const {
    return here_.resuming_command(out, kBegun);
  }

  /// Nobody cuts anything: what is to be there in the end, and how many writes that takes.
  void run_whole() {
    const std::uint64_t before = disk_->writes();
    const std::string folder = ran(command(disk_->path() / "whole")).folder();
    writes_ = disk_->writes() - before;
    whole_ = measured_in(results::CampaignFolder::open(folder));
    ASSERT_EQ(whole_.size(), kRuns + 2u);
  }

  static int announced_in(const std::string& words) {
    int runs = 0;
    for (std::size_t at = 0; (at = words.find("\nrun ", at)) != std::string::npos; ++at) ++runs;
    return runs;
  }

  void cut(Process& run, const std::string& when) {
    run.signal(SIGSTOP);
    (void)run.hear();
    Copy copy{folder_ / fmt::format("copy-{}", copies_.size()), announced_in(run.err()), when};
    disk_->cut_power(copy.image);
    run.signal(SIGCONT);
    copies_.push_back(copy);
  }

  /// Right after each announcement, and at any write in between.
  void run_and_cut() {
    std::mt19937 random(kSeed);
    std::set<std::uint64_t> moments;
    const std::uint64_t begun = disk_->writes();
    while (moments.size() < kCuts) moments.insert(begun + random() % std::max<std::uint64_t>(writes_, 2 * kCuts));
    Process run(command(disk_->path() / "out"));
    for (int announced = 0; run.hear(std::chrono::milliseconds(1));) {
      const int now = announced_in(run.err());
      if (now > announced) cut(run, fmt::format("after run {} was announced", now));
      announced = std::max(now, announced);
      const std::uint64_t writes = disk_->writes();
      if (!moments.empty() && writes >= *moments.begin()) {
        cut(run, fmt::format("after write {} of {}", writes - begun, writes_));
        while (!moments.empty() && *moments.begin() <= writes) moments.erase(moments.begin());
      }
    }
    ASSERT_EQ(run.wait(), 0) << run.err();
  }

  /// How many runs are accepted there, all of them whole.
  static int accepted_in(const fs::path& out) {
    const auto folder = campaign_below(out, kBegun);
    if (!folder) return 0;
    const daq::Resumption found = daq::inspect(*folder, false);  // compares each with its SHA-256
    for (const auto& run : found.state.accepted) {
      const auto verification = results::verify_run(folder->path() / run.file);
      EXPECT_TRUE(verification.whole()) << run.file << testing::PrintToString(verification.problems);
    }
    return static_cast<int>(found.state.accepted.size());
  }

  void expect_as_if_nothing_had_happened(const fs::path& out) {
    const std::string folder = ran(command(out)).folder();
    EXPECT_TRUE(measured_in(results::CampaignFolder::open(folder)) == whole_);
    (void)ran({kphi(), "verify", folder});
  }

  const std::string bench_ = bytes_of(source_dir() + "/profiles/bench_deterministic.yaml");
  const VirtualCampaign here_{short_campaign_text("0, 90, 180", 2, 3), bench_ + "  durable: true\n"};
  const TemporaryFolder folder_{memory()};
  std::optional<MountedImage> disk_;
  std::uint64_t writes_ = 0;
  Files whole_;
  std::vector<Copy> copies_;
};

TEST_P(PowerCut, LosesNoRunThatWasAnnouncedAndTheCampaignGoesOn) {
  run_whole();
  if (HasFailure()) return;
  run_and_cut();
  std::mt19937 random(kSeed);
  std::set<std::size_t> resumed;
  while (resumed.size() < std::min(kResumed, copies_.size())) resumed.insert(random() % copies_.size());
  int unfinished = 0;
  for (std::size_t i = 0; i < copies_.size(); ++i) {
    SCOPED_TRACE(copies_[i].when);
    const MountedImage rebooted(copies_[i].image, GetParam(), folder_ / "rebooted");
    const int accepted = accepted_in(rebooted.path() / "out");
    EXPECT_GE(accepted, copies_[i].announced) << "an accepted run is lost";
    unfinished += accepted < kRuns;
    if (resumed.contains(i)) expect_as_if_nothing_had_happened(rebooted.path() / "out");
  }
  EXPECT_GE(unfinished, 1) << "the power was cut when all was over";
}

TEST_P(PowerCut, WouldLoseRunsIfFilesWereNotSynced) {
  here_.write("bench.yaml", bench_);
  Process run(command(disk_->path() / "out"));
  run.wait_for(fmt::format("run  {}/{}", kRuns, kRuns));
  cut(run, "at the end");
  ASSERT_EQ(run.wait(), 0) << run.err();
  const MountedImage rebooted(copies_.front().image, GetParam(), folder_ / "rebooted");
  int accepted = 0;
  try {
    accepted = accepted_in(rebooted.path() / "out");
  } catch (const DataRejected&) {
  }
  EXPECT_LT(accepted, kRuns) << "the copy holds what no power cut would have left";
}

INSTANTIATE_TEST_SUITE_P(Of, PowerCut, testing::Values("ext4", "xfs"), [](const auto& kind) { return kind.param; });

}  // namespace kphi::test::power_cut_test
