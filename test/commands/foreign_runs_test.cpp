// Run files that somebody else has made or changed, with HDF5's own Python, asked of the program under a limit of
// memory and time.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "test/end_to_end/process.hpp"
#include "test/fit/export/outside_reader.hpp"
#include "test/source_dir.hpp"
#include "test/temporary_folder.hpp"

namespace kphi::test {
namespace foreign_runs_test {

using testing::AnyOf;
namespace fs = std::filesystem;

/// The files of the script whose names begin so, once for all tests here.
std::vector<fs::path> files_of(const std::string& kind) {
  static const TemporaryFolder folder;
  static const bool made = [] {
    const std::string run = source_dir() + "/results/reference/runs/5x3_phi000_rep1.h5";
    return works(fmt::format("/usr/bin/python3 {}/test/results/foreign_runs.py {} {}", source_dir(), run,
                             folder.path().string()));
  }();
  EXPECT_TRUE(made);
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder.path()))
    if (entry.path().filename().string().starts_with(kind)) files.push_back(entry.path());
  return files;
}

class ForeignRuns : public testing::Test {
 protected:
  void SetUp() override {
    if (!works("/usr/bin/python3 -c 'import h5py'")) GTEST_SKIP() << "no python3-h5py";
  }
  static constexpr int kMostKilobytes = 1'000'000;  // of address space
  static constexpr int kMostSeconds = 10;

  /// Each of them is read or refused: no signal, no hang, no word of a library, one line.
  static void expect_answers(const std::vector<fs::path>& files, std::size_t least) {
    EXPECT_GE(files.size(), least);
    for (const fs::path& file : files)
      for (const std::string verb : {"info", "verify", "replay", "export --to csv"}) {
        Process asked({"bash", "-c",
                       fmt::format("ulimit -v {}; exec timeout {} {} {} {} >/dev/null", kMostKilobytes, kMostSeconds,
                                   kphi(), verb, file.string())});
        const int code = asked.wait();
        EXPECT_THAT(code, AnyOf(0, 5)) << verb << " " << file << "\n" << asked.err();
        EXPECT_EQ(asked.err().find("std::"), std::string::npos) << asked.err();
        EXPECT_EQ(asked.err().find('\x1B'), std::string::npos) << asked.err();
        EXPECT_LE(std::ranges::count(asked.err(), '\n'), 3) << asked.err();
      }
  }
};

TEST_F(ForeignRuns, ThatAreCraftedAreRefusedInBoundedMemory) { expect_answers(files_of("crafted_"), 60); }

TEST_F(ForeignRuns, OfChangedBytesAreReadOrRefused) { expect_answers(files_of("mutated_"), 500); }

}  // namespace foreign_runs_test
}  // namespace kphi::test
