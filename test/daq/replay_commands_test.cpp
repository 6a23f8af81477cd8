#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "results/campaign_folder.hpp"
#include "results/reduction/reduction.hpp"
#include "results/steps_csv.hpp"
#include "test/results/synthetic_run.hpp"
#include "test/verb.hpp"

namespace kphi::daq {
namespace replay_commands_test {

using kphi::test::Said;
using ::testing::HasSubstr;

Said say(const std::string& arguments) { return kphi::test::say("replay " + arguments); }

class Replay : public ::testing::Test {
 protected:
  void SetUp() override {
    for (const int repetition : {1, 2}) {
      results::test::Truth truth;
      truth.seed = static_cast<std::uint64_t>(repetition);
      results::RunRecording run = results::test::make_run(truth);
      run.header.repetition = repetition;
      results::test::write_run(folder_.run("5x3", 90, repetition), run);
      for (const auto& step : reduce(run)) steps_.push_back(step);
    }
    results::write_steps(folder_.steps(), steps_);
  }
  results::test::TemporaryFolder parent_;
  results::CampaignFolder folder_ = results::CampaignFolder::create(parent_.path(), "u", "c");
  std::vector<results::StepMean> steps_;
};

TEST_F(Replay, OfOneRunComparesItsOwnLines) {
  const Said said = say("--csv " + folder_.run("5x3", 90, 2).string());
  EXPECT_EQ(said.code, 0);
  EXPECT_EQ(said.out, results::format_steps(std::span(steps_).last(3)));
}

TEST_F(Replay, NamesTheFirstLineThatDiffers) {
  steps_[4].thrust_n += 1e-12;
  results::write_steps(folder_.steps(), steps_);
  const Said folder = say(folder_.path().string());
  EXPECT_EQ(folder.code, 5);
  EXPECT_THAT(folder.err, HasSubstr("line 6 differs"));
  EXPECT_EQ(say(folder_.run("5x3", 90, 1).string()).code, 0);
  const Said run = say(folder_.run("5x3", 90, 2).string());
  EXPECT_EQ(run.code, 5);
  EXPECT_THAT(run.err, HasSubstr("line 6 differs"));
}

TEST_F(Replay, SaysInOneLineThatATableAgrees) {
  EXPECT_EQ(say(folder_.path().string()).out, folder_.steps().string() + ": agrees, 6 steps\n");
}

TEST_F(Replay, OfAnAbortedRunIsHeldAgainstNoOther) {
  const std::filesystem::path run = folder_.run("5x3", 90, 2), aborted = folder_.runs() / "5x3_phi090_rep2.aborted.h5";
  std::filesystem::copy(run, aborted);
  steps_[4].thrust_n += 1;  // of the run that was accepted
  results::write_steps(folder_.steps(), steps_);
  const Said said = say(aborted.string());
  EXPECT_EQ(said.code, 0) << said.err;
  EXPECT_THAT(said.out, testing::StartsWith("propeller,blades,"));
}

TEST_F(Replay, MissesAndFindsRows) {
  results::write_steps(folder_.steps(), std::span(steps_).first(5));
  EXPECT_THAT(say(folder_.path().string()).err, HasSubstr("line 7 differs"));
  steps_.push_back(steps_.back());
  results::write_steps(folder_.steps(), steps_);
  EXPECT_EQ(say(folder_.path().string()).code, 5);
}

TEST_F(Replay, GivesTheStoredBytesHoweverManyRunsAreUnderWay) {
  for (int i = 0; i < 5; ++i) {
    const Said said = say("--csv " + folder_.path().string());
    EXPECT_EQ(said.code, 0);
    EXPECT_EQ(said.err, "");
    EXPECT_EQ(said.out, results::read_text(folder_.steps())) << "these were reduced one by one";
  }
}

TEST_F(Replay, WithoutStoredStepsJustTells) {
  std::filesystem::remove(folder_.steps());
  const Said said = say("--json " + folder_.path().string());
  EXPECT_EQ(said.code, 0);
  const auto json = nlohmann::json::parse(said.out);
  EXPECT_EQ(json.at("steps").size(), 6u);
  EXPECT_TRUE(json.at("same").is_null());
}

}  // namespace replay_commands_test
}  // namespace kphi::daq
