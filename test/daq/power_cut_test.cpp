// At any file operation of a campaign: the program is killed, the power is cut, or the disk refuses. Then it is
// resumed.
#include <set>

#include "daq/campaign/resume.hpp"
#include "test/daq/campaign_on_bench.hpp"
#include "test/daq/model_disk.hpp"

namespace kphi::daq {
namespace power_cut_test {

namespace fs = std::filesystem;

constexpr int kImages = 6;    // that are resumed to the end
constexpr int kGlances = 40;  // at others, whether anything is lost
constexpr int kRefusals = 6;

/// Two occlusions, two steps.
class AnyOperation : public CampaignOnBench {
 protected:
  AnyOperation() {
    config_ = test::deterministic_config(6);
    campaign_ = test::short_campaign("0, 90", 1, 2);
  }
  void run(results::FileLayer& files, const results::CampaignFolder& folder) {
    bench_.emplace(config_, sim::BenchSettings{}, DeterministicBench::Lives::one_run);
    bench_->use_files(files);
    said_.lines.clear();
    (void)go(*bench_, folder);
  }
  /// Runs of which the program has said that they are.
  [[nodiscard]] int accepted() const { return static_cast<int>(said_.count("run  ")); }
  /// The same campaign on another disk, and nothing happens.
  int count_operations() {
    test::ModelDisk disk([](int) {});
    const auto folder = results::CampaignFolder::create(folder_.path(), "whole", "c", disk);
    run(disk, folder);
    whole_ = test::measured_in(folder);
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
    DeterministicBench bench(config_, {}, DeterministicBench::Lives::one_run);
    (void)go(bench, folder, &resumption);
    const auto found = results::verify_campaign(folder);
    EXPECT_TRUE(found.whole()) << testing::PrintToString(found.problems);
    EXPECT_TRUE(test::measured_in(folder) == whole_);
  }

  test::Files whole_;
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
  fs::path folder;
  test::ModelDisk* disk = nullptr;
  test::ModelDisk cut([&](int n) {
    if (folder.empty() || !(moments.contains(n) || glances.contains(n))) return;
    const fs::path dark = folder_.path() / fmt::format("dark-{}", n);
    const std::string when = fmt::format("power cut before operation {}", n);
    disk->cut_power(folder, dark, static_cast<unsigned>(n));
    if (!moments.contains(n)) {
      expect_nothing_lost(dark, accepted(), when);
      fs::remove_all(dark);
      return;
    }
    images.push_back({dark, accepted(), when});
    const fs::path killed = folder_.path() / fmt::format("killed-{}", n);
    fs::copy(folder, killed, fs::copy_options::recursive);
    images.push_back({killed, accepted(), fmt::format("killed before operation {}", n)});
  });
  disk = &cut;
  const auto results = results::CampaignFolder::create(folder_.path(), "cut", "c", cut);
  folder = results.path();
  run(cut, results);
  EXPECT_EQ(accepted(), 2);
  ASSERT_GE(images.size(), 2u * (kImages - 1));
  for (const Image& image : images) expect_resumable(image.path, image.accepted, image.when);
}

TEST_F(AnyOperation, WouldLoseRunsIfFilesWereNotSynced) {
  test::ModelDisk disk([](int) {});
  disk.forgets_syncs = true;
  const auto folder = results::CampaignFolder::create(folder_.path(), "forgotten", "c", disk);
  run(disk, folder);
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
    bool armed = false;
    test::ModelDisk disk([&](int n) {
      if (armed && n >= moment + 2) throw std::system_error(ENOSPC, std::generic_category());
    });
    const auto folder = results::CampaignFolder::create(folder_.path(), fmt::format("full-{}", moment), "c", disk);
    armed = true;
    EXPECT_THAT([&] { run(disk, folder); },
                testing::ThrowsMessage<std::exception>(
                    testing::AllOf(testing::HasSubstr("disk full: "), testing::HasSubstr(folder.path().string()))));
    EXPECT_TRUE(motor_is_let_go());
    expect_resumable(folder.path(), accepted(), "resumed with room");
  }
}

}  // namespace power_cut_test
}  // namespace kphi::daq
