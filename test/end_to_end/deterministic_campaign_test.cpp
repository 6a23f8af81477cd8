// A campaign on the deterministic bench, through the program, twice: the ground on which fault tests stand.
#include <gtest/gtest.h>

#include <map>

#include "test/daq/bench_fixture.hpp"
#include "test/end_to_end/process.hpp"

namespace kphi::test {
namespace {

/// Every file below a folder: relative name → bytes.
std::map<std::string, std::string> contents(const std::filesystem::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file()) files[std::filesystem::relative(entry.path(), folder)] = bytes_of(entry.path());
  }
  return files;
}

std::map<std::string, std::string> campaign_from(int seed) {
  const TemporaryFolder folder;
  const auto path = [&](const char* name) { return (folder.path() / name).string(); };
  std::ofstream(path("campaign.yaml")) << short_campaign_text("0, 90, 180", 2);
  std::ofstream(path("bench.yaml")) << deterministic_place(seed).text;
  Process run(
      {KPHI_PROGRAM, "run", path("campaign.yaml"), "--bench", path("bench.yaml"), "--yes", "--out", path("out")});
  EXPECT_EQ(run.wait(), 0) << run.err();
  Process fit({KPHI_PROGRAM, "fit", run.out().substr(0, run.out().find('\n'))});
  EXPECT_EQ(fit.wait(), 0) << fit.err();
  return contents(path("out"));
}

TEST(DeterministicCampaign, GivesTheSameFilesByteForByteFromOneSeedAndOthersFromAnother) {
  const auto once = campaign_from(5);
  const auto again = campaign_from(5);
  ASSERT_GE(once.size(), 10u);
  for (const auto& [name, bytes] : once) {
    ASSERT_TRUE(again.count(name)) << name;
    EXPECT_TRUE(again.at(name) == bytes) << name << " differs";
  }
  EXPECT_EQ(once.size(), again.size());
  const auto other = campaign_from(6);
  for (const auto& [name, bytes] : once) {
    if (name.ends_with(".h5") || name.ends_with("steps.csv") || name.ends_with("means.csv") ||
        name.ends_with("coefficients.yaml")) {
      EXPECT_FALSE(other.at(name) == bytes) << name << " does not depend on the seed";
    }
  }
}

TEST(DeterministicCampaign, StopsWithExitCodeFourWhenItsFaultScriptTakesTheStreamAway) {
  const TemporaryFolder folder;
  const auto path = [&](const char* name) { return (folder.path() / name).string(); };
  std::ofstream(path("faults.yaml")) << "format: kphi-faults/1\nfaults:\n  - {at_s: 8, kind: stolen}\n";
  std::ofstream(path("campaign.yaml")) << short_campaign_text("0, 90, 180", 2);
  std::ofstream(path("bench.yaml")) << deterministic_place(5, "faults.yaml").text;  // beside the bench file
  Process run(
      {KPHI_PROGRAM, "run", path("campaign.yaml"), "--bench", path("bench.yaml"), "--yes", "--out", path("out")});
  EXPECT_EQ(run.wait(), 4) << run.err();
  EXPECT_NE(run.err().find("another client has taken the stream"), std::string::npos) << run.err();
  EXPECT_NE(run.err().find("1 of 6 runs are finished"), std::string::npos) << run.err();
}

}  // namespace
}  // namespace kphi::test
