#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstring>
#include <fstream>
#include <random>
#include <system_error>

#include "results/run_layout.hpp"
#include "results/run_reader.hpp"
#include "results/run_writer.hpp"
#include "results/sha256.hpp"
#include "test/results/synthetic_run.hpp"

namespace kphi::results {
namespace {

using test::make_run;
using test::TemporaryFolder;
using test::Truth;
using test::write_pieces;
using test::write_run;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::StartsWith;

bool same(const LoadCellRecord& a, const LoadCellRecord& b) {
  return a.counts == b.counts && a.rdt_sequence == b.rdt_sequence && a.ft_sequence == b.ft_sequence &&
         a.status == b.status && a.arrival_ns == b.arrival_ns;
}

bool same(const MotorReading& a, const MotorReading& b) {
  return a.channel == b.channel && a.time_ns == b.time_ns && a.uncertainty_ns == b.uncertainty_ns && a.value == b.value;
}

bool same(const PhaseMark& a, const PhaseMark& b) {
  return a.phase == b.phase && a.step == b.step && a.time_ns == b.time_ns && a.speed_rad_s == b.speed_rad_s;
}

template <class Row>
bool same_rows(const std::vector<Row>& a, const std::vector<Row>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const Row& x, const Row& y) { return same(x, y); });
}

std::string digest(const RunRecording& run) { return attributes_digest(run.header, run); }

void make_writable(const std::filesystem::path& path) {
  std::filesystem::permissions(path, std::filesystem::perms::owner_write, std::filesystem::perm_options::add);
}

TEST(RunFile, ReadsBackAsWritten) {
  const TemporaryFolder folder;
  const RunRecording run = make_run({});
  write_run(folder / "a.h5", run);
  const RunRecording again = read_run(folder / "a.h5");
  EXPECT_TRUE(same_rows(run.load_cell, again.load_cell));
  EXPECT_TRUE(same_rows(run.motor, again.motor));
  EXPECT_TRUE(same_rows(run.phases, again.phases));
  EXPECT_EQ(digest(run), digest(again));
  EXPECT_EQ(again.header.operator_name, "Zoë");
  EXPECT_EQ(again.header.load_cell.configuration_xml.size(), 70000u);
  EXPECT_EQ(read_header(folder / "a.h5").uuid, run.header.uuid);
}

/// Of a run file, what its columns say against its records.
void expect_same_columns(const std::filesystem::path& path) {
  const RunRecording whole = read_run(path);
  const RunFile file = open_run(path);
  EXPECT_TRUE(file.run.load_cell.empty());
  EXPECT_EQ(file.run.phases.size(), whole.phases.size());
  EXPECT_EQ(file.run.motor.size(), whole.motor.size());
  ASSERT_EQ(file.load_cell->size(), whole.load_cell.size());
  const auto ft = file.load_cell->ft_sequence();
  std::vector<Nanoseconds> arrival(whole.load_cell.size());
  file.load_cell->read_arrival(0, arrival);
  for (const std::size_t n : {std::size_t{1}, std::size_t{3000}, whole.load_cell.size()}) {
    for (std::size_t first = 0; first + n <= whole.load_cell.size(); first += n + 777) {
      const LoadCellRows rows = file.load_cell->rows(first, first + n);
      for (std::size_t i = 0; i < n; ++i) {
        const LoadCellRecord& record = whole.load_cell[first + i];
        ASSERT_TRUE(
            same(record, {rows.counts[i], record.rdt_sequence, ft[first + i], rows.status[i], arrival[first + i]}))
            << first << " + " << i;
      }
    }
  }
}

TEST(RunFile, GivesItsColumnsWithoutTheRecords) {
  const TemporaryFolder folder;
  Truth truth;
  truth.rate_hz = 7000;
  write_run(folder / "a.h5", make_run(truth));
  expect_same_columns(folder / "a.h5");
}

TEST(RunFile, GivesItsColumnsOfAPart) {
  const TemporaryFolder folder;
  const RunRecording run = make_run({});
  {
    RunWriter writer(folder / "a.h5", run.header);
    write_pieces(writer, run);
  }
  expect_same_columns(folder / "a.h5.part");
}

TEST(RunFile, SaysWhereItEndsTooEarlyForItsColumns) {
  const TemporaryFolder folder;
  const auto path = folder / "a.h5";
  Truth truth;
  truth.rate_hz = 7000;
  write_run(path, make_run(truth));
  const RunFile file = open_run(path);
  std::filesystem::permissions(path, std::filesystem::perms::owner_write, std::filesystem::perm_options::add);
  std::filesystem::resize_file(path, std::filesystem::file_size(path) / 2);
  try {
    (void)file.load_cell->rows(0, file.load_cell->size());
    FAIL() << "half of it is gone";
  } catch (const RecordError& error) {
    EXPECT_THAT(error.what(), HasSubstr("a.h5: read counts: the file ends before it"));
  }
}

TEST(RunFile, KeepsWhatHappenedToTheStreamItsHealthAndTheBoxesBias) {
  const TemporaryFolder folder;
  RunRecording run = make_run({});
  run.header.load_cell.slots_json = "{\"netftapi2.xml?index=0\": \"<netft/>\"}";
  for (std::size_t kind = 0; kind < kEventNames.size(); ++kind) {
    run.events.push_back({static_cast<EventKind>(kind), 1000 + static_cast<Nanoseconds>(kind), kind,
                          std::string(kind == 3 ? 2 * kEventTextBytes : kind, 'e')});
  }
  run.account.reordered = 5;
  run.health.skew_ppm = -31.5;
  run.health.queue_high_water = 412;
  run.box_bias = {7000, {1, 2, 3, 4, 5, 6}, {}, {}, {0, 0, 0, 0, 0, 0.25}};
  write_run(folder / "a.h5", run);
  EXPECT_TRUE(verify_run(folder / "a.h5").whole());
  const RunRecording again = read_run(folder / "a.h5");
  EXPECT_EQ(digest(run), digest(again));
  EXPECT_EQ(again.header.load_cell.slots_json, run.header.load_cell.slots_json);
  EXPECT_EQ(again.health.skew_ppm, -31.5);
  EXPECT_EQ(again.box_bias.after_sd[5], 0.25);
  ASSERT_EQ(again.events.size(), run.events.size());
  for (std::size_t i = 0; i < run.events.size(); ++i) {
    EXPECT_EQ(again.events[i].kind, run.events[i].kind);
    EXPECT_EQ(again.events[i].time_ns, run.events[i].time_ns);
    EXPECT_EQ(again.events[i].records, run.events[i].records);
    EXPECT_EQ(again.events[i].text, run.events[i].text.substr(0, kEventTextBytes));
  }
}

TEST(RunFile, IsReadOnlyUnderItsFinalNameWithTheDigestThatFinishGave) {
  const TemporaryFolder folder;
  const std::string sha = write_run(folder / "a.h5", make_run({}));
  EXPECT_FALSE(std::filesystem::exists(folder / "a.h5.part"));
  EXPECT_EQ(sha, sha256_of_file(folder / "a.h5"));
  struct stat info {};
  ASSERT_EQ(stat((folder / "a.h5").c_str(), &info), 0);
  EXPECT_EQ(info.st_mode & 0222u, 0u);
}

TEST(RunFile, SameInputGivesSameBytesInAnotherProcess) {
  const TemporaryFolder folder;
  const RunRecording run = make_run({});
  write_run(folder / "a.h5", run);
  const pid_t child = fork();
  if (child == 0) {
    // Other heap contents and another time of day must not show in the file.
    std::vector<std::string> rubbish(1000, std::string(997, '\xA5'));
    rubbish.clear();
    sleep(1);
    write_run(folder / "b.h5", run);
    _exit(0);
  }
  int status = 0;
  waitpid(child, &status, 0);
  ASSERT_EQ(status, 0);
  EXPECT_EQ(sha256_of_file(folder / "a.h5"), sha256_of_file(folder / "b.h5"));
}

TEST(RunFile, NeverOverwritesAFinalFile) {
  const TemporaryFolder folder;
  const RunRecording run = make_run({});
  const std::string sha = write_run(folder / "a.h5", run);
  try {
    RunWriter writer(folder / "a.h5", run.header);
    FAIL() << "was accepted";
  } catch (const RecordError& error) {
    EXPECT_THAT(error.what(), HasSubstr("exists already"));
  }
  EXPECT_EQ(sha, sha256_of_file(folder / "a.h5"));
}

TEST(RunFile, DoesNotReplaceAFileThatAppearedMeanwhile) {
  const TemporaryFolder folder;
  const RunRecording run = make_run({});
  RunWriter writer(folder / "a.h5", run.header);
  write_pieces(writer, run);
  std::ofstream(folder / "a.h5") << "mine";
  EXPECT_THROW((void)writer.finish(run), RecordError);
  EXPECT_EQ(std::filesystem::file_size(folder / "a.h5"), 4u);
  EXPECT_TRUE(std::filesystem::exists(folder / "a.h5.part"));
}

TEST(RunFile, SetsAnInterruptedPartAside) {
  const TemporaryFolder folder;
  const RunRecording run = make_run({});
  {
    RunWriter dies(folder / "a.h5", run.header);
    dies.append(std::span<const LoadCellRecord>(run.load_cell).first(100));
  }
  write_run(folder / "a.h5", run);
  EXPECT_TRUE(verify_run(folder / "a.h5").whole());
  EXPECT_TRUE(std::filesystem::exists(folder / "a.interrupted.h5.part"));
}

TEST(RunFile, AbortedRunsKeepTheirReasonAndNeverReplaceEachOther) {
  const TemporaryFolder folder;
  RunRecording run = make_run({});
  run.outcome = Outcome::aborted;
  run.outcome_reason = "coil temperature above 80 °C";
  write_run(folder / "a.h5", run);
  write_run(folder / "a.h5", run);
  EXPECT_FALSE(std::filesystem::exists(folder / "a.h5"));
  EXPECT_TRUE(std::filesystem::exists(folder / "a.aborted-2.h5"));
  const RunRecording again = read_run(folder / "a.aborted.h5");
  EXPECT_EQ(again.outcome, Outcome::aborted);
  EXPECT_EQ(again.outcome_reason, run.outcome_reason);
  EXPECT_TRUE(verify_run(folder / "a.aborted.h5").whole());
}

TEST(RunFile, DestructorLeavesAReadablePart) {
  const TemporaryFolder folder;
  const RunRecording run = make_run({});
  {
    RunWriter writer(folder / "a.h5", run.header);
    write_pieces(writer, run);
  }
  const RunRecording again = read_run(folder / "a.h5.part");
  EXPECT_TRUE(same_rows(run.load_cell, again.load_cell));
  EXPECT_EQ(again.outcome, Outcome::aborted);
  EXPECT_THAT(verify_run(folder / "a.h5.part").problems, Contains(HasSubstr("stopped before the end")));
}

TEST(RunFile, FinishRefusesARunWhoseLossesDoNotAddUp) {
  const TemporaryFolder folder;
  RunRecording run = make_run({});
  run.load_cell.erase(run.load_cell.begin() + 1000);
  run.account.received -= 1;
  run.account.expected -= 1;
  try {
    write_run(folder / "a.h5", run);
    FAIL() << "was accepted";
  } catch (const RecordError& error) {
    EXPECT_THAT(error.what(), HasSubstr("1 missing samples where 0 were counted"));
  }
  EXPECT_FALSE(std::filesystem::exists(folder / "a.h5"));
  EXPECT_TRUE(std::filesystem::exists(folder / "a.h5.part"));
}

TEST(RunFile, WithoutRoomNothingBegins) {
  class Tiny : public FileLayer {
    std::uint64_t free_bytes(const std::filesystem::path&) override { return 1000; }
  } tiny;
  EXPECT_NO_THROW(require_room("/somewhere", 1000, tiny));
  try {
    require_room("/somewhere", RunWriter::bytes_needed(560000, 20000), tiny);
    FAIL() << "was accepted";
  } catch (const RecordError& error) {
    EXPECT_THAT(error.what(), StartsWith("disk full: /somewhere: "));
  }
}

TEST(RunFile, BytesNeededAreEnoughButNotFarOff) {
  const TemporaryFolder folder;
  Truth truth;
  truth.rate_hz = 7000;
  truth.ft_stride = 1;
  const RunRecording run = make_run(truth);
  write_run(folder / "a.h5", run);
  const std::uint64_t needed = RunWriter::bytes_needed(run.load_cell.size(), run.motor.size());
  EXPECT_GE(needed, std::filesystem::file_size(folder / "a.h5"));
  EXPECT_LE(needed, 4 * std::filesystem::file_size(folder / "a.h5"));
}

// ---- killed writers ----

/// The child appends and syncs for ever, telling each sync's sample count through the pipe; the parent kills it.
TEST(KilledWriter, LeavesEverythingUpToItsLastSync) {
  const RunRecording run = make_run({});
  std::mt19937 random(7);
  for (int trial = 0; trial < 12; ++trial) {
    const TemporaryFolder folder;
    int ends[2];
    ASSERT_EQ(pipe(ends), 0);
    const pid_t child = fork();
    if (child == 0) {
      RunWriter writer(folder / "a.h5", run.header);
      for (const PhaseMark& mark : run.phases) writer.mark(mark);
      std::uint64_t written = 0;
      LoadCellRecord record;
      for (;;) {
        std::vector<LoadCellRecord> batch(700);
        for (LoadCellRecord& r : batch) {
          record.ft_sequence += run.header.load_cell.ft_stride;
          record.rdt_sequence += 1;
          record.counts[2] = static_cast<std::int32_t>(record.rdt_sequence);
          r = record;
        }
        writer.append(batch);
        written += batch.size();
        writer.sync();
        if (write(ends[1], &written, sizeof written) != sizeof written) _exit(1);
      }
    }
    close(ends[1]);
    std::uint64_t promised = 0;
    const std::uint64_t enough = 700 * (1 + random() % 100);
    while (promised < enough && read(ends[0], &promised, sizeof promised) == sizeof promised) {
    }
    kill(child, SIGKILL);
    int status = 0;
    waitpid(child, &status, 0);
    ASSERT_TRUE(WIFSIGNALED(status));
    for (std::uint64_t more = 0; read(ends[0], &more, sizeof more) == sizeof more;) promised = more;
    close(ends[0]);

    const RunRecording rescued = read_run(folder / "a.h5.part");
    EXPECT_GE(rescued.load_cell.size(), promised);
    EXPECT_EQ(rescued.outcome, Outcome::aborted);
    EXPECT_EQ(rescued.phases.size(), run.phases.size());
    for (std::size_t i = 0; i < rescued.load_cell.size(); ++i) {
      ASSERT_EQ(rescued.load_cell[i].counts[2], static_cast<std::int32_t>(i + 1));
    }
    EXPECT_FALSE(verify_run(folder / "a.h5.part").whole());
  }
}

// ---- disk full ----

/// What the child tells through the pipe: the error's text.
template <class Action>
std::string error_in_child(Action&& action) {
  int ends[2];
  if (pipe(ends) != 0) return "no pipe";
  const pid_t child = fork();
  if (child == 0) {
    std::string text = "no error";
    try {
      action();
    } catch (const std::exception& error) {
      text = error.what();
    }
    const bool told = write(ends[1], text.data(), text.size()) >= 0;
    _exit(told ? 0 : 1);
  }
  close(ends[1]);
  std::string text(4096, '\0');
  const ssize_t n = read(ends[0], text.data(), text.size());
  text.resize(n > 0 ? static_cast<std::size_t>(n) : 0);
  close(ends[0]);
  int status = 0;
  waitpid(child, &status, 0);
  if (status != 0) text += " (the child ended with status " + std::to_string(status) + ")";
  return text;
}

TEST(DiskFull, ShowsAtTheVeryChunkAndSparesWhatWasSynced) {
  const TemporaryFolder folder;
  Truth truth;
  truth.rate_hz = 7000;
  truth.ft_stride = 1;
  const RunRecording run = make_run(truth);
  const std::string text = error_in_child([&] {
    signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{1500000, 1500000};
    setrlimit(RLIMIT_FSIZE, &limit);
    write_run(folder / "a.h5", run);
  });
  EXPECT_THAT(text, StartsWith("disk full: "));
  EXPECT_THAT(text, HasSubstr("a.h5.part"));
  EXPECT_THAT(text, ::testing::Not(HasSubstr("ended with status")));
  EXPECT_FALSE(std::filesystem::exists(folder / "a.h5"));

  const RunRecording rescued = read_run(folder / "a.h5.part");
  EXPECT_GE(rescued.load_cell.size(), 8192u);
  EXPECT_LT(rescued.load_cell.size(), run.load_cell.size());
  for (std::size_t i = 0; i < rescued.load_cell.size(); ++i)
    ASSERT_TRUE(same(rescued.load_cell[i], run.load_cell[i])) << i;
}

TEST(DiskFull, OnARealFullFileSystemSaysNoSpaceLeft) {
  const TemporaryFolder folder;
  if (mount("none", folder.path().c_str(), "tmpfs", 0, "size=2m") != 0) {
    GTEST_SKIP() << "cannot mount a small tmpfs: " << std::strerror(errno);
  }
  Truth truth;
  truth.rate_hz = 7000;
  truth.ft_stride = 1;
  const RunRecording run = make_run(truth);
  const std::string text = error_in_child([&] { write_run(folder / "a.h5", run); });
  const RunRecording rescued = read_run(folder / "a.h5.part");
  umount2(folder.path().c_str(), MNT_DETACH);
  EXPECT_THAT(text, StartsWith("disk full: "));
  EXPECT_THAT(text, HasSubstr("No space left on device"));
  EXPECT_GE(rescued.load_cell.size(), 8192u);
  for (std::size_t i = 0; i < rescued.load_cell.size(); ++i)
    ASSERT_TRUE(same(rescued.load_cell[i], run.load_cell[i])) << i;
}

/// Refuses once so many bytes have gone to files.
class FullAfter : public FileLayer {
 public:
  explicit FullAfter(std::uint64_t bytes) : left_(bytes) {}
  void before_write(std::uint64_t bytes) override {
    if (bytes > left_) throw std::system_error(ENOSPC, std::generic_category());
    left_ -= bytes;
  }
  void sync_data(int) override {}

 private:
  std::uint64_t left_;
};

TEST(DiskFull, CanBeToldToTheWriterByTheFileLayer) {
  const TemporaryFolder folder;
  const RunRecording run = make_run({});
  FullAfter files(600000);
  try {
    write_run(folder / "a.h5", run, files);
    FAIL() << "was accepted";
  } catch (const RecordError& error) {
    EXPECT_THAT(error.what(), StartsWith("disk full: "));
  }
  const RunRecording rescued = read_run(folder / "a.h5.part");
  EXPECT_GT(rescued.load_cell.size(), 0u);
  EXPECT_LT(rescued.load_cell.size(), run.load_cell.size());
}

TEST(DiskFull, ARefusedSyncIsAnError) {
  class NoSync : public FileLayer {
   public:
    void sync_data(int) override {
      if (armed) throw std::system_error(EIO, std::generic_category());
    }
    bool armed = false;
  } files;
  const TemporaryFolder folder;
  RunWriter writer(folder / "a.h5", make_run({}).header, files);
  files.armed = true;
  try {
    writer.sync();
    FAIL() << "was accepted";
  } catch (const RecordError& error) {
    EXPECT_THAT(error.what(), HasSubstr("Input/output error"));
  }
}

// ---- verification ----

class VerifiedRun : public ::testing::Test {
 protected:
  void SetUp() override { path_ = folder_ / "a.h5"; }
  /// Problems of the run, written as aborted, so that finish() does not refuse it.
  std::vector<std::string> problems_of(RunRecording run) {
    run.outcome = Outcome::aborted;
    std::filesystem::remove(folder_ / "a.aborted.h5");
    write_run(path_, run);
    return verify_run(folder_ / "a.aborted.h5").problems;
  }
  TemporaryFolder folder_;
  std::filesystem::path path_;
};

TEST_F(VerifiedRun, WithCountedLossesIsWhole) {
  Truth truth;
  truth.lose = [](std::uint64_t n) { return n % 1000 == 500 || (n > 3000 && n < 3050); };
  const RunRecording run = make_run(truth);
  write_run(path_, run);
  const Verification found = verify_run(path_);
  EXPECT_TRUE(found.whole()) << ::testing::PrintToString(found.problems);
  EXPECT_EQ(found.lost, run.account.lost_network);
  EXPECT_GT(found.lost, 50u);
}

TEST_F(VerifiedRun, FlippedBytesInTheSamplesShow) {
  write_run(path_, make_run({}));
  make_writable(path_);
  const auto size = std::filesystem::file_size(path_);
  std::mt19937_64 random(3);
  std::string bytes = read_text(path_);
  const RunRecording run = make_run({});
  // The bytes of row 4321 of counts, found by their value.
  const std::string row(reinterpret_cast<const char*>(run.load_cell[4321].counts.data()), 24);
  const std::size_t at = bytes.find(row);
  ASSERT_NE(at, std::string::npos);
  ASSERT_LT(at, size);
  bytes[at + 8] = static_cast<char>(bytes[at + 8] ^ 1);
  std::ofstream(path_, std::ios::binary) << bytes;
  EXPECT_THAT(verify_run(path_).problems, Contains(HasSubstr("load_cell/counts does not match its checksum")));
}

TEST_F(VerifiedRun, FlippedBytesAnywhereNeitherCrashNorGiveOtherSamples) {
  const RunRecording run = make_run({});
  write_run(path_, run);
  make_writable(path_);
  const std::string whole = read_text(path_);
  std::mt19937_64 random(11);
  int noticed = 0;
  for (int trial = 0; trial < 60; ++trial) {
    std::string bytes = whole;
    // Half of them in the first 64 KiB, where most of the structure lies.
    const std::size_t at = random() % (trial % 2 == 0 ? 65536 : bytes.size());
    bytes[at] = static_cast<char>(bytes[at] ^ (1 << (random() % 8)));
    std::ofstream(path_, std::ios::binary) << bytes;
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
  write_run(path_, make_run({}));
  make_writable(path_);
  std::string bytes = read_text(path_);
  const std::size_t at = bytes.find("5 inch, 3 blades");
  ASSERT_NE(at, std::string::npos);
  bytes[at] = '6';
  std::ofstream(path_, std::ios::binary) << bytes;
  EXPECT_FALSE(verify_run(path_).whole());
}

TEST_F(VerifiedRun, AMissingSampleShows) {
  RunRecording run = make_run({});
  run.load_cell.erase(run.load_cell.begin() + 777);
  EXPECT_THAT(problems_of(run), Contains(HasSubstr("samples where")));
  run.account.received -= 1;
  run.account.expected -= 1;
  EXPECT_THAT(problems_of(run), Contains("ft_sequence shows 1 missing samples where 0 were counted"));
}

TEST_F(VerifiedRun, ADoubledSampleARebootAndALeftStrideShow) {
  RunRecording run = make_run({});
  run.load_cell[100] = run.load_cell[99];
  EXPECT_THAT(problems_of(run), Contains(HasSubstr("there twice")));
  run = make_run({});
  for (std::size_t i = 5000; i < run.load_cell.size(); ++i)
    run.load_cell[i].ft_sequence = static_cast<std::uint32_t>(7 * (i - 5000));
  for (std::size_t i = 0; i < 5000; ++i) run.load_cell[i].ft_sequence = static_cast<std::uint32_t>(7 * i);
  EXPECT_THAT(problems_of(run), Contains(HasSubstr("the box restarted")));
  run = make_run({});
  run.load_cell[100].ft_sequence += 1;
  EXPECT_THAT(problems_of(run), Contains(HasSubstr("left its stride")));
}

/// The counting stays a whole number of records where the box left out samples between two of them, or began anew.
TEST_F(VerifiedRun, AGapThatIsNoMultipleOfTheStrideIsWholeWhenItWasCounted) {
  RunRecording run = make_run({});
  for (std::size_t i = 1000; i < run.load_cell.size(); ++i) run.load_cell[i].ft_sequence += 25;  // 4.6 strides
  run.account.lost_network += 4;
  run.account.expected += 4;
  run.account.irregular += 1;
  EXPECT_THAT(problems_of(run), testing::IsEmpty());
}

TEST_F(VerifiedRun, AStreamThatBeginsAnewAtAnySampleOfTheBoxIsWhole) {
  RunRecording run = make_run({});
  const std::uint32_t first = run.load_cell[2000].rdt_sequence - 1;
  for (std::size_t i = 2000; i < run.load_cell.size(); ++i) {
    run.load_cell[i].ft_sequence += 3;
    run.load_cell[i].rdt_sequence -= first;
  }
  run.account.restarts += 1;
  EXPECT_THAT(problems_of(run), testing::IsEmpty());
}

TEST_F(VerifiedRun, WithARestartOfTheBoxThatWasCountedIsWhole) {
  RunRecording run = make_run({});
  for (std::size_t i = 0; i < run.load_cell.size(); ++i)
    run.load_cell[i].ft_sequence = static_cast<std::uint32_t>(7 * (i < 5000 ? i : i - 5000));
  run.account.reboots = 1;
  write_run(path_, run);
  EXPECT_TRUE(verify_run(path_).whole()) << ::testing::PrintToString(verify_run(path_).problems);
}

TEST_F(VerifiedRun, ATruncatedFileShows) {
  write_run(path_, make_run({}));
  make_writable(path_);
  const auto size = std::filesystem::file_size(path_);
  for (const std::uintmax_t left : {size - 1, size / 2, std::uintmax_t{1000}, std::uintmax_t{0}}) {
    std::filesystem::resize_file(path_, left);
    EXPECT_FALSE(verify_run(path_).whole()) << left;
    EXPECT_THROW((void)read_run(path_), RecordError) << left;
  }
}

TEST_F(VerifiedRun, AStrangeScaleShows) {
  RunRecording run = make_run({});
  run.header.load_cell.counts_per_newton = 0;
  EXPECT_THAT(problems_of(run), Contains("counts_per_newton is 0"));
  run = make_run({});
  run.header.load_cell.device_rate_hz = 5000;
  EXPECT_THAT(problems_of(run), Contains(HasSubstr("do not make the box's")));
}

TEST_F(VerifiedRun, WhatIsNoRunFileIsSaidToBeNone) {
  std::ofstream(path_) << "not a run";
  EXPECT_THAT(verify_run(path_).problems, Contains(HasSubstr(path_.string())));
  EXPECT_THROW((void)read_run(folder_ / "nothing.h5"), RecordError);
}

// ---- speed: told, not judged ----

TEST(RunFile, TellsHowFastItIs) {
  const TemporaryFolder folder;
  Truth truth;
  truth.rate_hz = 7000;
  truth.ft_stride = 1;
  truth.speeds.assign(83, 500.0);
  const RunRecording run = make_run(truth);
  const auto seconds = [](auto&& action) {
    const auto begin = std::chrono::steady_clock::now();
    action();
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  };
  MemoryOnlySync files;
  const double write = seconds([&] { write_run(folder / "a.h5", run, files); });
  double read = 1;
  for (int i = 0; i < 5; ++i) read = std::min(read, seconds([&] { (void)read_run(folder / "a.h5"); }));
  const double verify = seconds([&] { (void)verify_run(folder / "a.h5"); });
  RecordProperty("samples", static_cast<int>(run.load_cell.size()));
  std::printf("%zu samples: write and finish %.0f ms, read %.1f ms, verify %.0f ms\n", run.load_cell.size(),
              1e3 * write, 1e3 * read, 1e3 * verify);
  EXPECT_GT(run.load_cell.size(), 1100000u);
}

}  // namespace
}  // namespace kphi::results
