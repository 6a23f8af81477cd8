// The program as another process, and what a campaign of it needs.
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "results/campaign_folder.hpp"
#include "test/daq/bench_fixture.hpp"
#include "test/end_to_end/process.hpp"
#include "test/temporary_folder.hpp"

namespace kphi::test {

inline void write(const std::filesystem::path& file, const std::string& text) { std::ofstream(file) << text; }

/// The words of a program that has ended.
struct Ended {
  std::string out, err;
  /// Where `kphi run` has recorded.
  [[nodiscard]] std::string folder() const { return out.substr(0, out.find('\n')); }
};

/// `held`. If it is false, no standstill of this computer excuses that, and the test is not run again: the motor turned
/// for too long, or the power stayed on.
inline bool safely(bool held) {
  if (!held) testing::Test::RecordProperty("stands", "not safe");
  return held;
}

/// Runs the command to its end, and holds that this is its exit code.
inline Ended ran(const std::vector<std::string>& command, int exit_code = 0) {
  Process process(command);
  EXPECT_EQ(process.wait(), exit_code) << fmt::format("{}\n{}{}", fmt::join(command, " "), process.out(),
                                                      process.err());
  return {process.out(), process.err()};
}

inline std::vector<std::string> joined(std::vector<std::string> words, const std::vector<std::string>& more) {
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

/// The command started by a shell, by this line, as `"$@"`.
inline std::vector<std::string> by_shell(const std::string& line, const std::vector<std::string>& command) {
  return joined({"bash", "-c", line, "bash"}, command);
}

/// The folder of the one campaign below `out`, once it holds what is `begun` with.
inline std::optional<results::CampaignFolder> campaign_below(const std::filesystem::path& out, const char* begun) {
  std::error_code none;
  for (const auto& entry : std::filesystem::directory_iterator(out, none))
    if (std::filesystem::exists(entry.path() / begun)) return results::CampaignFolder::open(entry.path());
  return std::nullopt;
}

/// A folder with the files of a campaign in virtual time.
class VirtualCampaign {
 public:
  explicit VirtualCampaign(const std::string& campaign, const std::string& bench = deterministic_config(1).text,
                           const std::filesystem::path& parent = std::filesystem::temp_directory_path())
      : folder_(parent) {
    write("campaign.yaml", campaign);
    write("bench.yaml", bench);
  }
  [[nodiscard]] std::string path(const std::string& name) const { return (folder_ / name).string(); }
  void write(const std::string& name, const std::string& text) const { test::write(path(name), text); }
  [[nodiscard]] std::vector<std::string> command(const std::vector<std::string>& more = {"--yes"}) const {
    return command_into(path("out"), more);
  }
  [[nodiscard]] std::vector<std::string> command_into(const std::filesystem::path& out,
                                                      const std::vector<std::string>& more = {"--yes"}) const {
    return joined({kphi(), "run", path("campaign.yaml"), "--bench", path("bench.yaml"), "--out", out.string()}, more);
  }
  /// Begins a campaign below `out`, or goes on with the one that is there.
  [[nodiscard]] std::vector<std::string> resuming_command(const std::filesystem::path& out, const char* begun) const {
    const auto there = campaign_below(out, begun);
    return command_into(out, there ? std::vector<std::string>{"--yes", "--resume", there->path().string()}
                                   : std::vector<std::string>{"--yes"});
  }

 private:
  TemporaryFolder folder_;
};

}  // namespace kphi::test
