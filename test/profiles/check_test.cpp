#include "profiles/check.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <stdexcept>

#include "profiles/strict_yaml.hpp"
#include "test/profiles/refusals.hpp"

namespace kphi::profiles {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

class Check : public testing::Test {
 protected:
  Check() { std::filesystem::create_directories(folder_); }
  ~Check() override { std::filesystem::remove_all(folder_); }

  std::string write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
    return (folder_ / name).string();
  }

  std::vector<CheckedFile> check(const std::vector<std::string>& paths) {
    return check_files(paths, {{"kphi-coefficients/1", "coefficients", [this](const std::string& path) -> std::string {
                                  judged_.push_back(path);
                                  if (coefficients_are_wrong_) throw std::runtime_error(path + ":3: no k_unit; add it");
                                  return "  K_T fine\n";
                                }}});
  }

  std::filesystem::path folder_ = std::filesystem::temp_directory_path() /
                                  ("kphi_check_" + std::to_string(getpid()) + "_" +
                                   std::string(testing::UnitTest::GetInstance()->current_test_info()->name()));
  std::vector<std::string> judged_;
  bool coefficients_are_wrong_ = false;
};

TEST_F(Check, TellsTheKindsApart) {
  const auto files =
      check({shipped("icra2021_5in_3blade.yaml"), shipped("bench_lab.yaml"), shipped("foldable_drone.yaml")});
  ASSERT_EQ(files.size(), 3u);
  EXPECT_EQ(files[0].kind, "campaign");
  EXPECT_EQ(files[1].kind, "bench");
  EXPECT_EQ(files[2].kind, "vehicle");
  for (const auto& file : files) {
    EXPECT_TRUE(file.ok());
    EXPECT_FALSE(file.summary.empty());
    EXPECT_EQ(file.report["ok"], true);
    EXPECT_EQ(file.report["kind"], file.kind);
  }
}

TEST_F(Check, SumsUpACampaign) {
  const auto file = check({shipped("icra2021_5in_3blade.yaml")}).front();
  EXPECT_EQ(file.summary,
            "  propeller  5x3 (5-inch three-blade, 5 in, 3 blades)\n"
            "  runs       15: occlusions 0, 45, 90, 180, 270°, 3 repetitions of each, 5 mountings\n"
            "  order      runs listed, steps up\n"
            "  steps      600: 40 per run, 100 to 19100 RPM by 487.179 RPM, 2 s each\n"
            "  time       20 min 00 s spinning, 21 min 00 s with the zeros, without mounting\n"
            "  disk       8.82 million samples at 7000 Hz, 388 MB\n");
  EXPECT_EQ(file.report["plan"]["runs"], 15);
  EXPECT_EQ(file.report["plan"]["spinning_s"], 1200.0);
  EXPECT_EQ(file.report["plan"]["bytes"], 388080000);
}

TEST_F(Check, HoldsAnswersAgainstTheCampaignsAmongTheFiles) {
  const auto good = check({shipped("answers_example.yaml"), shipped("icra2021_6in_2blade.yaml")});
  EXPECT_TRUE(good[0].ok());
  EXPECT_EQ(good[0].summary, "  mountings  0 45 90 180 270°\n  run again  0 decisions\n");
  const std::string text = read_text(shipped("icra2021_6in_2blade.yaml"));
  const std::string other = write("other.yaml", changed(text, "[0, 45,", "[0, 60,"));
  const auto bad = check({shipped("answers_example.yaml"), other});
  EXPECT_TRUE(bad[1].ok());
  EXPECT_THAT(bad[0].errors, testing::ElementsAre(testing::HasSubstr("mounting 2 is 45°, the campaign needs 60°")));
}

TEST_F(Check, SumsUpAVehicleWithTheOcclusionsOfItsShapes) {
  EXPECT_EQ(check({shipped("foldable_drone.yaml")}).front().summary,
            "  body       half side 0.045 m, arms 0.117 m, propeller radius 0.0635 m\n"
            "  speeds     0 to 19100 RPM\n"
            "  overlap    rim_arc\n"
            "  shape H    arms at 0 90 0 90°, occluded by 0 0 0 0°\n"
            "  shape O    arms at 180 180 165.676 180°, occluded by 64.84 64.84 41.29 64.84°\n"
            "  shape T    arms at 90 0 0 90°, occluded by 0 0 0 0°\n"
            "  shape X    arms at 45 45 45 45°, occluded by 0 0 0 0°\n"
            "  dynamics   0.6 kg, of which 0.045 kg at each hub; 1.47 N per rotor carry it\n"
            "  control    position 6 6 15 1/s2, velocity 4 4 6 1/s, attitude 8.5 8.5 5 1/s, rates 12.7 12.7 5 1/s\n");
}

TEST_F(Check, SaysWhatAVehicleLacksThatASimulatedFlightNeeds) {
  EXPECT_THAT(check({write("v.yaml", kVehicleText)}).front().summary,
              testing::EndsWith("  kphi fly   cannot fly it without dynamics and control\n"));
}

TEST_F(Check, GivesCoefficientFilesToTheirJudge) {
  const std::string path = write("c.yaml", "format: kphi-coefficients/1\nk_unit: N/RPM^2\n");
  EXPECT_TRUE(check({path}).front().ok());
  EXPECT_THAT(judged_, ElementsAre(path));
  coefficients_are_wrong_ = true;
  const auto file = check({path}).front();
  EXPECT_EQ(file.kind, "coefficients");
  EXPECT_THAT(file.errors, ElementsAre(path + ":3: no k_unit; add it"));
  EXPECT_THAT(file.summary, IsEmpty());
}

TEST_F(Check, GivesCoefficientFilesToTheirJudgeEvenIfBroken) {
  check({write("c.yaml", "format: 'kphi-coefficients/1'\nk: [\n")});
  EXPECT_EQ(judged_.size(), 1u);
}

TEST_F(Check, ReportsEachFindingForProgramsToo) {
  const std::string path =
      write("c.yaml", changed(changed(kCampaignText, "steps: 4", "stesp: 4"), "supply_v: 12.0", "supply_v: 120"));
  const auto file = check({path}).front();
  EXPECT_FALSE(file.ok());
  EXPECT_THAT(file.errors, ElementsAre(StartsWith(path + ":12:3: stesp"), StartsWith(path + ":18:11: supply_v")));
  ASSERT_EQ(file.report["errors"].size(), 2u);
  EXPECT_EQ(file.report["ok"], false);
  EXPECT_EQ(file.report["errors"][1]["line"], 18);
  EXPECT_EQ(file.report["errors"][1]["column"], 11);
  EXPECT_EQ(file.report["errors"][0]["next_move"], "did you mean steps?");
}

TEST_F(Check, GuessesTheKindOfAFileWithoutFormatFromItsKeys) {
  const auto file = check({write("c.yaml", changed(kCampaignText, "format: kphi-campaign/1\n", ""))}).front();
  EXPECT_EQ(file.kind, "campaign");
  EXPECT_THAT(file.errors, ElementsAre(HasSubstr(":1:1: format is missing; add the key format")));
}

TEST_F(Check, SaysWhenItCannotTellWhatAFileIs) {
  EXPECT_THAT(check({write("a.yaml", "colour: red\n")}).front().errors,
              ElementsAre(HasSubstr("unknown kind of file: no format given; begin it with format:")));
  EXPECT_THAT(check({write("b.yaml", "format: kphi-campain/1\n")}).front().errors,
              ElementsAre(HasSubstr(":1:9: unknown format kphi-campain/1; did you mean format: kphi-campaign/1?")));
  EXPECT_THAT(check({write("c.yaml", "just words\n")}).front().errors, ElementsAre(HasSubstr("unknown kind of file")));
  EXPECT_EQ(check({write("c.yaml", "just words\n")}).front().report["kind"], nullptr);
}

TEST_F(Check, GoesOnAfterAFileThatCannotBeRead) {
  const auto files = check({"/no/such.yaml", shipped("bench_lab.yaml")});
  EXPECT_THAT(files[0].errors,
              ElementsAre("/no/such.yaml: cannot be opened: No such file or directory; check the name"));
  EXPECT_TRUE(files[1].ok());
}

TEST_F(Check, HoldsCampaignsAgainstTheBenchesBesideThem) {
  const std::string campaign = write("c.yaml", kCampaignText);
  const std::string slow = write("slow.yaml", changed(kBenchText, "19300", "18000"));
  const auto files = check({campaign, slow, shipped("bench_lab.yaml")});
  EXPECT_THAT(files[0].errors,
              ElementsAre(StartsWith(campaign + ":15:13: profile.last_rpm: 19100 RPM is above 18000 RPM")));
  EXPECT_EQ(files[0].report["ok"], false);
  EXPECT_TRUE(files[1].ok());
}

}  // namespace
}  // namespace kphi::profiles
