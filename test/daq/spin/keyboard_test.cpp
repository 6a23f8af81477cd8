#include "daq/spin/keyboard.hpp"

#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "test/end_to_end/terminal.hpp"
#include "test/soon.hpp"

namespace kphi::daq {
namespace keyboard_test {

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

TEST(Keyboard, ReadsATerminalWithoutEnterAndGivesItBackAsItWas) {
  const test::Terminal terminal;
  termios before{}, meanwhile{}, after{};
  ASSERT_EQ(tcgetattr(terminal.descriptor(), &before), 0);
  {
    Keyboard keyboard(terminal.descriptor());
    ASSERT_TRUE(keyboard.is_there());
    ASSERT_EQ(tcgetattr(terminal.descriptor(), &meanwhile), 0);
    EXPECT_EQ(meanwhile.c_lflag & (ICANON | ECHO), 0u);
    EXPECT_NE(meanwhile.c_lflag & ISIG, 0u) << "Ctrl-C stays what it is";
    EXPECT_EQ(keyboard.next(), std::nullopt);
    terminal.press("+");
    std::optional<Key> key;
    EXPECT_TRUE(test::soon([&] { return (key = keyboard.next()).has_value(); }));
    EXPECT_EQ(key, Key::up);
  }
  ASSERT_EQ(tcgetattr(terminal.descriptor(), &after), 0);
  EXPECT_EQ(after.c_lflag, before.c_lflag);
}

TEST(Keyboard, IsNotThereWithoutATerminal) {
  int pipe[2];
  ASSERT_EQ(::pipe(pipe), 0);
  Keyboard keyboard(pipe[0]);
  EXPECT_FALSE(keyboard.is_there());
  EXPECT_EQ(keyboard.next(), std::nullopt);
  ::close(pipe[0]);
  ::close(pipe[1]);
}

}  // namespace keyboard_test
}  // namespace kphi::daq
