#include "daq/run/console.hpp"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <signal.h>
#include <unistd.h>

#include <chrono>
#include <thread>
#include <vector>

#include "test/blockable_output.hpp"
#include "test/soon.hpp"

namespace kphi::daq {
namespace console_test {

using namespace std::chrono_literals;
using std::chrono::steady_clock;
using test::BlockableOutput;
using Kind = BlockableOutput::Kind;
using testing::HasSubstr;

constexpr auto kAtOnce = 200ms;  // of a call that waits for nobody, on a busy host

/// What the console writes to, as a program has it: a descriptor that blocks.
class Opened {
 public:
  explicit Opened(BlockableOutput& output)
      : descriptor(::open(output.path().c_str(), O_WRONLY | O_NOCTTY | O_CLOEXEC)) {}
  ~Opened() { ::close(descriptor); }
  Opened(const Opened&) = delete;
  Opened& operator=(const Opened&) = delete;
  const int descriptor;
};

class BlockedConsole : public testing::TestWithParam<Kind> {
 protected:
  BlockableOutput blocked_{GetParam()}, free_{Kind::full_pipe};
  Opened to_blocked_{blocked_}, to_free_{free_};
};

TEST_P(BlockedConsole, KeepsNobodyWaitingAndTheOtherStreamGoing) {
  blocked_.block();
  {
    Console console;
    const auto begun = steady_clock::now();
    const std::string line = std::string(99, 'x').append("\n");
    for (int i = 0; i < 5000; ++i) console.put(to_blocked_.descriptor, line, Worth::kept);
    console.put(to_free_.descriptor, "data\n", Worth::kept);
    EXPECT_LT(steady_clock::now() - begun, 5 * kAtOnce);
    EXPECT_TRUE(test::soon([&] { return free_.read() == "data\n"; }));
    const auto asked = steady_clock::now();
    EXPECT_FALSE(console.finish(100ms));
    EXPECT_LT(steady_clock::now() - asked, 100ms + kAtOnce);
  }
  SUCCEED() << "and its end waits for no terminal";
}

INSTANTIATE_TEST_SUITE_P(Each, BlockedConsole, testing::ValuesIn(test::kBlockableKinds),
                         testing::PrintToStringParamName());

TEST(ConsoleWords, ComeInTheirOrderWhenTheTerminalGoesOn) {
  BlockableOutput terminal(Kind::stopped_terminal);
  const Opened opened(terminal);
  Console console;
  console.put(opened.descriptor, "before\n", Worth::kept);
  ASSERT_TRUE(console.finish(5s));
  terminal.block();
  std::string expected = "before\r\n";
  for (int i = 0; i < 300; ++i) {
    console.put(opened.descriptor, "line " + std::to_string(i) + "\n", i % 2 == 0 ? Worth::kept : Worth::passing);
    expected += "line " + std::to_string(i) + "\r\n";
  }
  EXPECT_FALSE(console.finish(20ms));
  EXPECT_EQ(terminal.read(), "before\r\n");
  terminal.resume();
  EXPECT_TRUE(console.finish(5s));
  EXPECT_TRUE(test::soon([&] { return terminal.read() == expected; })) << terminal.read();
}

TEST(ConsoleWords, OfTwoStreamsOnOneOutputKeepTheirOrder) {
  BlockableOutput output(Kind::full_pipe);
  const Opened out(output), words(output);
  Console console;
  std::string expected;
  for (int i = 0; i < 200; ++i) {
    expected += std::to_string(i) + "\n";
    console.put(i % 2 == 0 ? out.descriptor : words.descriptor, std::to_string(i) + "\n", Worth::kept);
  }
  ASSERT_TRUE(console.finish(5s));
  EXPECT_EQ(output.read(), expected);
}

TEST(ConsoleWords, OfManyThreadsAreAllWrittenAndNeverMixed) {
  BlockableOutput output(Kind::full_pipe);
  const Opened opened(output);
  Console console;
  std::vector<std::thread> callers;
  for (const char letter : {'a', 'b', 'c', 'd'}) {
    callers.emplace_back([&, letter] {
      for (int i = 0; i < 100; ++i) console.put(opened.descriptor, std::string(60, letter) + "\n", Worth::kept);
    });
  }
  for (auto& caller : callers) caller.join();
  ASSERT_TRUE(console.finish(5s));
  const std::string text = output.read();
  ASSERT_EQ(text.size(), 400u * 61);
  for (std::size_t line = 0; line < 400; ++line) {
    EXPECT_EQ(text.substr(61 * line, 60), std::string(60, text[61 * line])) << line;
  }
}

TEST(ConsoleWords, AreForgottenWhenTheirReaderIsGone) {
  const auto ignored = ::signal(SIGPIPE, SIG_IGN);
  std::array<int, 2> ends{};
  ASSERT_EQ(::pipe2(ends.data(), O_CLOEXEC), 0);
  ::close(ends[0]);
  {
    Console console;
    EXPECT_FALSE(console.is_used());
    EXPECT_TRUE(console.finish(0ms)) << "no words need no thread";
    for (int i = 0; i < 10; ++i) console.put(ends[1], "to nobody\n", Worth::kept);
    console.put(ends[0], "to nothing\n", Worth::kept);
    EXPECT_TRUE(console.finish(5s));
    EXPECT_TRUE(console.is_used());
  }
  ::close(ends[1]);
  ::signal(SIGPIPE, ignored);
}

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
}

TEST_F(Words, ThatAreLostAreCountedAndTheirPlaceIsTold) {
  push("under way\n");
  (void)queue_.begin(3);
  for (const char letter : {'a', 'b', 'c', 'd', 'e'}) push(long_text(letter, 0.4));
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

}  // namespace console_test
}  // namespace kphi::daq
