// What may be asked of campaigns that lie in a folder: list, info, pack.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <zip.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <tuple>

#include "results/digest.hpp"
#include "results/file_layer.hpp"
#include "results/steps_csv.hpp"
#include "test/compensation/flight/bench_coefficients.hpp"
#include "test/daq/bench_fixture.hpp"
#include "test/fit/export/outside_reader.hpp"
#include "test/source_dir.hpp"

namespace kphi::test {
namespace campaigns_test {

using testing::AllOf;
using testing::AnyOf;
using testing::ContainsRegex;
using testing::HasSubstr;
using testing::Not;
namespace fs = std::filesystem;

/// Name → bytes of every file in it.
std::map<std::string, std::string> contents_of(const fs::path& file) {
  std::map<std::string, std::string> contents;
  int code = 0;
  zip_t* zip = zip_open(file.c_str(), ZIP_RDONLY | ZIP_CHECKCONS, &code);
  EXPECT_NE(zip, nullptr) << code;
  for (zip_int64_t i = 0; zip != nullptr && i < zip_get_num_entries(zip, 0); ++i) {
    zip_stat_t about;
    zip_stat_index(zip, static_cast<zip_uint64_t>(i), 0, &about);
    std::string bytes(about.size, '\0');
    zip_file_t* one = zip_fopen_index(zip, static_cast<zip_uint64_t>(i), 0);
    EXPECT_EQ(zip_fread(one, bytes.data(), bytes.size()), static_cast<zip_int64_t>(bytes.size()));
    zip_fclose(one);
    contents[about.name] = bytes;
  }
  if (zip != nullptr) zip_discard(zip);
  return contents;
}

/// One campaign, measured and fitted once for all tests here.
class Campaigns : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    parent_ = new TemporaryFolder();
    std::ofstream(*parent_ / "campaign.yaml") << short_campaign_text("0, 45, 90, 180, 270", 1);
    std::ofstream(*parent_ / "bench.yaml") << deterministic_config(1).text;
    campaign_ =
        fs::path(bench_coefficients(*parent_ / "campaign.yaml", *parent_ / "bench.yaml", *parent_)).parent_path();
  }
  static void TearDownTestSuite() {
    delete parent_;
    parent_ = nullptr;
  }
  struct Answer {
    int code;
    std::string out, err;
  };
  static Answer say(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), test::kphi());
    Process process(arguments);
    const int code = process.wait();
    return {code, process.out(), process.err()};
  }

  static TemporaryFolder* parent_;
  static fs::path campaign_;
};
TemporaryFolder* Campaigns::parent_ = nullptr;
fs::path Campaigns::campaign_;

TEST_F(Campaigns, AreListedWithDatePropellerCoefficientAndVerdict) {
  const Answer list = say({"list", campaign_.parent_path().string()});
  EXPECT_EQ(list.code, 0) << list.err;
  EXPECT_THAT(
      list.out,
      ContainsRegex("2021-05-30 00:00 +simulated +5x3 +5 of 5 +1\\.[0-9]+e-06 ± [0-9.e-]+ +fly with care +2021"));
  const auto told = nlohmann::json::parse(say({"list", campaign_.parent_path().string(), "--json"}).out);
  ASSERT_EQ(told.size(), 1u);
  EXPECT_EQ(told[0]["runs"], 5);
  EXPECT_EQ(told[0]["verdict"], "fly with care");
  EXPECT_NEAR(told[0]["K_T"].get<double>(), 1.55e-6, 0.03e-6);
}

TEST_F(Campaigns, OrWhatIsNoneAreNamedWithTheCommandThatTakesThem) {
  const std::string run = (campaign_ / "runs/5x3_phi090_rep1.h5").string(), steps = (campaign_ / "steps.csv").string();
  const std::string plan = (*parent_ / "campaign.yaml").string(), bench = (*parent_ / "bench.yaml").string();
  const std::string vehicle = source_dir() + "/profiles/foldable_drone.yaml";
  const std::string answers = source_dir() + "/profiles/answers_example.yaml",
                    faults = source_dir() + "/profiles/faults_example.yaml",
                    coefficients = (campaign_ / "coefficients.yaml").string();
  const TemporaryFolder folder;
  const std::string log = (folder.path() / "log.csv").string(), out = (folder.path() / "out").string();
  std::ofstream(log) << "RPM,Thrust (N)\n1000,0.1\n2000,0.4\n";
  const std::vector<std::tuple<std::vector<std::string>, std::string, std::string>> mistakes{
      {{"fit", run}, "this is a run file", "kphi info"},
      {{"fit", plan}, "this is a campaign file", "kphi run"},
      {{"fit", bench}, "this is a bench file", "kphi devices"},
      {{"fit", log}, "neither steps of kphi nor a table of k", "kphi import"},
      {{"export", plan, "--to", "c"}, "this is a campaign file", "kphi run"},
      {{"export", vehicle, "--to", "c"}, "this is a vehicle file", "--vehicle"},
      {{"compare", run, run}, "this is a run file", "kphi fit"},
      {{"compensate", "--coefficients", plan, "--vehicle", vehicle}, "this is a campaign file", "kphi run"},
      {{"replay", plan}, "this is a campaign file", "kphi run"},
      {{"import", run, "--out", out}, "this is a run file", "kphi fit"},
      {{"fit", faults}, "this is a faults file", "kphi sim --faults"},
      {{"info", steps}, "not a run file", "a campaign folder or a file of its runs/"},
      {{"verify", bench}, "this is a bench file", "kphi devices"},
      {{"run", run, "--bench", bench}, "this is a run file (HDF5), not YAML", "kphi info"},
      {{"run", plan, "--bench", steps}, "this is a table, not YAML", "kphi import"},
      {{"run", answers, "--bench", bench}, "this is an answers file, expected a campaign file", "kphi-campaign/1"},
      {{"compensate", "--coefficients", coefficients, "--vehicle", log}, "this is a table, not YAML", "kphi import"},
      {{"report", steps}, "is a file; name the campaign folder", "kphi report --help"},
  };
  for (const auto& [words, what, next] : mistakes) {
    const Answer answer = say(words);
    EXPECT_EQ(answer.code, 2) << words[0] << ' ' << words[1];
    EXPECT_THAT(answer.err, testing::AllOf(HasSubstr(what), HasSubstr(next))) << words[0] << ' ' << words[1];
  }
}

TEST_F(Campaigns, SayInEachOutputThatTheyAreSimulated) {
  const TemporaryFolder out;
  const std::string folder = campaign_.string(), coefficients = (campaign_ / "coefficients.yaml").string();
  const std::string run = (campaign_ / "runs/5x3_phi090_rep1.h5").string(), bench = (*parent_ / "bench.yaml").string();
  const std::string vehicle = source_dir() + "/profiles/foldable_drone.yaml";
  const std::vector<std::vector<std::string>> verbs{
      {"run", (*parent_ / "campaign.yaml").string(), "--bench", bench, "--dry-run"},
      {"spin", "--bench", bench, "--rpm", "6000", "--for", "2", "--yes", "--out", (out.path() / "spins").string()},
      {"list", campaign_.parent_path().string()},
      {"list", campaign_.parent_path().string(), "--json"},
      {"info", folder},
      {"info", folder, "--json"},
      {"info", run},
      {"fit", folder},
      {"fit", folder, "--json"},
      {"check", coefficients},
      {"check", bench},
      {"compare", folder, coefficients},
      {"compensate", "--coefficients", coefficients, "--vehicle", vehicle},
      {"fly", "--coefficients", coefficients, "--vehicle", vehicle, "--experiment", "hover_xo_c"},
      {"export", coefficients, "--to", "agilicious"},
      {"export", coefficients, "--to", "px4", "--speed-max-rpm", "19000"},
      {"export", coefficients, "--to", "gazebo"},
      {"export", coefficients, "--to", "ros2"},
      {"export", coefficients, "--to", "c"},
      {"export", coefficients, "--to", "csv"},
      {"export", coefficients, "--to", "mcap"},
      {"export", run, "--to", "csv"},
      {"export", run, "--to", "mcap"}};
  const auto says_so = [](std::string text) {
    std::ranges::transform(text, text.begin(), [](unsigned char c) { return std::tolower(c); });
    return text.find("simulated") != std::string::npos;
  };
  for (const std::vector<std::string>& verb : verbs) {
    const Answer answer = say(verb);
    const bool is_export = verb[0] == "export";  // what is handed on is the file alone
    EXPECT_TRUE(says_so(is_export ? answer.out : answer.out + answer.err)) << fmt::format("{}", fmt::join(verb, " "));
  }
  for (const char* file : {"journal.jsonl", "coefficients.yaml", "report.html", "runs/5x3_phi090_rep1.h5"})
    EXPECT_TRUE(says_so(results::read_text(campaign_ / file, 1 << 30))) << file;
  for (const char* file : {"steps.csv", "means.csv"})
    for (const auto& step : results::read_steps(campaign_ / file)) EXPECT_EQ(step.simulated, 1) << file;
  const std::string zip = (out.path() / "c.zip").string();
  ASSERT_EQ(say({"pack", folder, "--out", zip}).code, 0);
  for (const auto& [name, bytes] : contents_of(zip)) {
    if (name.ends_with("README.md") || name.ends_with("ro-crate-metadata.json")) EXPECT_TRUE(says_so(bytes)) << name;
  }
}

TEST_F(Campaigns, SayWhatTheyAreAndWhatComesNext) {
  const Answer info = say({"info", campaign_.string()});
  EXPECT_EQ(info.code, 0) << info.err;
  EXPECT_THAT(info.out, AllOf(HasSubstr("simulated   2021-05-30T00:00:00Z"), HasSubstr("runs        5 of 5"),
                              HasSubstr("verdict     fly with care")));
  const TemporaryFolder copy;
  fs::copy(campaign_, copy.path() / "c", fs::copy_options::recursive);
  for (const char* name : {"coefficients.yaml", "SHA256SUMS"}) fs::remove(copy.path() / "c" / name);
  const std::string folder = (copy.path() / "c").string();
  EXPECT_THAT(say({"info", folder}).out,
              AllOf(HasSubstr("K_T         not fitted"), HasSubstr("next        kphi fit " + folder)));
  std::ofstream(copy.path() / "c/journal.jsonl", std::ios::app) << "{}\n";
  EXPECT_THAT(say({"info", folder}).out, HasSubstr("next        kphi verify " + folder));
}

TEST_F(Campaigns, SayWhatACountOfARunIsWorth) {
  const Answer info = say({"info", (campaign_ / "runs/5x3_phi090_rep1.h5").string()});
  EXPECT_THAT(info.out, ContainsRegex("counts_per_newton  +1000000.0\n"));
}

TEST_F(Campaigns, AreFlownWithAPictureOfTheVehicleOnATerminalAlone) {
  const std::string line = test::kphi() + " compensate --coefficients " + (campaign_ / "coefficients.yaml").string() +
                           " --vehicle " + source_dir() + "/profiles/foldable_drone.yaml </dev/null";
  Process piped({"/bin/sh", "-c", line}), typed({"script", "-qec", line, "/dev/null"});
  EXPECT_EQ(piped.wait(), 2);
  EXPECT_EQ(typed.wait(), 2);
  EXPECT_THAT(piped.err(), Not(HasSubstr("from above")));
  EXPECT_THAT(typed.out(), AllOf(HasSubstr("from above, the nose up"), HasSubstr("###:::#")));
}

TEST_F(Campaigns, ArePackedWholeWithChecksumsAndTheWordsOfAnArchive) {
  const TemporaryFolder out;
  const std::string file = (out.path() / "c.zip").string();
  const Answer pack =
      say({"pack", campaign_.string(), "--out", file, "--license", "CC-BY-4.0", "--creator", "A. Name"});
  ASSERT_EQ(pack.code, 0) << pack.err;
  auto contents = contents_of(file);
  const std::string root = campaign_.filename().string() + "/";
  std::istringstream sums(contents[root + "checksums.sha256"]);
  std::size_t checked = 0;
  for (std::string sum, name; sums >> sum >> name; ++checked)
    EXPECT_EQ(results::sha256(contents[root + name]), sum) << name;
  EXPECT_EQ(checked + 3, contents.size());
  EXPECT_EQ(contents.count(root + "runs/5x3_phi090_rep1.h5"), 1u);
  const auto crate = nlohmann::json::parse(contents[root + "ro-crate-metadata.json"]);
  EXPECT_EQ(crate["@context"], "https://w3id.org/ro/crate/1.2/context");
  std::map<std::string, nlohmann::json> entities;
  for (const auto& one : crate["@graph"]) entities[one["@id"]] = one;
  EXPECT_EQ(entities["ro-crate-metadata.json"]["about"]["@id"], "./");
  for (const char* key : {"name", "description", "datePublished", "license", "hasPart"})
    EXPECT_TRUE(entities["./"].contains(key)) << key;
  for (const auto& part : entities["./"]["hasPart"]) EXPECT_TRUE(entities.contains(part["@id"])) << part;
  EXPECT_EQ(entities["#licence"]["name"], "CC-BY-4.0");
  EXPECT_EQ(entities["#creator"]["name"], "A. Name");
  EXPECT_THAT(contents[root + "README.md"], HasSubstr("fly with care"));
  EXPECT_EQ(say({"pack", campaign_.string(), "--out", file}).code, 2) << "never over another file";
}

TEST_F(Campaigns, TeachHowToPlanTheNextOne) {
  const TemporaryFolder out;
  const std::string written = (*parent_ / "campaign.yaml").string(), shorter = (out.path() / "short.yaml").string();
  const Answer unknown = say({"plan", written});
  EXPECT_EQ(unknown.code, 2);
  EXPECT_THAT(unknown.err, HasSubstr("--pilot DIR"));
  const Answer once = say({"plan", written, "--pilot", campaign_.string()});
  EXPECT_EQ(once.code, 2) << "one repetition shows no noise";
  EXPECT_THAT(once.err, HasSubstr("two repetitions"));
  const std::vector<std::string> stand{"--stand", "noise-n=0.001",
                                       "--stand", "runs=0.001",
                                       "--stand", "k-t=1.55e-6",
                                       "--stand", "intercept=1.03",
                                       "--stand", "slope-per-deg=-0.0029",
                                       "--u",     "calibration=0.0005",
                                       "--u",     "clock=2e-5",
                                       "--u",     "cross-axis=0"};
  const auto plan = [&](std::vector<std::string> more) {
    std::vector<std::string> words{"plan", written};
    words.insert(words.end(), stand.begin(), stand.end());
    words.insert(words.end(), more.begin(), more.end());
    return say(words);
  };
  const Answer chosen = plan({"--want", "slope 1 %", "--out", shorter});
  ASSERT_EQ(chosen.code, 0) << chosen.err;
  EXPECT_THAT(chosen.out, AllOf(HasSubstr("written"), HasSubstr("slope ±"), HasSubstr("\n1 ")));
  EXPECT_EQ(say({"check", shorter}).code, 0);
  EXPECT_EQ(say({"plan", shorter, "--stand", "runs=0.001", "--stand", "k-t=1e-6", "--stand", "intercept=1"}).code, 0);
  const Answer never = plan({"--want", "K_T 0.01 %", "--u", "calibration=0.002"});
  EXPECT_EQ(never.code, 5);
  EXPECT_THAT(never.out, HasSubstr("limited by cell calibration"));
  EXPECT_EQ(plan({"--want", "slope"}).code, 2);
  EXPECT_EQ(plan({"--want", "slope 1 %", "--out", shorter, "--choose", "99"}).code, 2);
  EXPECT_EQ(nlohmann::json::parse(plan({"--want", "slope 1 %", "--json"}).out)["stand"]["runs"], 0.001);
}

TEST_F(Campaigns, AreReadFromThePackageByTheLinesOfItsReadme) {
  if (!works("/usr/bin/python3 -c 'import h5py, pandas'")) GTEST_SKIP() << "no python3-h5py or python3-pandas";
  const TemporaryFolder out;
  const std::string file = (out.path() / "c.zip").string();
  ASSERT_EQ(say({"pack", campaign_.string(), "--out", file}).code, 0);
  for (const auto& [name, bytes] : contents_of(file)) {
    fs::create_directories((out.path() / name).parent_path());
    std::ofstream(out.path() / name, std::ios::binary) << bytes;
  }
  const fs::path unpacked = out.path() / campaign_.filename();
  std::istringstream readme(results::read_text(unpacked / "README.md"));
  int lines = 0;
  for (std::string line; std::getline(readme, line);) {
    if (!line.starts_with("    ")) continue;
    const auto reading = read_with("cd " + unpacked.string() + " && PATH=/usr/bin:/bin " + line.substr(4));
    EXPECT_EQ(reading.status, 0) << line << reading.out;
    EXPECT_THAT(reading.out, AnyOf(HasSubstr(": OK"), HasSubstr("blades"), HasSubstr("ft_sequence"))) << line;
    ++lines;
  }
  EXPECT_EQ(lines, 3);
}

/// A copy that may be changed.
class CampaignOfSomebody : public Campaigns {
 protected:
  CampaignOfSomebody() {
    fs::copy(campaign_, folder_, fs::copy_options::recursive);
    std::ofstream(secret_) << "secret\n";
  }
  [[nodiscard]] Answer pack() const { return say({"pack", folder_.string(), "--out", zip_.string()}); }
  TemporaryFolder parent_folder_;
  const fs::path folder_ = parent_folder_ / "c", secret_ = parent_folder_ / "secret", zip_ = parent_folder_ / "c.zip";
};

TEST_F(CampaignOfSomebody, HoldsNoLinkPipeOrFolderInPlaceOfAFile) {
  const std::string campaign = (*parent_ / "campaign.yaml").string(), bench = (*parent_ / "bench.yaml").string();
  const std::vector<std::vector<std::string>> verbs{{"info", "c"},
                                                    {"verify", "c"},
                                                    {"replay", "c"},
                                                    {"fit", "c"},
                                                    {"report", "c"},
                                                    {"pack", "c", "--out", zip_.string()},
                                                    {"list", "."},
                                                    {"run", "--resume", "c", "--bench", bench, "--yes"},
                                                    {"plan", campaign, "--pilot", "c"}};
  for (const char* name : {"steps.csv", "means.csv", "campaign.yaml", "bench.yaml", "journal.jsonl",
                           "coefficients.yaml", "report.html", "SHA256SUMS", "runs/5x3_phi090_rep1.h5"})
    for (const char* other : {"pipe", "/dev/zero", "secret"}) {
      const fs::path place = folder_ / name, kept = parent_folder_ / "kept";
      fs::rename(place, kept);
      if (other == std::string("pipe"))
        ASSERT_EQ(::mkfifo(place.c_str(), 0600), 0);
      else
        fs::create_symlink(other == std::string("secret") ? secret_ : fs::path(other), place);
      for (std::vector<std::string> words : verbs) {
        words.insert(words.begin(), {"bash", "-c", "cd \"$0\" && ulimit -v 2000000 && exec timeout 10 \"$@\"",
                                     parent_folder_.path().string(), test::kphi()});
        Process asked(words);
        EXPECT_LT(asked.wait(), 6) << words[5] << " " << place << "\n" << asked.err();
        EXPECT_EQ((asked.out() + asked.err()).find("secret\n"), std::string::npos) << words[5] << " " << place;
      }
      const Answer verify = say({"verify", folder_.string()});
      EXPECT_EQ(verify.code, 5) << place << verify.err;
      EXPECT_THAT(verify.err, HasSubstr(fs::path(name).filename().string() + ": is a link, a folder, a pipe")) << place;
      fs::remove(place);
      fs::rename(kept, place);
    }
  EXPECT_EQ(say({"verify", folder_.string()}).code, 0);
}

TEST_F(CampaignOfSomebody, GivesNoResultOnceARunHasChanged) {
  const fs::path run = folder_ / "runs/5x3_phi090_rep1.h5";
  fs::permissions(run, fs::perms::owner_write, fs::perm_options::add);
  {
    std::fstream file(run, std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(-40'000, std::ios::end);
    const char byte = static_cast<char>(file.peek() + 1);
    file.seekp(-40'000, std::ios::end);
    file.put(byte);
  }
  const std::string folder = folder_.string(), coefficients = (folder_ / "coefficients.yaml").string();
  const std::string before = results::read_text(coefficients), report = results::read_text(folder_ / "report.html");
  const std::string vehicle = source_dir() + "/profiles/foldable_drone.yaml";
  for (const std::vector<std::string>& verb :
       std::vector<std::vector<std::string>>{{"fit", folder},
                                             {"fit", folder, "--no-report"},
                                             {"report", folder},
                                             {"compare", campaign_.string(), folder},
                                             {"export", folder, "--to", "ros2"},
                                             {"check", coefficients},
                                             {"compensate", "--coefficients", coefficients, "--vehicle", vehicle},
                                             {"pack", folder, "--out", zip_.string()}}) {
    const Answer answer = say(verb);
    EXPECT_EQ(answer.code, 5) << verb[0];
    EXPECT_EQ(answer.out, "") << verb[0];
    EXPECT_THAT(answer.err, HasSubstr("5x3_phi090_rep1.h5: SHA-256 does not match the journal")) << verb[0];
    EXPECT_EQ(std::ranges::count(answer.err, '\n'), 1) << answer.err;
  }
  EXPECT_EQ(results::read_text(coefficients), before);
  EXPECT_EQ(results::read_text(folder_ / "report.html"), report);
}

TEST_F(CampaignOfSomebody, GivesNoResultOnceItsTableWasEdited) {
  const fs::path table = folder_ / "steps.csv";
  std::string text = results::read_text(table);
  char& digit = text.at(text.find('.', text.find('\n')) + 1);
  digit = digit == '1' ? '2' : '1';
  fs::permissions(table, fs::perms::owner_write, fs::perm_options::add);
  std::ofstream(table) << text;
  const std::string folder = folder_.string(), coefficients = (folder_ / "coefficients.yaml").string();
  const std::string vehicle = source_dir() + "/profiles/foldable_drone.yaml";
  for (const std::vector<std::string>& verb :
       std::vector<std::vector<std::string>>{{"fit", folder},
                                             {"report", folder},
                                             {"compare", campaign_.string(), folder},
                                             {"export", folder, "--to", "ros2"},
                                             {"check", coefficients},
                                             {"compensate", "--coefficients", coefficients, "--vehicle", vehicle}}) {
    const Answer answer = say(verb);
    EXPECT_EQ(answer.code, 5) << verb[0];
    EXPECT_EQ(answer.out, "") << verb[0];
    EXPECT_THAT(answer.err, HasSubstr("steps.csv")) << verb[0];
    EXPECT_EQ(std::ranges::count(answer.err, '\n'), 1) << answer.err;
  }
}

TEST_F(CampaignOfSomebody, SaysWhichOfItsRunsIsMissing) {
  fs::remove(folder_ / "runs/5x3_phi090_rep1.h5");
  for (const std::vector<std::string>& verb : std::vector<std::vector<std::string>>{
           {"info", folder_.string()}, {"fit", folder_.string()}, {"verify", folder_.string()}}) {
    const Answer answer = say(verb);
    EXPECT_THAT(answer.out + answer.err, HasSubstr("5x3_phi090_rep1.h5: missing, but in the journal")) << verb[0];
  }
}

TEST_F(CampaignOfSomebody, KeepsItsCoefficientsWhenATableOfItIsFittedByItsName) {
  const std::string before = results::read_text(folder_ / "coefficients.yaml");
  const Answer fit = say({"fit", (folder_ / "steps.csv").string()});
  EXPECT_EQ(fit.code, 0) << fit.err;
  EXPECT_EQ(results::read_text(folder_ / "coefficients.yaml"), before);
  EXPECT_TRUE(fs::exists(folder_ / "steps_coefficients.yaml"));
  EXPECT_EQ(say({"verify", folder_.string()}).code, 0) << "and all its checksums";
}

TEST_F(CampaignOfSomebody, HasALineOfChecksumForEachFileOfItsFit) {
  const fs::path list = folder_ / "SHA256SUMS";
  const std::string whole = results::read_text(list);
  for (const char* file : {"coefficients.yaml", "report.html"}) {
    const std::size_t name = whole.find(std::string("  ") + file + "\n"), begin = whole.rfind('\n', name) + 1;
    std::ofstream(list) << whole.substr(0, begin) + whole.substr(whole.find('\n', name) + 1);
    const Answer verify = say({"verify", folder_.string()});
    EXPECT_EQ(verify.code, 5);
    EXPECT_THAT(verify.out, HasSubstr(std::string(file) + ": has no line in SHA256SUMS"));
  }
  fs::remove(list);
  EXPECT_THAT(say({"verify", folder_.string()}).out, HasSubstr("coefficients.yaml: has no line in SHA256SUMS"));
}

TEST_F(CampaignOfSomebody, IsPackedWithoutWhatItsLinksStandFor) {
  fs::create_symlink(secret_, folder_ / "notes.txt");
  const Answer pack = this->pack();
  EXPECT_EQ(pack.code, 5);
  EXPECT_THAT(pack.err, HasSubstr("notes.txt: is a link"));
  EXPECT_FALSE(fs::exists(zip_));
}

TEST_F(CampaignOfSomebody, IsPackedWithItsRunsOnAnotherDisk) {
  fs::rename(folder_ / "runs", parent_folder_ / "disk");
  fs::create_directory_symlink(parent_folder_ / "disk", folder_ / "runs");
  const Answer pack = this->pack();
  ASSERT_EQ(pack.code, 0) << pack.err;
  EXPECT_THAT(pack.err, HasSubstr("packed        5 runs, verified"));
  EXPECT_EQ(contents_of(zip_).count("c/runs/5x3_phi090_rep1.h5"), 1u);
  EXPECT_EQ(contents_of(zip_).count("c/runs"), 0u);
}

TEST_F(CampaignOfSomebody, IsNotPackedWithNamesThatAreNoText) {
  std::ofstream(folder_ / "notes_\xFF.txt") << "x";
  const Answer pack = this->pack();
  EXPECT_EQ(pack.code, 5);
  EXPECT_THAT(pack.err, HasSubstr("notes_\uFFFD.txt: a name that is no UTF-8 text"));
}

TEST_F(CampaignOfSomebody, IsNeverReplacedByOut) {
  const std::string run = (folder_ / "runs/5x3_phi090_rep1.h5").string();
  fs::permissions(run, fs::perms::owner_write, fs::perm_options::add);
  const std::string coefficients = (folder_ / "coefficients.yaml").string();
  const std::vector<std::vector<std::string>> verbs{
      {"export", coefficients, "--to", "agilicious", "--out"},
      {"export", coefficients, "--to", "px4", "--speed-max-rpm", "19000", "--out"},
      {"export", run, "--to", "csv", "--out"},
      {"export", run, "--to", "mcap", "--out"},
      {"fit", folder_.string(), "--no-report", "--out"},
      {"report", folder_.string(), "--out"},
      {"plan", (*parent_ / "campaign.yaml").string(), "--stand", "noise-n=0.001", "--stand", "runs=0.001", "--stand",
       "k-t=1.55e-6", "--stand", "intercept=1.03", "--stand", "slope-per-deg=-0.0029", "--want", "slope 5 %", "--out"}};
  for (const std::vector<std::string>& verb : verbs) {
    for (const char* name : {"campaign.yaml", "journal.jsonl", "steps.csv", "runs/5x3_phi090_rep1.h5"}) {
      std::vector<std::string> words = verb;
      words.push_back((folder_ / name).string());
      const std::string before = results::read_text(words.back(), 1 << 30);
      const Answer answer = say(words);
      EXPECT_EQ(answer.code, 2) << answer.err;
      EXPECT_THAT(answer.err, HasSubstr("choose another name"));
      EXPECT_TRUE(results::read_text(words.back(), 1 << 30) == before) << verb[0] << " over " << name;
    }
    std::vector<std::string> words = verb;
    words.push_back((parent_folder_ / "own").string());
    EXPECT_EQ(say(words).code, 0) << verb[0] << " " << verb[3];
    const Answer again = say(words);
    EXPECT_EQ(again.code, verb[0] == "plan" ? 2 : 0) << verb[0] << " " << verb[3] << again.err;
    words.back() = "/dev/null";
    EXPECT_EQ(say(words).code, 2) << "and it is there afterwards";
    EXPECT_TRUE(fs::is_character_file("/dev/null"));
    fs::remove(parent_folder_ / "own");
  }
}

TEST_F(Campaigns, AreNotPackedWithDamage) {
  const TemporaryFolder copy;
  fs::copy(campaign_, copy.path() / "c", fs::copy_options::recursive);
  const fs::path steps = copy.path() / "c/steps.csv";
  fs::permissions(steps, fs::perms::owner_write, fs::perm_options::add);
  std::ofstream(steps, std::ios::app) << "5x3\n";
  const std::string file = (copy.path() / "c.zip").string();
  const Answer pack = say({"pack", (copy.path() / "c").string(), "--out", file});
  EXPECT_EQ(pack.code, 5) << pack.err;
  EXPECT_THAT(pack.err, HasSubstr("what is damaged is not packed"));
  EXPECT_FALSE(fs::exists(file));
}

}  // namespace campaigns_test
}  // namespace kphi::test
