// What somebody meets who types kphi for the first time, and who mistypes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

#include "base/json.hpp"
#include "test/daq/bench_fixture.hpp"
#include "test/end_to_end/process.hpp"
#include "test/source_dir.hpp"
#include "test/temporary_folder.hpp"

namespace kphi::test {
namespace first_steps_test {

using testing::AllOf;
using testing::ContainsRegex;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::StartsWith;
namespace fs = std::filesystem;

class FirstSteps : public testing::Test {
 protected:
  struct Answer {
    int code;
    std::string out, err;
  };
  /// In a folder of its own, as a person types it.
  Answer say(const std::string& line) {
    Process process({"/bin/sh", "-c", "cd '" + folder_.path().string() + "' && " + test::kphi() + " " + line});
    const int code = process.wait();
    return {code, process.out(), process.err()};
  }
  std::string text(const std::string& name) { return bytes_of(folder_.path() / name); }
  TemporaryFolder folder_;
};

TEST_F(FirstSteps, KphiAloneHelpAndTheShortOfVersionAreUnderstood) {
  const Answer alone = say("");
  EXPECT_EQ(alone.code, 0);
  EXPECT_THAT(alone.out, AllOf(HasSubstr("kphi init"), HasSubstr("6 bench or folder in use")));
  EXPECT_EQ(say("help").out, alone.out);
  EXPECT_EQ(say("help run").out, say("run --help").out);
  EXPECT_THAT(say("-v").out, StartsWith("kphi "));
  EXPECT_EQ(say("-v").out, say("--version").out);
}

TEST_F(FirstSteps, WhatIsMistypedIsNamedWithWhatWasMeant) {
  const std::map<std::string, std::string> lines{
      {"rnu", "kphi: unknown command \"rnu\"; did you mean run?\n`kphi --help` lists the commands\n"},
      {"run", "kphi run: --bench is missing\n`kphi run --help` explains it\n"},
      {"fit", "kphi fit: INPUT is missing\n`kphi fit --help` explains it\n"},
      {"run c.yaml --bench b.yaml --dryrun",
       "kphi run: unknown option \"--dryrun\"; did you mean --dry-run?\n`kphi run --help` explains it\n"},
      {"run --bnech b.yaml c.yaml",
       "kphi run: unknown option \"--bnech\"; did you mean --bench?\n`kphi run --help` explains it\n"},
      {"verify . ..", "kphi verify: unexpected argument \"..\"\n`kphi verify --help` explains it\n"},
      {"list nothere", "kphi: nothere: no such folder; name the one that holds the campaigns: kphi list DIR\n"}};
  for (const auto& [line, words] : lines) {
    const Answer answer = say(line);
    EXPECT_EQ(answer.code, 2) << line;
    EXPECT_EQ(answer.err, words);
    EXPECT_THAT(answer.out, IsEmpty()) << line;
  }
}

TEST_F(FirstSteps, InitWritesFilesThatCheckTakesAndNamesWhatComesNext) {
  const Answer init = say("init");
  EXPECT_EQ(init.code, 0) << init.err;
  EXPECT_EQ(init.out, "campaign.yaml\nbench.yaml\n");
  EXPECT_THAT(init.err, AllOf(HasSubstr("kphi sim bench.yaml"), HasSubstr("kphi run campaign.yaml")));
  for (const std::string kind : {"campaign", "bench", "vehicle"}) {
    const Answer written = say("init " + kind + " --out my_" + kind + ".yaml");
    EXPECT_EQ(written.code, 0) << written.err;
    EXPECT_THAT(text("my_" + kind + ".yaml"), AllOf(HasSubstr("\nname: my_" + kind + "\n"), HasSubstr(" # ")));
    std::string schema;
    std::istringstream(text("my_" + kind + ".yaml")) >> schema >> schema >> schema;
    ASSERT_THAT(schema, StartsWith("$schema=/"));
    EXPECT_TRUE(fs::exists(schema.substr(schema.find('=') + 1))) << schema;
  }
  const Answer check = say("check campaign.yaml bench.yaml my_campaign.yaml my_bench.yaml my_vehicle.yaml");
  EXPECT_EQ(check.code, 0) << check.err;
  EXPECT_EQ(say("init bench --simulated --out s.yaml").code, 0);
  EXPECT_THAT(text("s.yaml"), HasSubstr("simulation:"));
}

TEST_F(FirstSteps, InitNeverWritesOverAFile) {
  ASSERT_EQ(say("init vehicle").code, 0);
  const std::string before = text("vehicle.yaml");
  const Answer again = say("init vehicle");
  EXPECT_EQ(again.code, 2);
  EXPECT_THAT(again.err, HasSubstr("vehicle.yaml: exists; choose another name with --out"));
  EXPECT_EQ(text("vehicle.yaml"), before);
  std::ofstream(folder_.path() / "bench.yaml") << "mine";
  EXPECT_EQ(say("init").code, 2);
  EXPECT_FALSE(fs::exists(folder_.path() / "campaign.yaml")) << "both or none";
}

TEST_F(FirstSteps, ASimulatorThatDoesNotRunIsNamedWithTheCommandThatStartsIt) {
  ASSERT_EQ(say("init").code, 0);
  std::ofstream(folder_.path() / "bench.yaml", std::ios::app) << "";
  std::string bench = text("bench.yaml");
  for (std::size_t at; (at = bench.find("/tmp/kphi-bench")) != std::string::npos;)
    bench.replace(at, 15, (folder_.path() / "none").string());
  std::ofstream(folder_.path() / "bench.yaml") << bench;
  EXPECT_THAT(say("check bench.yaml").out, HasSubstr("it does not run: start it with kphi sim bench.yaml"));
  for (const char* line : {"devices --bench bench.yaml", "run campaign.yaml --bench bench.yaml --yes"}) {
    const Answer answer = say(line);
    EXPECT_EQ(answer.code, 3);
    EXPECT_THAT(answer.err, HasSubstr("its simulator does not run; start it in another terminal: kphi sim bench.yaml"));
  }
}

TEST_F(FirstSteps, AnOutputThatCannotBeIsRefusedBeforeAnythingHappens) {
  ASSERT_EQ(say("init").code, 0);
  std::ofstream(folder_.path() / "afile") << "";
  const Answer run = say("run campaign.yaml --bench bench.yaml --yes --out afile");
  EXPECT_EQ(run.code, 2);
  EXPECT_THAT(run.err, HasSubstr("afile: no run can be kept here: Not a directory; choose another folder with --out"));
  const Answer sim = say("sim bench.yaml --truth nofolder/truth.yaml");
  EXPECT_EQ(sim.code, 2);
  EXPECT_THAT(sim.err, HasSubstr("the folder nofolder does not exist"));
  const Answer others = say("sim " + test::source_dir() + "/examples/second_bench/bench.yaml");
  EXPECT_EQ(others.code, 2);
  EXPECT_THAT(others.err, HasSubstr("start the simulator of `load_cell` and `motor` instead"));
}

TEST_F(FirstSteps, EveryVerbEndsItsHelpWithAnExampleOfItsOwn) {
  std::istringstream completion(say("completion bash").out);
  std::string line, verbs;
  while (std::getline(completion, line))
    if (const auto at = line.find("words=\"init"); at != std::string::npos) verbs = line.substr(at + 7);
  std::istringstream names(verbs.substr(0, verbs.find('"')));
  int count = 0;
  for (std::string verb; names >> verb && verb != "help"; ++count) {
    const Answer help = say(verb + " --help");
    EXPECT_EQ(help.code, 0) << verb;
    EXPECT_THAT(help.out, ContainsRegex("\n[^\n]*kphi " + verb + "[^\n]*(\n    [^\n]*)*\n+$")) << verb;
  }
  EXPECT_EQ(count, 21);
}

TEST_F(FirstSteps, CompletionKnowsVerbsOptionsAndChoices) {
  for (const std::string shell : {"bash", "zsh", "fish"}) {
    const Answer completion = say("completion " + shell);
    EXPECT_EQ(completion.code, 0);
    EXPECT_THAT(completion.out, AllOf(HasSubstr("compensate"), HasSubstr("dry-run"), HasSubstr("clamped published")))
        << shell;
    EXPECT_THAT(completion.out, Not(HasSubstr("[OPTIONS]"))) << shell;
  }
  const std::string ask =
      "completion bash > c.sh; bash -c 'source ./c.sh; COMP_WORDS=(kphi run --dr); COMP_CWORD=2; _kphi; echo "
      "\"${COMPREPLY[@]}\"; COMP_WORDS=(kphi fit --form ta); COMP_CWORD=3; _kphi; echo \"${COMPREPLY[@]}\"; "
      "COMP_WORDS=(kphi export --to ga); _kphi; echo \"${COMPREPLY[@]}\"; COMP_WORDS=(kphi we); COMP_CWORD=1; _kphi; "
      "echo \"${COMPREPLY[@]}\"'";
  EXPECT_EQ(say(ask).out, "--dry-run\ntable\ngazebo\nweigh\n");
}

TEST_F(FirstSteps, ListTellsEachCampaignInALine) {
  ASSERT_EQ(say("init campaign").code, 0);
  EXPECT_THAT(say("list .").err, HasSubstr("no campaigns"));
  EXPECT_EQ(say("list . --json").out, "[]\n");
}

}  // namespace first_steps_test
}  // namespace kphi::test
