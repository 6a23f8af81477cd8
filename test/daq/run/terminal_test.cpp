#include "daq/run/terminal.hpp"

#include <gmock/gmock.h>
#include <sys/ioctl.h>

#include <random>
#include <vector>

#include "test/daq/bench_fixture.hpp"
#include "test/end_to_end/terminal.hpp"
#include "test/soon.hpp"

namespace kphi::daq {
namespace terminal_test {

std::vector<Key> keys_of(const std::vector<std::string>& pieces) {
  KeyReader reader;
  std::vector<Key> keys;
  for (const std::string& piece : pieces) reader.take(piece);
  reader.settle();
  while (const auto key = reader.next()) keys.push_back(*key);
  return keys;
}

using Keys = std::vector<Key>;

TEST(KeyReader, KnowsArrowsSignsAndEnter) {
  EXPECT_EQ(keys_of({"\x1b[A"}), Keys{Key::up});
  EXPECT_EQ(keys_of({"\x1bOB"}), Keys{Key::down}) << "of a terminal in application mode";
  EXPECT_EQ(keys_of({"+-\nh\r"}), (Keys{Key::up, Key::down, Key::hold, Key::hold, Key::hold}));
}

TEST(KeyReader, StopsAtAnyOtherKey) {
  for (int byte = 0; byte < 256; ++byte) {
    if (std::string("+-\nh\r").find(static_cast<char>(byte)) != std::string::npos) continue;
    EXPECT_EQ(keys_of({std::string(1, static_cast<char>(byte))}), Keys{Key::stop}) << byte;
  }
  for (const char* sequence : {"\x1b[C", "\x1b[D", "\x1bOP", "\x1b[H"}) EXPECT_EQ(keys_of({sequence}), Keys{Key::stop});
}

TEST(KeyReader, TakesASequenceInPiecesAndABeginningAloneForStop) {
  EXPECT_EQ(keys_of({"\x1b", "[", "A"}), Keys{Key::up});
  EXPECT_EQ(keys_of({"\x1b"}), Keys{Key::stop});
  EXPECT_EQ(keys_of({"\x1b["}), Keys{Key::stop});
  EXPECT_EQ(keys_of({"\x1b\x1b[A"}), (Keys{Key::stop, Key::up}));
  EXPECT_EQ(keys_of({"\x1b+"}), (Keys{Key::stop, Key::up}));
}

TEST(KeyReader, NeverMakesASpeedOfRandomBytesWithoutOneOfItsKeys) {
  std::mt19937 random(5);
  for (int trial = 0; trial < 2000; ++trial) {
    std::string bytes;
    for (int i = 0; i < 8; ++i) {
      const char byte = static_cast<char>(random());
      if (byte != '+' && byte != 'A') bytes += byte;
    }
    for (const Key key : keys_of({bytes})) EXPECT_NE(key, Key::up);
  }
}

class AtATerminal : public testing::Test {
 protected:
  std::optional<Key> pressed() {
    std::optional<Key> key;
    EXPECT_TRUE(test::soon([&] { return (key = terminal_.next_key()).has_value(); }));
    return key;
  }
  tcflag_t mode() const {
    termios now{};
    EXPECT_EQ(tcgetattr(person_.descriptor(), &now), 0);
    return now.c_lflag;
  }
  /// Waits until the terminal has it.
  void press(const std::string& keys) {
    int before = 0, now = 0;
    ioctl(person_.descriptor(), FIONREAD, &before);
    person_.press(keys);
    EXPECT_TRUE(test::soon([&] {
      ioctl(person_.descriptor(), FIONREAD, &now);
      return now > before;
    }));
  }
  std::string answer_to(const std::string& question, const std::string& typed) {
    const auto answer = terminal_.ask(
        question, [&] { person_.type(typed); }, [] {});
    return answer.line.value_or("(end)");
  }

  test::Terminal person_;
  test::Written words_;
  Terminal terminal_{person_.descriptor(), words_.stream};
};

TEST_F(AtATerminal, ReadsKeysWithoutEnterAndGivesTheTerminalBackAsItWas) {
  const tcflag_t before = mode();
  EXPECT_EQ(terminal_.next_key(), std::nullopt);
  ASSERT_TRUE(terminal_.begin_keys());
  EXPECT_EQ(mode() & (ICANON | ECHO), 0u);
  EXPECT_NE(mode() & ISIG, 0u) << "Ctrl-C stays what it is";
  EXPECT_EQ(terminal_.next_key(), std::nullopt);
  person_.press("+");
  EXPECT_EQ(pressed(), Key::up);
  terminal_.end_keys();
  EXPECT_EQ(mode(), before);
}

TEST_F(AtATerminal, TakesOnlyWhatIsTypedAfterTheQuestionForItsAnswer) {
  press("90\n90\n");
  EXPECT_EQ(answer_to("first?", "45"), "45");
  EXPECT_THAT(words_.text(), testing::HasSubstr("typed before the question does not count"));
  press("90\n");
  EXPECT_EQ(answer_to("second?", "q"), "q");
}

TEST_F(AtATerminal, LosesNoKeyThatWasPressedSinceTheAnswer) {
  EXPECT_EQ(answer_to("go?", "go\n+ "), "go");
  ASSERT_TRUE(terminal_.begin_keys());
  EXPECT_EQ(pressed(), Key::up);
  EXPECT_EQ(pressed(), Key::stop);
  EXPECT_EQ(pressed(), Key::hold) << "the Enter too many";
}

TEST_F(AtATerminal, ForgetsKeysWhereTheNextOneIsAnAnswer) {
  ASSERT_TRUE(terminal_.begin_keys());
  press("\n\n");
  terminal_.forget_keys([] {});
  EXPECT_EQ(terminal_.next_key(), std::nullopt);
}

TEST(Terminal, HasNoKeysOnAPipe) {
  int pipe[2];
  ASSERT_EQ(::pipe(pipe), 0);
  Terminal terminal(pipe[0], stderr);
  EXPECT_FALSE(terminal.begin_keys());
  EXPECT_EQ(terminal.next_key(), std::nullopt);
  ::close(pipe[0]);
  ::close(pipe[1]);
}

}  // namespace terminal_test
}  // namespace kphi::daq
