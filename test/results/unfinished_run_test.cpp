// Writers that are killed, and disks that say no: what was synced stays.
#include <gmock/gmock.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstring>
#include <system_error>

#include "results/run_reader.hpp"
#include "results/run_writer.hpp"
#include "test/results/recordings.hpp"
#include "test/results/synthetic_run.hpp"

namespace kphi::results::unfinished_run_test {

using namespace test;
using namespace testing;

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

/// What was synced before the disk was full is there, and nothing else.
void expect_beginning_of(const RunRecording& run, const RunRecording& rescued) {
  EXPECT_GE(rescued.load_cell.size(), 8192u);
  EXPECT_LT(rescued.load_cell.size(), run.load_cell.size());
  for (std::size_t i = 0; i < rescued.load_cell.size(); ++i)
    ASSERT_TRUE(same(rescued.load_cell[i], run.load_cell[i])) << i;
}

RunRecording fast_run() {
  Truth truth;
  truth.rate_hz = 7000;
  truth.ft_stride = 1;
  return make_run(truth);
}

TEST(DiskFull, ShowsAtTheVeryChunkAndSparesWhatWasSynced) {
  const TemporaryFolder folder;
  const RunRecording run = fast_run();
  const std::string text = error_in_child([&] {
    signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{1500000, 1500000};
    setrlimit(RLIMIT_FSIZE, &limit);
    write_run(folder / "a.h5", run);
  });
  EXPECT_THAT(text, AllOf(StartsWith("disk full: "), HasSubstr("a.h5.part"), Not(HasSubstr("ended with status"))));
  EXPECT_FALSE(std::filesystem::exists(folder / "a.h5"));
  expect_beginning_of(run, read_run(folder / "a.h5.part"));
}

TEST(DiskFull, OnARealFullFileSystemSaysNoSpaceLeft) {
  const TemporaryFolder folder;
  if (mount("none", folder.path().c_str(), "tmpfs", 0, "size=2m") != 0) {
    GTEST_SKIP() << "cannot mount a small tmpfs: " << std::strerror(errno);
  }
  const RunRecording run = fast_run();
  const std::string text = error_in_child([&] { write_run(folder / "a.h5", run); });
  const RunRecording rescued = read_run(folder / "a.h5.part");
  umount2(folder.path().c_str(), MNT_DETACH);
  EXPECT_THAT(text, AllOf(StartsWith("disk full: "), HasSubstr("No space left on device")));
  expect_beginning_of(run, rescued);
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
  EXPECT_THAT(error_of<RecordError>([&] { write_run(folder / "a.h5", run, files); }), StartsWith("disk full: "));
  const RunRecording rescued = read_run(folder / "a.h5.part");
  EXPECT_GT(rescued.load_cell.size(), 0u);
  EXPECT_LT(rescued.load_cell.size(), run.load_cell.size());
}

class NoSync : public FileLayer {
 public:
  void sync_data(int) override {
    if (--granted < 0) throw std::system_error(EIO, std::generic_category());
  }
  int granted = 1000;
};

TEST(DiskFull, ARefusedSyncIsAnError) {
  NoSync files;
  const TemporaryFolder folder;
  RunWriter writer(folder / "a.h5", make_run({}).header, files);
  files.granted = 0;
  EXPECT_THAT(error_of<RecordError>([&] { writer.sync(); }), HasSubstr("Input/output error"));
}

TEST(DiskFull, ARunIsNotCalledCompleteBeforeItsDataAreOnDisk) {
  const RunRecording run = make_run({});
  for (const int granted : {0, 1}) {
    NoSync files;
    const TemporaryFolder folder;
    RunWriter writer(folder / "a.h5", run.header, files);
    writer.append(std::span(run.load_cell));
    files.granted = granted;
    EXPECT_THROW((void)writer.finish(run), RecordError);
    const RunRecording left = read_run(folder / "a.h5.part");
    EXPECT_TRUE(left.outcome != Outcome::complete || left.load_cell.size() == run.load_cell.size()) << granted;
  }
}

}  // namespace kphi::results::unfinished_run_test
