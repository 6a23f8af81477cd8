#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "results/campaign_folder.hpp"
#include "results/journal.hpp"
#include "test/results/synthetic_run.hpp"
#include "test/verb.hpp"

namespace kphi::results {
namespace commands_test {

using kphi::test::Said;
using kphi::test::say;
using ::testing::HasSubstr;

class Commands : public ::testing::Test {
 protected:
  void SetUp() override {
    run_ = folder_.run("5x3", 90, 2);
    const std::string sha = test::write_run(run_, test::make_run({}));
    Journal(folder_.journal())
        .append(kRunAccepted, {{"file", "runs/" + run_.filename().string()}, {"sha256", sha}}, 0, "");
  }
  test::TemporaryFolder parent_;
  CampaignFolder folder_ = CampaignFolder::create(parent_.path(), "u", "c");
  std::filesystem::path run_;
};

TEST_F(Commands, InfoTellsWhatIsInARun) {
  const Said said = say("info " + run_.string());
  EXPECT_EQ(said.code, 0);
  EXPECT_THAT(said.out, HasSubstr("5 inch, 3 blades"));
  const auto json = nlohmann::json::parse(say("info --json " + run_.string()).out);
  EXPECT_EQ(json.at("occlusion_deg"), 90);
  EXPECT_EQ(json.at("steps"), 3);
}

TEST_F(Commands, InfoTellsWhatHappenedToTheStreamAndHowItDid) {
  RunRecording run = test::make_run({});
  run.events.push_back({EventKind::restarted, 3'000'000'000, 12, "3.000 s: the stream began anew"});
  run.health.skew_ppm = 17.25;
  run.motor_counts[2] = 4;
  const auto file = folder_.run("5x3", 180, 1);
  (void)test::write_run(file, run);
  const Said said = say("info " + file.string());
  EXPECT_THAT(said.out, HasSubstr("3.000 s: the stream began anew"));
  EXPECT_THAT(said.out, HasSubstr("17.25"));
  const auto json = nlohmann::json::parse(say("info --json " + file.string()).out);
  EXPECT_EQ(json.at("events").at(0).at("kind"), "restarted");
  EXPECT_EQ(json.at("health").at("skew_ppm"), 17.25);
  EXPECT_EQ(json.at("motor_timeouts"), 4);
  EXPECT_TRUE(json.at("box_bias").is_null()) << "none was taken";
}

TEST_F(Commands, InfoTellsWhatIsInAFolder) {
  std::ofstream(folder_.runs() / "5x3_phi180_rep1.h5.part") << "x";
  EXPECT_THAT(say("info " + folder_.path().string()).out, HasSubstr("1 complete runs"));
  const auto json = nlohmann::json::parse(say("info --json " + folder_.path().string()).out);
  EXPECT_EQ(json.at("runs").size(), 1u);
  EXPECT_EQ(json.at("not_complete").size(), 1u);
}

TEST_F(Commands, VerifyEndsWith0ForWholeThings) {
  EXPECT_EQ(say("verify " + run_.string()).code, 0);
  const Said said = say("verify --json " + folder_.path().string());
  EXPECT_EQ(said.code, 0);
  EXPECT_EQ(nlohmann::json::parse(said.out).at("whole"), true);
}

TEST_F(Commands, VerifyEndsWith5AndOneLinePerProblem) {
  std::filesystem::permissions(run_, std::filesystem::perms::owner_write, std::filesystem::perm_options::add);
  std::filesystem::resize_file(run_, 1000);
  const Said run = say("verify " + run_.string());
  EXPECT_EQ(run.code, 5);
  EXPECT_EQ(std::count(run.out.begin(), run.out.end(), '\n'), 1);
  const Said folder = say("verify " + folder_.path().string());
  EXPECT_EQ(folder.code, 5);
  EXPECT_EQ(std::count(folder.out.begin(), folder.out.end(), '\n'), 2);
}

}  // namespace commands_test
}  // namespace kphi::results
