// Numbers, steps.csv, SHA-256, the journal and the campaign folder.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <bit>
#include <cmath>
#include <fstream>
#include <limits>
#include <stdexcept>

#include "base/error.hpp"
#include "base/number.hpp"
#include "results/campaign_folder.hpp"
#include "results/file_layer.hpp"
#include "results/journal.hpp"
#include "results/run_reader.hpp"
#include "results/steps_csv.hpp"
#include "test/results/recordings.hpp"
#include "test/results/synthetic_run.hpp"

namespace kphi::results {
namespace text_files_test {

using test::error_of;
using test::TemporaryFolder;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

/// Any bit pattern, so that all magnitudes occur.
double double_of_bits(std::uint64_t bits) { return std::bit_cast<double>(bits); }

// ---- numbers ----

TEST(YamlNumber, LooksLikeAFloatToEveryReader) {
  EXPECT_EQ(yaml_number(45), "45.0");
  EXPECT_EQ(yaml_number(0), "0.0");
  EXPECT_EQ(yaml_number(1e-6), "1.0e-06");
  EXPECT_EQ(yaml_number(1.35e-6), "1.35e-06");
  EXPECT_EQ(yaml_number(1e300), "1.0e+300");
  EXPECT_EQ(yaml_number(-0.5), "-0.5");
}

TEST(YamlNumber, RefusesWhatIsNoNumber) {
  EXPECT_THROW((void)yaml_number(std::nan("")), std::invalid_argument);
  EXPECT_THROW((void)yaml_number(std::numeric_limits<double>::infinity()), std::invalid_argument);
}

TEST(Number, ReadsBackAsTheSameBits) {
  EXPECT_TRUE(rc::check([](std::uint64_t bits) {
    const double value = double_of_bits(bits);
    RC_PRE(std::isfinite(value));
    RC_ASSERT(std::bit_cast<std::uint64_t>(*parse_double(shortest(value))) == bits);
    const std::string yaml = yaml_number(value);
    RC_ASSERT(std::bit_cast<std::uint64_t>(*parse_double(yaml)) == bits);
    RC_ASSERT(yaml.find('.') != std::string::npos && yaml.find('.') < yaml.find('e'));
  }));
}

TEST(Sha256, KnowsTheStandardsExamples) {  // FIPS 180-2, appendix B.1
  EXPECT_EQ(sha256("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(sha256(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  const TemporaryFolder folder;
  std::ofstream(folder / "abc") << "abc";
  EXPECT_EQ(sha256_of_file(folder / "abc"), sha256("abc"));
  EXPECT_THROW((void)sha256_of_file(folder / "nothing"), RecordError);
}

// ---- steps.csv ----

std::vector<StepMean> arbitrary_steps() {
  return *rc::gen::container<std::vector<StepMean>>(rc::gen::exec([] {
    const auto number = [] {
      const double value = double_of_bits(*rc::gen::arbitrary<std::uint64_t>());
      return std::isnan(value) ? std::numeric_limits<double>::quiet_NaN() : value;
    };
    StepMean s;
    s.propeller = *rc::gen::string<std::string>();
    std::erase_if(s.propeller, [](char c) { return c == '\0' || c == '\r' || c == '\n'; });
    s.blades = *rc::gen::arbitrary<int>();
    s.step = *rc::gen::arbitrary<int>();
    s.repetition = *rc::gen::arbitrary<int>();
    s.thrust_samples = *rc::gen::arbitrary<std::uint64_t>();
    s.speed_n = *rc::gen::arbitrary<std::uint64_t>();
    s.thrust_n = number();
    s.speed_rad_s = number();
    s.supply_voltage_v = number();
    s.window_end_s = number();
    s.quality_flags = *rc::gen::inRange<std::uint32_t>(0, 128);
    return s;
  }));
}

TEST(StepsCsv, ReadsBackAsWritten) {
  EXPECT_TRUE(rc::check([] {
    const std::vector<StepMean> steps = arbitrary_steps();
    const std::string text = format_steps(steps);
    const std::vector<StepMean> again = parse_steps(text, "steps.csv");
    RC_ASSERT(again.size() == steps.size());
    RC_ASSERT(format_steps(again) == text);
    for (std::size_t i = 0; i < steps.size(); ++i) {
      RC_ASSERT(again[i].propeller == steps[i].propeller);
      RC_ASSERT(again[i].quality_flags == steps[i].quality_flags);
      const bool both_missing = std::isnan(steps[i].thrust_n) && std::isnan(again[i].thrust_n);
      RC_ASSERT(both_missing || again[i].thrust_n == steps[i].thrust_n);
    }
  }));
}

TEST(StepsCsv, IsPlainAndShort) {
  StepMean step;
  step.propeller = "5x3";
  step.diameter_in = 5;
  step.thrust_n = 0.1;
  step.supply_voltage_v = std::nan("");
  step.quality_flags = 5;
  const std::string text = format_steps(std::span(&step, 1));
  EXPECT_THAT(text, StartsWith("propeller,blades,diameter_in,occlusion_deg,repetition,step,commanded_speed_rad_s,"));
  EXPECT_THAT(text, HasSubstr("\n5x3,0,5,0,0,0,0,0,0,0,0.1,0,0,0,0,0,,0,0,0,0,0,speed_not_reached+saturated\n"));
  EXPECT_EQ(text.find('\r'), std::string::npos);
}

TEST(StepsCsv, SaysWhereItDoesNotUnderstand) {
  StepMean step;
  step.propeller = "5x3";
  const std::string good = format_steps(std::vector<StepMean>(3, step));
  const auto complaint = [](const std::string& text) {
    return error_of([&] { (void)parse_steps(text, "steps.csv"); });
  };
  EXPECT_EQ(complaint(good), "no error");
  EXPECT_THAT(complaint(""), StartsWith("steps.csv:1: "));
  EXPECT_THAT(complaint("a,b\n"), StartsWith("steps.csv:1: "));
  EXPECT_THAT(complaint(good + "5x3,1\n"), StartsWith("steps.csv:5: 2 fields where the header has 23"));
  std::string bad = good;
  bad.replace(bad.rfind("5x3,0,0"), 7, "5x3,0,x");
  EXPECT_THAT(complaint(bad), StartsWith("steps.csv:4: diameter_in: \"x\" is not a number"));
  bad = good;
  bad.insert(bad.size() - 1, "tired");
  EXPECT_THAT(complaint(bad),
              AllOf(StartsWith("steps.csv:4: quality_flags"), HasSubstr("unknown quality flag \"tired\"")));
  EXPECT_THROW((void)parse_steps("", "steps.csv"), ConfigurationError);
}

TEST(StepsCsv, IsReadByTheNamesOfItsColumns) {
  StepMean step;
  step.propeller = "5x3";
  step.blades = 3;
  step.lag_s = 0.05;
  step.discarded_s = 1;
  const std::string text = format_steps(std::span(&step, 1));
  const auto complaint = [](const std::string& changed) {
    return error_of([&] { (void)parse_steps(changed, "steps.csv"); });
  };
  const auto replaced = [&](const char* from, const char* to) {
    std::string changed = text;
    return changed.replace(changed.find(from), std::string_view(from).size(), to);
  };
  std::string swapped = replaced("propeller,blades", "blades,propeller");
  swapped.replace(swapped.find("5x3,3"), 5, "3,5x3");
  const auto again = parse_steps(swapped, "steps.csv");
  EXPECT_EQ(again.at(0).propeller, "5x3");
  EXPECT_EQ(again.at(0).blades, 3);
  EXPECT_EQ(again.at(0).lag_s, 0.05);
  EXPECT_THAT(complaint(replaced("thrust_n,", "thrust,")), HasSubstr("steps.csv:1: unknown column \"thrust\""));
  EXPECT_THAT(complaint(replaced("torque_nm,", "thrust_n,")), HasSubstr("steps.csv:1: column thrust_n occurs twice"));
  EXPECT_THAT(complaint(replaced("torque_nm,", "lag_u_s,")), HasSubstr("occurs twice"));
  EXPECT_THAT(complaint("propeller\n"), HasSubstr("steps.csv:1: column blades is missing"));
}

TEST(StepsCsv, FilesAreReplacedWhole) {
  const TemporaryFolder folder;
  const StepMean step;
  write_steps(folder / "steps.csv", std::span(&step, 1));
  write_steps(folder / "steps.csv", {});
  EXPECT_THAT(read_steps(folder / "steps.csv"), IsEmpty());
  EXPECT_FALSE(std::filesystem::exists(folder / "steps.csv.part"));
  EXPECT_THROW((void)read_steps(folder / "none.csv"), RecordError);
}

TEST(QualityFlags, HaveNamesBothWays) {
  EXPECT_EQ(quality_flag_names(0), "");
  EXPECT_EQ(quality_flag_names(127),
            "speed_not_reached+speed_unsteady+saturated+lost_samples+derated+few_samples+bad_status");
  for (std::uint32_t flags = 0; flags < 128; ++flags)
    EXPECT_EQ(quality_flags_from_names(quality_flag_names(flags)), flags);
}

// ---- journal ----

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

TEST_F(JournalFile, ALineThatCouldNotBeSyncedLeavesNothingBehind) {
  class Refusing : public FileLayer {
   public:
    void sync_data(int) override {
      if (armed) throw std::system_error(EIO, std::generic_category());
    }
    bool armed = false;
  } files;
  Journal journal(path_, files);
  journal.append("first", {}, 0, "");
  const std::string whole = text();
  files.armed = true;
  EXPECT_THROW(journal.append("refused", {}, 1, ""), RecordError);
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

TEST_F(JournalFile, SaysWhenItCannotBeSynced) {
  class Full : public FileLayer {
    void sync_data(int) override { throw std::system_error(ENOSPC, std::generic_category()); }
  } files;
  Journal journal(path_, files);
  EXPECT_THAT(error_of([&] { journal.append("c", {}, 0, ""); }), StartsWith("disk full: "));
}

// ---- what a power cut must not take ----

/// Logs what is made to last, in order: "sync NAME SIZE", "replace FROM TO", "rename FROM TO", "folder NAME".
class LoggedDisk : public FileLayer {
 public:
  void sync_data(int descriptor) override {
    const auto path = std::filesystem::read_symlink("/proc/self/fd/" + std::to_string(descriptor));
    log.push_back("sync " + path.filename().string() + ' ' + std::to_string(std::filesystem::file_size(path)));
  }
  void sync_folder(const std::filesystem::path& folder) override {
    log.push_back("folder " + folder.filename().string());
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

// ---- campaign folder ----

TEST(CampaignFolder, NamesRunsSoThatTheySort) {
  EXPECT_EQ(run_file_name("5x3", 90, 2), "5x3_phi090_rep2.h5");
  EXPECT_EQ(run_file_name("5x3", 0, 1), "5x3_phi000_rep1.h5");
  EXPECT_EQ(run_file_name("a/b", 22.5, 1), "a_b_phi022.5_rep1.h5");
  EXPECT_EQ(run_file_name("5x3", 0, -2), "5x3_phi000_ref2.h5");
}

TEST(CampaignFolder, TellsReferenceRunsFromRepetitions) {
  const TemporaryFolder parent;
  const auto folder = CampaignFolder::create(parent.path(), "u", "c");
  for (const int repetition : {-10, -2, -1, 1}) std::ofstream(folder.run("5x3_rep7_ref1", 0, repetition)) << "x";
  std::ofstream(folder.runs() / "5x3_phi000_ref3.aborted.h5") << "x";
  std::vector<std::string> names;
  for (const auto& path : folder.reference_runs()) names.push_back(path.filename().string());
  EXPECT_THAT(names, ElementsAre("5x3_rep7_ref1_phi000_ref1.h5", "5x3_rep7_ref1_phi000_ref2.h5",
                                 "5x3_rep7_ref1_phi000_ref10.h5"));
  ASSERT_EQ(folder.complete_runs().size(), 1u);
  EXPECT_EQ(folder.complete_runs()[0].filename(), "5x3_rep7_ref1_phi000_rep1.h5");
  EXPECT_EQ(folder.other_runs().size(), 1u) << "a reference run is complete, too";
}

TEST(CampaignFolder, IsNeverUsedTwice) {
  const TemporaryFolder parent;
  const auto a = CampaignFolder::create(parent.path(), "20210530T080000Z", "my campaign");
  const auto b = CampaignFolder::create(parent.path(), "20210530T080000Z", "my campaign");
  const auto c = CampaignFolder::create(parent.path(), "20210530T080000Z", "my campaign");
  EXPECT_EQ(a.path().filename(), "20210530T080000Z_my_campaign");
  EXPECT_EQ(b.path().filename(), "20210530T080000Z_my_campaign-2");
  EXPECT_EQ(c.path().filename(), "20210530T080000Z_my_campaign-3");
  EXPECT_TRUE(std::filesystem::is_directory(a.runs()));
  EXPECT_TRUE(std::filesystem::is_directory(a.figures()));
  EXPECT_THROW((void)CampaignFolder::open(parent.path()), RecordError);
}

TEST(CampaignFolder, ListsCompleteRunsInCampaignOrder) {
  const TemporaryFolder parent;
  const auto folder = CampaignFolder::create(parent.path(), "u", "c");
  for (const double phi : {0.0, 90.0, 270.0}) {
    for (const int rep : {1, 2, 10}) std::ofstream(folder.run("5x3", phi, rep)) << "x";
  }
  std::ofstream(folder.runs() / "5x3_phi045_rep1.aborted.h5") << "x";
  std::ofstream(folder.runs() / "5x3_phi045_rep1.h5.part") << "x";
  const std::vector<double> order{270, 0, 90};
  std::vector<std::string> names;
  for (const auto& path : folder.complete_runs(order)) names.push_back(path.filename().string());
  EXPECT_THAT(names, ElementsAre("5x3_phi270_rep1.h5", "5x3_phi270_rep2.h5", "5x3_phi270_rep10.h5",
                                 "5x3_phi000_rep1.h5", "5x3_phi000_rep2.h5", "5x3_phi000_rep10.h5",
                                 "5x3_phi090_rep1.h5", "5x3_phi090_rep2.h5", "5x3_phi090_rep10.h5"));
  EXPECT_EQ(folder.complete_runs().front().filename(), "5x3_phi000_rep1.h5");
  EXPECT_EQ(folder.other_runs().size(), 2u);
}

class VerifiedCampaign : public ::testing::Test {
 protected:
  void SetUp() override {
    const std::string sha = test::write_run(run_, test::make_run({}));
    Journal(folder_.journal())
        .append(kRunAccepted, {{"file", "runs/" + run_.filename().string()}, {"sha256", sha}}, 0, "");
  }
  TemporaryFolder parent_;
  CampaignFolder folder_ = CampaignFolder::create(parent_.path(), "u", "c");
  std::filesystem::path run_ = folder_.run("5x3", 90, 2);
};

TEST_F(VerifiedCampaign, IsWholeAsItWasLeft) {
  const CampaignVerification found = verify_campaign(folder_);
  EXPECT_THAT(found.problems, IsEmpty());
  EXPECT_EQ(found.runs, 1u);
  EXPECT_EQ(found.entries, 1u);
}

TEST_F(VerifiedCampaign, EveryFlippedByteOfARunShows) {
  std::filesystem::permissions(run_, std::filesystem::perms::owner_write, std::filesystem::perm_options::add);
  const std::string whole = read_text(run_);
  for (std::size_t at = 5; at < whole.size(); at += whole.size() / 12) {
    std::string bytes = whole;
    bytes[at] = static_cast<char>(bytes[at] ^ 0x10);
    std::ofstream(run_, std::ios::binary) << bytes;
    ASSERT_THAT(verify_campaign(folder_).problems, Contains(HasSubstr("SHA-256 does not match the journal"))) << at;
  }
}

TEST_F(VerifiedCampaign, AMissingAndAnUnknownRunShow) {
  std::filesystem::rename(run_, folder_.run("5x3", 90, -1));
  const auto problems = verify_campaign(folder_).problems;
  EXPECT_THAT(problems, Contains(HasSubstr("rep2.h5: missing, but in the journal")));
  EXPECT_THAT(problems, Contains(HasSubstr("ref1.h5: not in the journal")));
}

TEST_F(VerifiedCampaign, WithoutItsJournalItIsNotWhole) {
  std::filesystem::remove(folder_.journal());
  EXPECT_THAT(verify_campaign(folder_).problems, Contains(HasSubstr("journal.jsonl: missing")));
}

}  // namespace text_files_test
}  // namespace kphi::results
