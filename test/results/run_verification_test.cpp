#include <gmock/gmock.h>
#include <sys/stat.h>

#include <fstream>

#include "results/run_reader.hpp"
#include "results/run_writer.hpp"
#include "test/results/recordings.hpp"
#include "test/results/synthetic_run.hpp"

namespace kphi::results::run_verification_test {

using namespace test;
using namespace testing;

class VerifiedRun : public ::testing::Test {
 protected:
  /// Problems of the run, written as aborted, so that finish() does not refuse it.
  std::vector<std::string> problems_of(RunRecording written) {
    written.outcome = Outcome::aborted;
    std::filesystem::remove(folder_ / "a.aborted.h5");
    write_run(path_, written);
    return verify_run(folder_ / "a.aborted.h5").problems;
  }
  /// Writes the run as finished.
  [[nodiscard]] std::string bytes_of(const RunRecording& written) const {
    write_run(path_, written);
    make_writable(path_);
    return read_text(path_);
  }
  void put(const std::string& bytes) const { std::ofstream(path_, std::ios::binary) << bytes; }
  TemporaryFolder folder_;
  const std::filesystem::path path_ = folder_ / "a.h5";
  RunRecording run = make_run({});
};

TEST_F(VerifiedRun, WithCountedLossesIsWhole) {
  Truth truth;
  truth.lose = [](std::uint64_t n) { return n % 1000 == 500 || (n > 3000 && n < 3050); };
  run = make_run(truth);
  write_run(path_, run);
  const Verification found = verify_run(path_);
  EXPECT_TRUE(found.whole()) << ::testing::PrintToString(found.problems);
  EXPECT_EQ(found.lost, run.account.lost_network);
  EXPECT_GT(found.lost, 50u);
}

TEST_F(VerifiedRun, FlippedBytesInTheSamplesShow) {
  std::string bytes = bytes_of(run);
  // The bytes of row 4321 of counts, found by their value.
  const std::string row(reinterpret_cast<const char*>(run.load_cell[4321].counts.data()), 24);
  const std::size_t at = bytes.find(row);
  ASSERT_NE(at, std::string::npos);
  bytes[at + 8] = static_cast<char>(bytes[at + 8] ^ 1);
  put(bytes);
  EXPECT_THAT(verify_run(path_).problems, Contains(HasSubstr("load_cell/counts does not match its checksum")));
}

TEST_F(VerifiedRun, FlippedBytesAnywhereNeitherCrashNorGiveOtherSamples) {
  const std::string whole = bytes_of(run);
  std::mt19937_64 random(11);
  int noticed = 0;
  for (int trial = 0; trial < 60; ++trial) {
    std::string bytes = whole;
    // Half of them in the first 64 KiB, where most of the structure lies.
    const std::size_t at = random() % (trial % 2 == 0 ? 65536 : bytes.size());
    bytes[at] = static_cast<char>(bytes[at] ^ (1 << (random() % 8)));
    put(bytes);
    if (!verify_run(path_).whole()) {
      ++noticed;
      continue;
    }
    const RunRecording again = read_run(path_);
    EXPECT_TRUE(same_rows(run.load_cell, again.load_cell)) << "byte " << at;
    EXPECT_TRUE(same_rows(run.motor, again.motor)) << "byte " << at;
    EXPECT_EQ(digest(run), digest(again)) << "byte " << at;
  }
  EXPECT_GT(noticed, 20);
}

TEST_F(VerifiedRun, ChangedAttributesShow) {
  std::string bytes = bytes_of(run);
  const std::size_t at = bytes.find("5 inch, 3 blades");
  ASSERT_NE(at, std::string::npos);
  bytes[at] = '6';
  put(bytes);
  EXPECT_FALSE(verify_run(path_).whole());
}

TEST_F(VerifiedRun, AMissingSampleShows) {
  run.load_cell.erase(run.load_cell.begin() + 777);
  EXPECT_THAT(problems_of(run), Contains(HasSubstr("were received")));
  run.account.received -= 1;
  run.account.expected -= 1;
  EXPECT_THAT(problems_of(run), Contains("ft_sequence shows 1 missing samples, 0 were counted"));
}

TEST_F(VerifiedRun, ADoubledSampleARebootAndALeftStrideShow) {
  run.load_cell[100] = run.load_cell[99];
  EXPECT_THAT(problems_of(run), Contains(HasSubstr("occur twice")));
  run = make_run({});
  for (std::uint32_t i = 0; i < run.load_cell.size(); ++i) run.load_cell[i].ft_sequence = 7 * (i % 5000);
  EXPECT_THAT(problems_of(run), Contains(HasSubstr("the box restarted")));
  run = make_run({});
  run.load_cell[100].ft_sequence += 1;
  EXPECT_THAT(problems_of(run), Contains(HasSubstr("left its stride")));
  run.events.push_back({EventKind::configuration_changed, 0, 0, ""});
  EXPECT_THAT(problems_of(run), testing::IsEmpty()) << "it may have another one";
}

/// The counting stays a whole number of records where the box left out samples between two of them, or began anew.
TEST_F(VerifiedRun, AGapThatIsNoMultipleOfTheStrideIsWholeWhenItWasCounted) {
  for (std::size_t i = 1000; i < run.load_cell.size(); ++i) run.load_cell[i].ft_sequence += 25;  // 4.6 strides
  run.account.lost_network += 3, run.account.lost_host += 1;
  run.account.expected += 4;
  run.account.irregular += 1;
  EXPECT_THAT(problems_of(run), testing::IsEmpty());
}

TEST_F(VerifiedRun, AStreamThatBeginsAnewAtAnySampleOfTheBoxIsWhole) {
  const std::uint32_t first = run.load_cell[2000].rdt_sequence - 1;
  for (std::size_t i = 2000; i < run.load_cell.size(); ++i) {
    run.load_cell[i].ft_sequence += 3;
    run.load_cell[i].rdt_sequence -= first;
  }
  run.account.restarts += 1;
  EXPECT_THAT(problems_of(run), testing::IsEmpty());
  std::swap(run.account.restarts, run.account.reboots);
  EXPECT_THAT(problems_of(run), testing::IsEmpty()) << "before the wrap of its counter the box's looks like that";
  run.account.reboots = 0;
  EXPECT_THAT(problems_of(run), Contains(HasSubstr("restarted 1 times, 0")));
}

TEST_F(VerifiedRun, WithARestartOfTheBoxThatWasCountedIsWhole) {
  for (std::size_t i = 0; i < run.load_cell.size(); ++i)
    run.load_cell[i].ft_sequence = static_cast<std::uint32_t>(7 * (i < 5000 ? i : i - 5000));
  run.account.reboots = 1;
  run.account.lost_network += 3, run.account.expected += 3;  // while it restarted; ft_sequence does not show them
  write_run(path_, run);
  EXPECT_TRUE(verify_run(path_).whole()) << ::testing::PrintToString(verify_run(path_).problems);
}

TEST_F(VerifiedRun, ATruncatedFileShows) {
  const std::uintmax_t size = bytes_of(run).size();
  for (const std::uintmax_t left : {size - 1, size / 2, std::uintmax_t{1000}, std::uintmax_t{0}}) {
    std::filesystem::resize_file(path_, left);
    EXPECT_FALSE(verify_run(path_).whole()) << left;
    EXPECT_THROW((void)read_run(path_), RecordError) << left;
  }
}

TEST_F(VerifiedRun, AStrangeScaleShows) {
  run.header.load_cell.counts_per_newton = 0;
  EXPECT_THAT(problems_of(run), Contains("counts_per_newton is 0"));
  run = make_run({});
  run.header.load_cell.device_rate_hz = 5000;
  EXPECT_THAT(problems_of(run), Contains(HasSubstr("is not the box's")));
  run.header.thrust_axis = -1, run.header.spin = 0, run.header.clock_gain = HUGE_VAL;
  EXPECT_THAT(problems_of(run), testing::IsSupersetOf({"thrust_axis is -1", "spin is 0", "clock_gain is inf"}));
}

TEST_F(VerifiedRun, WhatIsNoRunFileIsSaidToBeNone) {
  std::ofstream(path_) << "not a run";
  EXPECT_THAT(verify_run(path_).problems, Contains(HasSubstr(path_.string())));
  EXPECT_THROW((void)read_run(folder_ / "nothing.h5"), RecordError);
  ASSERT_EQ(::mkfifo((folder_ / "pipe.h5").c_str(), 0600), 0);
  EXPECT_THAT(verify_run(folder_ / "pipe.h5").problems, Contains(HasSubstr("a pipe"))) << "and nobody waits for it";
}

}  // namespace kphi::results::run_verification_test
