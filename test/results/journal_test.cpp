#include "results/journal.hpp"

#include <gmock/gmock.h>

#include <fstream>

#include "results/file_layer.hpp"
#include "test/results/recordings.hpp"
#include "test/temporary_folder.hpp"

namespace kphi::results::journal_test {

using kphi::test::TemporaryFolder;
using test::error_of;
using namespace testing;

class JournalFile : public ::testing::Test {
 protected:
  void write(int entries) {
    Journal journal(path_);
    for (int i = 0; i < entries; ++i) journal.append("step", {{"i", i}}, 1000 * i, "2021-05-30T00:00:00Z");
  }
  [[nodiscard]] std::string text() const { return read_text(path_); }
  void put(const std::string& text) const { std::ofstream(path_, std::ios::binary) << text; }
  TemporaryFolder folder_;
  std::filesystem::path path_ = folder_ / "journal.jsonl";
};

TEST_F(JournalFile, TellsWhatWasToldInOrder) {
  write(2);
  {
    Journal journal(path_);
    EXPECT_EQ(journal.found().entries.size(), 2u);
    journal.append(kRunAccepted, {{"file", "runs/a.h5"}, {"sha256", "00"}}, 5, "2021-05-30T00:00:05Z");
    journal.append("end", nullptr, 6, "2021-05-30T00:00:06Z");
  }
  const JournalReading reading = read_journal(path_);
  EXPECT_THAT(reading.problems, IsEmpty());
  ASSERT_EQ(reading.entries.size(), 4u);
  EXPECT_EQ(reading.entries[2].n, 3u);
  EXPECT_EQ(reading.entries[2].event, "run_accepted");
  EXPECT_EQ(reading.entries[2].data.at("file"), "runs/a.h5");
  EXPECT_EQ(reading.entries[2].time_ns, 5);
  for (std::size_t i = 0, at = 0; i < 4; ++i) {
    const std::size_t end = text().find('\n', at);
    EXPECT_TRUE(nlohmann::json::parse(text().substr(at, end - at)).is_object());
    at = end + 1;
  }
}

TEST_F(JournalFile, HoldsUnderEachKeyWhatItsReadersExpect) {
  const auto problem = [](const std::string& data) {
    const std::string line =
        chained_line("", R"({"n":1,"t_ns":0,"utc":"2021-05-30T00:00:00Z","event":"run_accepted","data":)" + data);
    const JournalReading reading = parse_journal(line, "journal.jsonl");
    EXPECT_EQ(reading.entries.empty(), !reading.problems.empty()) << data;
    return reading.problems.empty() ? "" : reading.problems.front();
  };
  EXPECT_EQ(problem(R"({"file":"runs/a.h5","sha256":"00","steps_not_needed":2})"), "");
  EXPECT_EQ(problem(R"({"file":5})"), "journal.jsonl:1: file must be a text");
  EXPECT_EQ(problem(R"({"file":"/dev/zero"})"), "journal.jsonl:1: names a file outside the folder: /dev/zero");
  EXPECT_EQ(problem(R"({"files":{"../../etc/passwd":"00"}})"),
            "journal.jsonl:1: names a file outside the folder: ../../etc/passwd");
  for (const char* value : {"5", "null", "[]", "{}", "true", "1e300"}) {
    for (const char* key : {"file", "sha256", "contents_xxh128", "run", "reason", "load_cell", "motor", "supply"})
      EXPECT_NE(problem(std::string("{\"") + key + "\":" + value + "}"), "") << key << value;
    EXPECT_EQ(problem(std::string(R"({"files":)") + value + "}") == "", value == std::string("{}")) << value;
  }
}

TEST_F(JournalFile, ATornLastLineIsToldAndCutOff) {
  write(3);
  const std::string whole = text();
  const std::size_t last = whole.rfind('\n', whole.size() - 2) + 1;
  for (std::size_t length = last + 1; length < whole.size(); ++length) {
    put(whole.substr(0, length));
    const JournalReading reading = read_journal(path_);
    ASSERT_TRUE(reading.torn_last_line) << length;
    ASSERT_EQ(reading.entries.size(), 2u);
    ASSERT_THAT(reading.problems, IsEmpty());
  }
  {
    Journal journal(path_);
    EXPECT_TRUE(journal.found().torn_last_line);
    journal.append("resumed", {}, 1, "2021-05-30T00:00:00Z");
  }
  const JournalReading reading = read_journal(path_);
  EXPECT_FALSE(reading.torn_last_line);
  ASSERT_EQ(reading.entries.size(), 3u);
  EXPECT_EQ(reading.entries[2].event, "resumed");
}

TEST_F(JournalFile, ALastLineWithZerosInItIsWhatAPowerCutLeft) {
  write(3);
  std::string cut = text();
  const std::size_t last = cut.rfind('\n', cut.size() - 2) + 1;
  cut.replace(last + 5, 20, 20, '\0');
  put(cut);
  const JournalReading reading = read_journal(path_);
  EXPECT_TRUE(reading.torn_last_line);
  EXPECT_EQ(reading.entries.size(), 2u);
  EXPECT_THAT(reading.problems, IsEmpty());
  cut.replace(last - 20, 5, 5, '\0');
  put(cut);
  EXPECT_FALSE(read_journal(path_).problems.empty()) << "a line before the last was on disk";
}

TEST_F(JournalFile, ALineThatCouldNotBeSyncedIsToldAndLeavesNothingBehind) {
  class Refusing : public FileLayer {
   public:
    void sync_data(int) override {
      if (armed) throw std::system_error(ENOSPC, std::generic_category());
    }
    bool armed = false;
  } files;
  Journal journal(path_, files);
  journal.append("first", {}, 0, "");
  const std::string whole = text();
  files.armed = true;
  EXPECT_THAT(error_of<RecordError>([&] { journal.append("refused", {}, 1, ""); }), StartsWith("disk full: "));
  EXPECT_EQ(text(), whole);
  files.armed = false;
  journal.append("second", {}, 2, "");
  const JournalReading reading = read_journal(path_);
  EXPECT_THAT(reading.problems, IsEmpty());
  ASSERT_EQ(reading.entries.size(), 2u);
  EXPECT_EQ(reading.entries[1].event, "second");
}

TEST_F(JournalFile, EveryChangedByteShows) {
  write(3);
  const std::string whole = text();
  for (std::size_t i = 0; i + 1 < whole.size(); ++i) {
    std::string changed = whole;
    changed[i] = static_cast<char>(changed[i] ^ 1);
    put(changed);
    ASSERT_FALSE(read_journal(path_).problems.empty()) << i;
  }
}

TEST_F(JournalFile, ALostOrMovedLineShows) {
  write(3);
  const std::string whole = text();
  const std::size_t a = whole.find('\n') + 1;
  const std::size_t b = whole.find('\n', a) + 1;
  put(whole.substr(0, a) + whole.substr(b));
  EXPECT_THAT(read_journal(path_).problems, ElementsAre(HasSubstr("journal.jsonl:2: does not match its checksum")));
  put(whole.substr(0, a) + whole.substr(b) + whole.substr(a, b - a));
  EXPECT_FALSE(read_journal(path_).problems.empty());
  EXPECT_THAT(error_of([&] { Journal journal(path_); }), HasSubstr("journal.jsonl:2"));
}

}  // namespace kphi::results::journal_test
