// The program on disks that refuse something: found before anything turns, said once, and recorded where it can be.
// Each refusal by itself through a library that is loaded first, and true file systems of the kernel and of user space.
// (A kernel without clients of NFS and CIFS mounts none.)
#include <gmock/gmock.h>

#include <algorithm>

#include "results/campaign_folder.hpp"
#include "test/end_to_end/mounted_image.hpp"
#include "test/end_to_end/running_bench.hpp"

namespace kphi::test::refusing_disk_test {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

struct Refusing {
  const char* name;
  const char* refuses;  ///< words of refusing_disk.cpp; empty: a true file system
  const char* words;    ///< of the program, before anything turns
  bool keeps = true;    ///< runs can be kept there
  const char* mount{};  ///< shell commands that mount the true one at the folder out, from where that lies
};

std::ostream& operator<<(std::ostream& out, const Refusing& disk) { return out << disk.name; }

class RefusingDisk : public testing::TestWithParam<Refusing> {
 protected:
  void SetUp() override {
    if (GetParam().mount == nullptr) return;
    try {
      have_own_mounts();
      expect_done({"sh", "-ec", "cd '" + out_ + "/..'; " + GetParam().mount});
    } catch (const MountError& error) {
      GTEST_SKIP() << error.what();
    }
  }
  /// What serves a mount in user space ends with it.
  void TearDown() override {
    if (GetParam().mount != nullptr) ::umount2(out_.c_str(), MNT_DETACH);
  }
  [[nodiscard]] Ended ran_there(const std::vector<std::string>& command, int exit_code) const {
    std::vector<std::string> refusals;
    if (GetParam().mount == nullptr)
      refusals = {"LD_PRELOAD=" KPHI_REFUSING_DISK, "KPHI_DISK=" + campaign_.path("out"),
                  std::string("KPHI_REFUSES=") + GetParam().refuses};
    Process process(command, {}, {refusals});
    EXPECT_EQ(process.wait(), exit_code) << process.out() << process.err();
    return {process.out(), process.err()};
  }
  static std::size_t count(const std::string& text, const std::string& words) {
    std::size_t n = 0;
    for (std::size_t at = text.find(words); at != std::string::npos; at = text.find(words, at + 1)) ++n;
    return n;
  }
  /// A bench that syncs as a live one does.
  static std::string bench() {
    std::string text = deterministic_config(1).text;
    const std::string in_process = "in_process: true";
    return text.replace(text.find(in_process), in_process.size(), in_process + ", durable: true");
  }
  VirtualCampaign campaign_{short_campaign_text("0, 45"), bench()};
  const std::string out_ = (std::filesystem::create_directory(campaign_.path("out")), campaign_.path("out"));
};

TEST_P(RefusingDisk, IsNamedByTheDryRun) {
  const Ended dry = ran_there(campaign_.command({"--yes", "--dry-run"}), GetParam().keeps ? 0 : 2);
  EXPECT_THAT(dry.out, AllOf(HasSubstr(GetParam().words),
                             HasSubstr(GetParam().keeps ? "WARN         files" : "REFUSED      files")));
  EXPECT_TRUE(std::filesystem::is_empty(out_)) << "nothing of the trial stays";
}

TEST_P(RefusingDisk, IsNamedOnceAndARunIsKeptOrNotBegun) {
  const Ended run = ran_there(campaign_.command(), GetParam().keeps ? 0 : 2);
  EXPECT_EQ(count(run.err, GetParam().words), 1u) << run.err;
  if (!GetParam().keeps) {
    EXPECT_TRUE(std::filesystem::is_empty(out_));
    EXPECT_THAT(run.err, Not(HasSubstr("run  1/2")));
    return;
  }
  // Read where it lies, and where all is as usual.
  (void)ran_there({kphi(), "verify", run.folder()}, 0);
  EXPECT_THAT(ran_there({kphi(), "info", run.folder()}, 0).out, HasSubstr("2 of 2"));
  (void)ran({kphi(), "verify", run.folder()});
  EXPECT_EQ(results::CampaignFolder::open(run.folder()).complete_runs().size(), 2u);
}

INSTANTIATE_TEST_SUITE_P(
    Of, RefusingDisk,
    testing::Values(
        Refusing{"Nfs", "lock", "gives no locks"}, Refusing{"ExFat", "mode link", "cannot make a file read-only"},
        Refusing{"Cifs", "mode folder-sync", "cannot sync a folder"},
        Refusing{"Fuse", "folder-sync noreplace link", "cannot sync a folder"},
        Refusing{"ReadOnly", "create", "no run can be kept here: Read-only file system", false},
        Refusing{"ThatFailsToRename", "rename", "no run can be kept here: rename: Input/output error", false},
        Refusing{"ThatFailsToSync", "sync", "no run can be kept here: fdatasync: Input/output error", false}),
    [](const testing::TestParamInfo<Refusing>& tested) { return std::string(tested.param.name); });

INSTANTIATE_TEST_SUITE_P(
    True, RefusingDisk,
    testing::Values(Refusing{"ExFat", "", "cannot make a file read-only", true,
                             "truncate -s 300M image; mkfs.exfat image; L=$(losetup -f --show image); "
                             "mount.exfat-fuse $L out; losetup -d $L"},
                    Refusing{"Fuse", "", "cannot make a file read-only", true,
                             "mkdir below; bindfs --chmod-deny below out"},
                    Refusing{"ReadOnly", "", "no run can be kept here: Read-only file system", false,
                             "mount -t tmpfs -o ro none out"},
                    Refusing{"Full", "", "No space left on device", false, "mount -t tmpfs -o size=4k none out"}),
    [](const testing::TestParamInfo<Refusing>& tested) { return std::string(tested.param.name); });

/// A live bench, whose motor could turn.
TEST(RefusingDiskAtABench, TurnsNothing) {
  RunningBench bench(Manner{.time_scale = 1, .supply = true});
  std::filesystem::create_directory(bench.path("results"));
  Process run(bench.run_command(), {},
              {{"LD_PRELOAD=" KPHI_REFUSING_DISK, "KPHI_DISK=" + bench.path("results"), "KPHI_REFUSES=rename"}});
  EXPECT_EQ(run.wait(), 2) << run.err();
  const Account account = bench.account();
  EXPECT_EQ(std::ranges::count(account.outputs, true), 0) << "its supply was not switched on";
  EXPECT_TRUE(account.commands.empty()) << "its motor was told nothing";
}

}  // namespace kphi::test::refusing_disk_test
