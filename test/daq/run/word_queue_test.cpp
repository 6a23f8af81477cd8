#include "daq/run/word_queue.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace kphi::daq {
namespace {

using testing::HasSubstr;

class Words : public testing::Test {
 protected:
  void push(const std::string& text, Worth worth = Worth::kept) { queue_.push(text, worth, ++order_); }
  /// All that waits, taken in pieces.
  [[nodiscard]] std::string all(std::size_t at_once = 7) {
    std::string text;
    while (!queue_.empty()) {
      const std::string_view piece = queue_.begin(at_once);
      text += piece;
      queue_.taken(piece.size());
    }
    return text;
  }
  [[nodiscard]] static std::string long_text(char letter, double share) {
    return std::string(static_cast<std::size_t>(share * WordQueue::kRoom), letter);
  }

  WordQueue queue_;
  std::uint64_t order_ = 0;
};

TEST_F(Words, LeaveInTheirOrder) {
  push("one\n");
  push("two\n", Worth::passing);
  push("three, which is longer\n");
  push("");
  EXPECT_EQ(queue_.order(), 1u);
  EXPECT_EQ(all(), "one\ntwo\nthree, which is longer\n");
  EXPECT_EQ(queue_.lost(), 0u);
}

TEST_F(Words, ThatAreLiveGiveWayToTheNextUnlessAnythingStandsBetween) {
  push("\rfirst", Worth::live);
  push("\rsecond", Worth::live);
  push("said\n");
  push("\rthird", Worth::live);
  push("\rfourth", Worth::live);
  EXPECT_EQ(all(), "\rsecondsaid\n\rfourth");
}

TEST_F(Words, ThatHaveBegunToLeaveAreCompleted) {
  push("\rfirst", Worth::live);
  queue_.taken(queue_.begin(3).size());
  push("\rsecond", Worth::live);
  push(long_text('x', 1));
  EXPECT_EQ(all(100'000).substr(0, 5), "rstxx") << "what is live and has not begun is dropped";
}

TEST_F(Words, ThatPassGoFirstWhenThereIsNoRoomTheOldestBeforeTheOthers) {
  push("kept first\n");
  push("old progress\n", Worth::passing);
  push("new progress\n", Worth::passing);
  push(long_text('x', 1).substr(24));
  const std::string text = all(100'000);
  EXPECT_THAT(text, testing::StartsWith("kept first\nnew progress\nxxx"));
  EXPECT_EQ(queue_.lost(), 0u);
}

TEST_F(Words, ThatAreLostAreCountedAndTheirPlaceIsTold) {
  push("under way\n");
  (void)queue_.begin(3);
  for (const char letter : {'a', 'b', 'c', 'd', 'e'}) push(long_text(letter, 0.4));
  EXPECT_EQ(queue_.lost(), 3u);
  const std::string text = all(100'000);
  EXPECT_THAT(text, testing::StartsWith("under way\nkphi: this output was blocked; messages lost here: 3\nddd"));
  EXPECT_THAT(text, testing::EndsWith("e"));
  push("on\n");
  EXPECT_EQ(all(), "on\n") << "told once";
}

TEST_F(Words, LongerThanAllRoomAreTaken) {
  push("before\n");
  push(long_text('x', 1.5));
  EXPECT_THAT(all(100'000), HasSubstr("messages lost here: 1\nxxx"));
}

TEST_F(Words, ThatNobodyWillTakeAreForgotten) {
  push("one\n");
  (void)queue_.begin(2);
  queue_.clear();
  EXPECT_TRUE(queue_.empty());
  push("two\n");
  EXPECT_EQ(all(), "two\n");
}

}  // namespace
}  // namespace kphi::daq
