// What a power cut must not take.
#include "results/file_layer.hpp"

#include <gmock/gmock.h>

#include <fstream>

#include "results/campaign_folder.hpp"
#include "results/journal.hpp"
#include "results/run_reader.hpp"
#include "test/results/recordings.hpp"
#include "test/results/synthetic_run.hpp"
#include "test/temporary_folder.hpp"

namespace kphi::results::file_layer_test {

using kphi::test::TemporaryFolder;
using namespace testing;

/// Logs what is made to last, in order: "sync NAME SIZE", "replace FROM TO", "rename FROM TO", "folder NAME".
class LoggedDisk : public FileLayer {
 public:
  void sync_data(int descriptor) override {
    const auto path = std::filesystem::read_symlink("/proc/self/fd/" + std::to_string(descriptor));
    log.push_back("sync " + path.filename().string() + ' ' + std::to_string(std::filesystem::file_size(path)));
  }
  bool sync_folder(const std::filesystem::path& folder) override {
    log.push_back("folder " + folder.filename().string());
    return true;
  }
  void rename(const std::filesystem::path& from, const std::filesystem::path& to) override {
    log.push_back("rename " + from.filename().string() + ' ' + to.filename().string());
    FileLayer::rename(from, to);
  }
  void replace(const std::filesystem::path& from, const std::filesystem::path& to) override {
    log.push_back("replace " + from.filename().string() + ' ' + to.filename().string());
    FileLayer::replace(from, to);
  }
  std::vector<std::string> log;
};

TEST(Lasting, ATextIsSyncedBeforeItReplacesTheOldOneAndItsFolderAfterwards) {
  const TemporaryFolder folder;
  LoggedDisk files;
  write_text(folder / "steps.csv", "12345", files);
  EXPECT_THAT(files.log, ElementsAre("sync steps.csv.part 5", "replace steps.csv.part steps.csv",
                                     "folder " + folder.path().filename().string()));
}

TEST(Lasting, AJournalIsSyncedWithItsFolderAtFirstAndLineByLine) {
  const TemporaryFolder folder;
  LoggedDisk files;
  const auto path = folder / "journal.jsonl";
  std::vector<std::string> expected{"folder " + folder.path().filename().string()};
  {
    Journal journal(path, files);
    for (const char* event : {"a", "b"}) {
      journal.append(event, {}, 0, "");
      expected.push_back("sync journal.jsonl " + std::to_string(std::filesystem::file_size(path)));
    }
  }
  Journal(path, files).append("c", {}, 0, "");
  expected.push_back("sync journal.jsonl " + std::to_string(std::filesystem::file_size(path)));
  EXPECT_EQ(files.log, expected) << "the folder once: the file exists then";
}

TEST(Lasting, ARunIsSyncedWhenItBeginsAndBeforeAndAfterItsRenaming) {
  const TemporaryFolder folder;
  const std::string synced_folder = "folder " + folder.path().filename().string();
  const RunRecording run = test::make_run({});
  LoggedDisk files;
  RunWriter writer(folder / "a.h5", run.header, files);
  const auto sync = StartsWith("sync a.h5.part ");  // of the rows, then of their number
  EXPECT_THAT(files.log, ElementsAre(sync, sync, synced_folder));
  test::write_pieces(writer, run);
  files.log.clear();
  (void)writer.finish(run);
  const std::string size = std::to_string(std::filesystem::file_size(folder / "a.h5"));
  EXPECT_THAT(files.log, ElementsAre(sync, sync, "sync a.h5.part " + size, "rename a.h5.part a.h5", synced_folder));
}

/// What a program that is killed at a sync leaves.
class CopiedDisk : public FileLayer {
 public:
  void sync_data(int descriptor) override {
    const auto path = std::filesystem::read_symlink("/proc/self/fd/" + std::to_string(descriptor));
    std::filesystem::copy_file(path, path.string() + ".copy", std::filesystem::copy_options::overwrite_existing);
    if (path.extension() == ".part") rows.push_back(read_run(path.string() + ".copy").load_cell.size());
  }
  std::vector<std::size_t> rows;
};

TEST(Lasting, TheNumberOfRowsIsWrittenOnlyWhenTheRowsAreSynced) {
  const TemporaryFolder folder;
  const RunRecording run = test::make_run({});
  CopiedDisk files;
  RunWriter writer(folder / "a.h5", run.header, files);
  test::write_pieces(writer, run);
  (void)writer.finish(run);
  ASSERT_GE(files.rows.size(), 4u);
  for (std::size_t i = 2; i + 1 < files.rows.size(); i += 2)
    EXPECT_EQ(files.rows[i], files.rows[i - 1]) << "the first sync of each two still has the former number";
  EXPECT_GT(files.rows[3], files.rows[2]);
}

TEST(Lasting, ACampaignFolderAndTheNamesOfItsLeftoversAreSynced) {
  const TemporaryFolder parent;
  LoggedDisk files;
  const auto folder = CampaignFolder::create(parent.path(), "u", "c", files);
  EXPECT_THAT(files.log, ElementsAre("folder u_c", "folder " + parent.path().filename().string()));
  std::ofstream(folder.runs() / "5x3_phi000_rep1.h5.part") << "x";
  files.log.clear();
  EXPECT_THAT(set_leftovers_aside(folder, {}, files), ElementsAre("runs/5x3_phi000_rep1.interrupted.h5.part"));
  EXPECT_THAT(files.log, ElementsAre(StartsWith("rename "), "folder runs"));
}

}  // namespace kphi::results::file_layer_test
