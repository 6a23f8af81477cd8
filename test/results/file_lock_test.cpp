#include "results/file_lock.hpp"

#include <gmock/gmock.h>
#include <unistd.h>

#include <fstream>

#include "test/temporary_folder.hpp"

namespace kphi::results::file_lock_test {

using testing::HasSubstr;

class Lock : public testing::Test {
 protected:
  [[nodiscard]] std::optional<FileLock> take() { return FileLock::take(path_, holder_); }
  test::TemporaryFolder folder_;
  std::filesystem::path path_ = folder_.path() / "device.lock";
  LockHolder holder_;
};

TEST_F(Lock, IsHeldByOneAndTellsTheOtherWhoItIs) {
  const auto first = take();
  ASSERT_TRUE(first);
  EXPECT_FALSE(take());
  EXPECT_EQ(holder_.pid, ::getpid());
  EXPECT_THAT(holder_.command, HasSubstr("results_test"));
  EXPECT_THAT(holder_.since_utc, testing::MatchesRegex("20[0-9-]+T[0-9:]+Z"));
  EXPECT_THAT(holder_.words(), HasSubstr("since 20"));
}

TEST_F(Lock, GoesWithItsHolderAndLeavesNoFile) {
  { const auto first = take(); }
  EXPECT_FALSE(std::filesystem::exists(path_));
  EXPECT_TRUE(take());
}

TEST_F(Lock, OfADeadProgramIsNoObstacle) {
  std::ofstream(path_) << R"({"pid":1,"command":"kphi run","since":"2021-05-30T00:00:00Z"})"
                       << "\n";
  const auto taken = take();
  ASSERT_TRUE(taken);
  EXPECT_FALSE(take());
  EXPECT_EQ(holder_.pid, ::getpid()) << "the dead one's words are gone";
}

TEST_F(Lock, WhoseFileTellsNothingIsHeldByAnotherProgram) {
  const auto first = take();
  std::ofstream(path_, std::ios::trunc) << "no words\n";
  EXPECT_FALSE(take());
  EXPECT_EQ(holder_.words(), "another program");
}

TEST_F(Lock, FollowsNoLink) {
  std::filesystem::create_symlink(folder_.path() / "elsewhere", path_);
  EXPECT_ANY_THROW((void)take());
  EXPECT_FALSE(std::filesystem::exists(folder_.path() / "elsewhere"));
}

TEST_F(Lock, MovesWithItsOwner) {
  auto first = take();
  const FileLock second = std::move(*first);
  first.reset();
  EXPECT_FALSE(take()) << "what was moved from gives nothing back";
}

}  // namespace kphi::results::file_lock_test
