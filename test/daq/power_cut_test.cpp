// At any file operation of a campaign: the program is killed, the power is cut, or the disk refuses. Then it is
// resumed.
#include <gmock/gmock.h>

#include <map>
#include <set>

#include "base/error.hpp"
#include "daq/campaign/campaign_run.hpp"
#include "daq/campaign/resume.hpp"
#include "daq/virtual/deterministic_bench.hpp"
#include "results/campaign_folder.hpp"
#include "results/journal.hpp"
#include "test/daq/model_disk.hpp"

namespace kphi::daq {
namespace power_cut_test {

namespace fs = std::filesystem;

constexpr int kImages = 6;    // that are resumed to the end
constexpr int kGlances = 40;  // at others, whether anything is lost
constexpr int kRefusals = 6;

class Counting final : public Progress {
 public:
  void say(const std::string& line) override { accepted += line.starts_with("run "); }
  int accepted = 0;  ///< runs of which the program has said that they are
};

using test::Files;
using test::measured_in;

/// Two occlusions, two steps.
class AnyOperation : public testing::Test {
 protected:
  void run(results::FileLayer& files, Progress& progress, const results::CampaignFolder& folder) {
    DeterministicBench bench(config_, {}, DeterministicBench::Lives::one_run);
    bench.use_files(files);
    AutoConfirmOperator person;
    (void)run_campaign(bench, campaign_, config_, folder, person, progress, [] { return false; });
  }
  /// The same campaign on another disk, and nothing happens.
  int count_operations() {
    test::ModelDisk disk([](int) {});
    Progress progress;
    const auto folder = results::CampaignFolder::create(folder_.path(), "whole", "c", disk);
    run(disk, progress, folder);
    whole_ = measured_in(folder);
    return disk.operations();
  }
  std::set<int> some_of(int operations, int count) {
    std::mt19937 random(20210530);
    std::set<int> chosen;
    while (static_cast<int>(chosen.size()) < count)
      chosen.insert(static_cast<int>(random() % static_cast<unsigned>(operations)));
    return chosen;
  }
  /// Looking reads the journal and compares every accepted run with its SHA-256.
  void expect_nothing_lost(const fs::path& path, int accepted, const std::string& when) {
    SCOPED_TRACE(when);
    try {
      const Resumption resumption = inspect(results::CampaignFolder::open(path), false);
      EXPECT_GE(static_cast<int>(resumption.state.accepted.size()), accepted) << "an accepted run is lost";
    } catch (const std::exception& error) {
      ADD_FAILURE() << error.what();
    }
  }
  /// To the end, and then it is as if nothing had happened.
  void expect_resumable(const fs::path& path, int accepted, const std::string& when) {
    expect_nothing_lost(path, accepted, when);
    SCOPED_TRACE(when);
    const auto folder = results::CampaignFolder::open(path);
    const Resumption resumption = inspect(folder, false);
    Progress progress;
    AutoConfirmOperator person;
    DeterministicBench bench(config_, {}, DeterministicBench::Lives::one_run);
    (void)run_campaign(
        bench, campaign_, config_, folder, person, progress, [] { return false; }, &resumption);
    const auto found = results::verify_campaign(folder);
    EXPECT_TRUE(found.whole()) << testing::PrintToString(found.problems);
    EXPECT_TRUE(measured_in(folder) == whole_);
  }

  test::TemporaryFolder folder_;
  profiles::BenchConfig config_ = test::deterministic_config(6);
  profiles::Campaign campaign_ = test::short_campaign("0, 90", 1, 2);
  Files whole_;
};

TEST_F(AnyOperation, KilledOrWithoutPowerLosesNoAcceptedRun) {
  const int operations = count_operations();
  const std::set<int> moments = some_of(operations, kImages);
  const std::set<int> glances = some_of(operations, kGlances);
  struct Image {
    fs::path path;
    int accepted;
    std::string when;
  };
  std::vector<Image> images;
  Counting progress;
  fs::path folder;
  test::ModelDisk* disk = nullptr;
  test::ModelDisk cut([&](int n) {
    if (folder.empty() || !(moments.contains(n) || glances.contains(n))) return;
    const fs::path dark = folder_.path() / fmt::format("dark-{}", n);
    const std::string when = fmt::format("power cut before operation {}", n);
    disk->cut_power(folder, dark, static_cast<unsigned>(n));
    if (!moments.contains(n)) {
      expect_nothing_lost(dark, progress.accepted, when);
      fs::remove_all(dark);
      return;
    }
    images.push_back({dark, progress.accepted, when});
    const fs::path killed = folder_.path() / fmt::format("killed-{}", n);
    fs::copy(folder, killed, fs::copy_options::recursive);
    images.push_back({killed, progress.accepted, fmt::format("killed before operation {}", n)});
  });
  disk = &cut;
  const auto results = results::CampaignFolder::create(folder_.path(), "cut", "c", cut);
  folder = results.path();
  run(cut, progress, results);
  EXPECT_EQ(progress.accepted, 2);
  ASSERT_GE(images.size(), 2u * (kImages - 1));
  for (const Image& image : images) expect_resumable(image.path, image.accepted, image.when);
}

TEST_F(AnyOperation, WouldLoseRunsIfFilesWereNotSynced) {
  test::ModelDisk disk([](int) {});
  disk.forgets_syncs = true;
  const auto folder = results::CampaignFolder::create(folder_.path(), "forgotten", "c", disk);
  Counting progress;
  run(disk, progress, folder);
  int lost = 0;
  for (unsigned seed = 1; seed <= 8; ++seed) {
    const fs::path dark = folder_.path() / fmt::format("dark-{}", seed);
    disk.cut_power(folder.path(), dark, seed);
    try {
      lost += static_cast<int>(inspect(results::CampaignFolder::open(dark), false).state.accepted.size()) < 2;
    } catch (const DataRejected&) {
      ++lost;
    }
  }
  EXPECT_GE(lost, 6) << "the model is no model of a power cut";
}

TEST_F(AnyOperation, RefusedStopsTheMotorSaysWhyAndCanBeResumed) {
  const int operations = count_operations();
  for (const int moment : some_of(operations - 3, kRefusals)) {
    SCOPED_TRACE(moment);
    Counting progress;
    bool armed = false;
    test::ModelDisk disk([&](int n) {
      if (armed && n >= moment + 2) throw std::system_error(ENOSPC, std::generic_category());
    });
    const auto folder = results::CampaignFolder::create(folder_.path(), fmt::format("full-{}", moment), "c", disk);
    armed = true;
    DeterministicBench bench(config_, {}, DeterministicBench::Lives::one_run);
    bench.use_files(disk);
    AutoConfirmOperator person;
    EXPECT_THAT([&] { (void)run_campaign(bench, campaign_, config_, folder, person, progress, [] { return false; }); },
                testing::ThrowsMessage<std::exception>(
                    testing::AllOf(testing::HasSubstr("disk full: "), testing::HasSubstr(folder.path().string()))));
    EXPECT_TRUE(test::motor_is_let_go(bench));
    expect_resumable(folder.path(), progress.accepted, "resumed with room");
  }
}

}  // namespace power_cut_test
}  // namespace kphi::daq
