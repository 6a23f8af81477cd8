#include "base/text.hpp"

#include <gmock/gmock.h>
#include <sys/stat.h>

#include <fstream>
#include <random>

#include "test/temporary_folder.hpp"

namespace kphi {
namespace {

using testing::HasSubstr;

class TextFile : public testing::Test {
 protected:
  [[nodiscard]] std::filesystem::path file(const std::string& text) const {
    std::ofstream(folder_.path() / "file", std::ios::binary) << text;
    return folder_.path() / "file";
  }
  static void refused(const std::filesystem::path& path, const std::string& words) {
    EXPECT_THAT([&] { (void)read_text_file(path, 1 << 20); }, testing::ThrowsMessage<std::runtime_error>(words))
        << path;
  }
  test::TemporaryFolder folder_;
};

TEST_F(TextFile, IsReadWholeUpToItsLimit) {
  for (const std::size_t size : {0UL, 1UL, 65535UL, 65536UL, 65537UL, 1UL << 20})
    EXPECT_EQ(read_text_file(file(std::string(size, 'x')), 1 << 20), std::string(size, 'x'));
  EXPECT_EQ(read_text_file(file(std::string("a\0b", 3)), 3), std::string("a\0b", 3));
  refused(file(std::string((1 << 20) + 1, 'x')), "is larger than 1 MiB; check that this is the right file");
}

TEST_F(TextFile, ThatIsNoneIsRefusedWithoutWaiting) {
  refused(folder_.path() / "none", "cannot be opened: No such file or directory; check the name");
  refused(folder_.path(), "is a folder; name a file");
  refused("/dev/zero", "is a pipe or a device; name a file");
  const auto fifo = folder_.path() / "fifo";
  ASSERT_EQ(::mkfifo(fifo.c_str(), 0600), 0);
  refused(fifo, "is a pipe or a device; name a file");
}

TEST_F(TextFile, IsHandedOutInBlocksOfWholeLines) {
  std::mt19937 random(1);
  std::string text;
  while (text.size() < 5u << 20) text += std::string(random() % 200, static_cast<char>('a' + random() % 26)) + '\n';
  text.insert(2u << 20, std::string(kLongestLine - 200, 'x'));
  text += "the last line has no end";
  kphi::TextFile blocks(file(text), text.size());
  std::string joined;
  std::size_t count = 0;
  for (std::string_view block = blocks.next_block(); !block.empty(); block = blocks.next_block(), ++count) {
    joined += block;
    EXPECT_TRUE(block.ends_with('\n') || joined.size() == text.size());
  }
  EXPECT_TRUE(joined == text);
  EXPECT_GT(count, 3u);
  EXPECT_TRUE(blocks.next_block().empty());
}

TEST_F(TextFile, HoldsNoLineThatIsNoText) {
  kphi::TextFile blocks(file("a,b\n" + std::string(3 * kLongestLine, '\0')), std::size_t{1} << 30);
  const auto read_on = [&] {
    while (!blocks.next_block().empty()) {
    }
  };
  EXPECT_THAT(read_on, testing::ThrowsMessage<std::runtime_error>(HasSubstr("a line of more than 1 MiB")));
}

TEST(NextLine, GivesEachLineOnceAndTheLastWithoutItsEnd) {
  std::istringstream in("a\n\nb");
  std::string line;
  std::vector<std::string> lines;
  while (next_line(in, line)) lines.push_back(line);
  EXPECT_THAT(lines, testing::ElementsAre("a", "", "b"));
}

TEST(InQuotes, ShowsOfAForeignNameWhatFitsALine) {
  EXPECT_EQ(in_quotes("RPM\x1B[2J"), "\"RPM\uFFFD[2J\"");
  EXPECT_LT(in_quotes(std::string(200'000'000, 'x')).size(), 100u);
}

TEST(Printable, LeavesTextInUtf8AsItIs) {
  for (const std::string text : {"", "Mini40 on Net Box", "Prüfstand φ 90°", "\xF0\x9F\x9B\xA9", "\xC2\xA0"})
    EXPECT_EQ(printable(text), text);
}

TEST(Printable, ReplacesEachByteThatIsNoUtf8) {
  EXPECT_EQ(printable("Pr\xFC"
                      "fstand"),
            "Pr\uFFFDfstand");
  EXPECT_EQ(printable("\xFF\xFE"), "\uFFFD\uFFFD");
  EXPECT_EQ(printable("a\xCF"), "a\uFFFD") << "cut short";
  EXPECT_EQ(printable("\xC0\xAF"), "\uFFFD\uFFFD") << "longer than need be";
  EXPECT_EQ(printable("\xE0\x80\xAF"), "\uFFFD\uFFFD\uFFFD");
  EXPECT_EQ(printable("\xED\xA0\x80"), "\uFFFD\uFFFD\uFFFD") << "half a surrogate pair";
  EXPECT_EQ(printable("\xF5\x80\x80\x80"), "\uFFFD\uFFFD\uFFFD\uFFFD") << "beyond Unicode";
}

TEST(Printable, ReplacesWhatWouldSteerATerminal) {
  EXPECT_EQ(printable("\x1B[2J"), "\uFFFD[2J");
  EXPECT_EQ(printable("a\nb\x7F"), "a\uFFFDb\uFFFD");
  EXPECT_EQ(printable("a\nb\r\t", LineEnds::keep), "a\nb\uFFFD\uFFFD");
  EXPECT_EQ(printable("\xC2\x9B"
                      "2J"),
            "\uFFFD\uFFFD2J")
      << "a control character in two bytes";
  EXPECT_EQ(printable(std::string("a\0b", 3)), "a\uFFFDb");
}

}  // namespace
}  // namespace kphi
