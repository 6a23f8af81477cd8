#include <gmock/gmock.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "test/profiles/refusals.hpp"
#include "test/temporary_folder.hpp"
#include "test/verb.hpp"

namespace kphi::profiles::check_test {

using kphi::test::Said;
using kphi::test::say;
using namespace testing;

class Check : public testing::Test {
 protected:
  std::string write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_.path() / name) << text;
    return (folder_.path() / name).string();
  }

  /// One report per file.
  static std::vector<nlohmann::json> check(const std::vector<std::string>& paths) {
    std::string line = "check --json";
    for (const std::string& path : paths) line += " " + path;
    std::istringstream lines(say(line).out);
    std::vector<nlohmann::json> reports;
    while (std::getline(lines, line)) reports.push_back(nlohmann::json::parse(line));
    return reports;
  }

  static std::vector<std::string> errors(const nlohmann::json& report) {
    std::vector<std::string> messages;
    for (const auto& error : report["errors"]) messages.push_back(error["message"]);
    return messages;
  }

  kphi::test::TemporaryFolder folder_;
};

TEST_F(Check, TellsTheKindsApart) {
  const auto files =
      check({shipped("icra2021_5in_3blade.yaml"), shipped("bench_lab.yaml"), shipped("foldable_drone.yaml")});
  ASSERT_EQ(files.size(), 3u);
  EXPECT_EQ(files[0]["kind"], "campaign");
  EXPECT_EQ(files[1]["kind"], "bench");
  EXPECT_EQ(files[2]["kind"], "vehicle");
  for (const auto& file : files) EXPECT_EQ(file["ok"], true);
}

TEST_F(Check, SumsUpAFlightLayout) {
  const std::string path = write("arms.yaml",
                                 "format: kphi-flight-layout/1\nseries:\n  - {channel: arm_angle, number: 2, series: "
                                 "'actuator_servos.control[1]', unit: rad, factor: 0.5}\n");
  EXPECT_EQ(say("check " + path).out,
            path + ": valid flight_layout\n  arm_angle 2           \"actuator_servos.control[1]\" · 0.5\n");
}

TEST_F(Check, SumsUpACampaign) {
  const std::string path = shipped("icra2021_5in_3blade.yaml");
  EXPECT_THAT(say("check " + path).out,
              testing::AllOf(StartsWith(path + ": valid campaign\n  "), HasSubstr("propeller 5x3 (5-inch three-blade)"),
                             HasSubstr("  15 runs of 40 steps, 100 to 19100 RPM, 2 s each; 15 mountings\n"),
                             testing::EndsWith("  order runs listed, steps up, remounted for each repetition\n")));
  const auto file = check({path}).front();
  EXPECT_EQ(file["plan"]["runs"], 15);
  EXPECT_EQ(file["plan"]["spinning_s"], 1200.0);
}

TEST_F(Check, HoldsAnswersAgainstTheCampaignsAmongTheFiles) {
  const std::string answers = shipped("answers_example.yaml"), campaign = shipped("icra2021_6in_2blade.yaml");
  EXPECT_THAT(say("check " + answers + " " + campaign).out,
              StartsWith(answers + ": valid answers\n  mountings  0 0 0 45 45 45 90 90 90 180 180 180 270 270 270°\n  "
                                   "run again  0 decisions\n"));
  const std::string other = write("other.yaml", changed(read_text(campaign), "[0, 45,", "[0, 60,"));
  const auto bad = check({answers, other});
  EXPECT_EQ(bad[1]["ok"], true);
  EXPECT_THAT(errors(bad[0]), ElementsAre(HasSubstr("mounting 4 is 45°, the campaign needs 60°")));
}

TEST_F(Check, SumsUpAVehicleWithTheOcclusionsOfItsShapes) {
  EXPECT_THAT(
      say("check " + shipped("foldable_drone.yaml")).out,
      StartsWith(
          shipped("foldable_drone.yaml: valid vehicle\n") +
          "  body       half side 0.045 m, arms 0.117 m, propeller radius 0.0635 m\n"
          "  rotors     4; drag torque up of 1 3, down of 2 4\n"
          "  speeds     0 to 19100 RPM\n"
          "  overlap    rim_arc\n"
          "  shape H    arms at 0 90 0 90°, occluded by 0 0 0 0°\n"
          "  shape O    arms at 180 180 165.676 180°, occluded by 64.84 64.84 41.29 64.84°\n"
          "  shape T    arms at 90 0 0 90°, occluded by 0 0 0 0°\n"
          "  shape X    arms at 45 45 45 45°, occluded by 0 0 0 0°\n"
          "  dynamics   0.6 kg, of which 0.045 kg at each hub; 1.47 N per rotor carry it\n"
          "  control    position 6 6 15 1/s2, velocity 4 4 6 1/s, attitude 8.5 8.5 5 1/s, rates 12.7 12.7 5 1/s\n\n"
          "from above, the nose up; '#' of a disk is covered by the body ':'\n"));
}

TEST_F(Check, SumsUpAVehicleOfAnyRotorsAndHubs) {
  const std::string hexa = say("check " + shipped("foldable_hexa.yaml")).out;
  EXPECT_THAT(hexa, HasSubstr("  rotors     6; drag torque up of 1 3 5, down of 2 4 6\n"));
  EXPECT_THAT(hexa,
              HasSubstr("  shape O    arms at 180 180 180 180 180 180°, occluded by 77 77.01 77.01 77 77.01 77.01°"));
  EXPECT_THAT(hexa, HasSubstr("1.47 N per rotor carry it"));
  EXPECT_THAT(
      say("check " + shipped("telescoping_quad.yaml")).out,
      HasSubstr("  shape O    hubs at (0.072, 0.072) (-0.072, 0.072) (-0.072, -0.072) (0.072, -0.072) m, occluded "
                "by 39.67 39.67 39.67 39.67°"));
}

TEST_F(Check, SaysWhatAVehicleLacksThatASimulatedFlightNeeds) {
  EXPECT_THAT(say("check " + write("v.yaml", kVehicleText)).out,
              HasSubstr("  kphi fly   cannot fly it without dynamics and control\n"));
}

TEST_F(Check, KnowsCoefficientsEvenIfBroken) {
  const auto file = check({write("c.yaml", "format: 'kphi-coefficients/2'\nk: [\n")}).front();
  EXPECT_EQ(file["kind"], "coefficients");
  EXPECT_EQ(file["errors"].size(), 1u);
}

TEST_F(Check, ReportsEachFindingForProgramsToo) {
  const std::string path =
      write("c.yaml", changed(changed(kCampaignText, "steps: 4", "stesp: 4"), "supply_v: 12.0", "supply_v: 120"));
  const auto file = check({path}).front();
  EXPECT_THAT(errors(file), ElementsAre(StartsWith(path + ":12:3: stesp"), StartsWith(path + ":18:11: supply_v")));
  EXPECT_EQ(file["ok"], false);
  EXPECT_EQ(file["errors"][1]["line"], 18);
  EXPECT_EQ(file["errors"][1]["column"], 11);
  EXPECT_EQ(file["errors"][0]["next_move"], "did you mean steps?");
}

TEST_F(Check, GuessesTheKindOfAFileWithoutFormatFromItsKeys) {
  const auto file = check({write("c.yaml", changed(kCampaignText, "format: kphi-campaign/1\n", ""))}).front();
  EXPECT_EQ(file["kind"], "campaign");
  EXPECT_THAT(errors(file), ElementsAre(HasSubstr(":1:1: format is missing; add the key format")));
}

TEST_F(Check, SaysWhenItCannotTellWhatAFileIs) {
  const auto refusal = [&](const std::string& text) { return errors(check({write("a.yaml", text)}).front()); };
  EXPECT_THAT(refusal("colour: red\n"),
              ElementsAre(HasSubstr("unknown kind of file: no format given; begin the file with format:")));
  EXPECT_THAT(refusal("format: kphi-campain/1\n"),
              ElementsAre(HasSubstr(":1:9: unknown format kphi-campain/1; did you mean format: kphi-campaign/1?")));
  EXPECT_THAT(refusal("just words\n"), ElementsAre(HasSubstr("unknown kind of file")));
  EXPECT_EQ(check({write("c.yaml", "just words\n")}).front()["kind"], nullptr);
}

TEST_F(Check, HoldsCampaignsAgainstTheBenchesBesideThem) {
  const std::string campaign = write("c.yaml", kCampaignText);
  const std::string slow = write("slow.yaml", changed(kBenchText, "19300", "18000"));
  const auto files = check({campaign, slow, shipped("bench_lab.yaml")});
  EXPECT_THAT(errors(files[0]),
              ElementsAre(StartsWith(campaign + ":15:13: profile.last_rpm: 19100 RPM is above 18000 RPM")));
  EXPECT_EQ(files[0]["ok"], false);
  EXPECT_EQ(files[1]["ok"], true);
}

TEST(CheckCommand, PrintsErrorsOnStderrAndExitsWithTwo) {
  const Said said = say("check /no/such.yaml " + shipped("bench_lab.yaml"));
  EXPECT_EQ(said.code, 2);
  EXPECT_EQ(said.err, "/no/such.yaml: cannot be opened: No such file or directory; check the name\n");
  EXPECT_THAT(said.out, HasSubstr("bench_lab.yaml: valid bench"));
}

TEST(CheckCommand, PrintsOneJsonObjectPerFile) {
  const Said said = say("check --json /no/such.yaml " + shipped("bench_lab.yaml"));
  EXPECT_EQ(said.code, 2);
  EXPECT_EQ(said.err, "");
  std::istringstream lines(said.out);
  std::string first, second, rest;
  std::getline(lines, first);
  std::getline(lines, second);
  EXPECT_FALSE(std::getline(lines, rest));
  EXPECT_EQ(nlohmann::json::parse(first)["ok"], false);
  EXPECT_EQ(nlohmann::json::parse(second)["kind"], "bench");
}

TEST(CheckCommand, ReadsTheShippedFaultScriptAndTellsWhatWillGoWrong) {
  const Said said = say("check " + shipped("faults_example.yaml"));
  EXPECT_EQ(said.code, 0);
  EXPECT_EQ(said.err, "");
  EXPECT_THAT(said.out, HasSubstr("faults_example.yaml: valid fault script\n  at 0 s  loss for 3600 s\n"));
  EXPECT_THAT(said.out, HasSubstr("\n  at 60 s  reboot\n"));
  EXPECT_THAT(said.out, HasSubstr("\n  at 500 s  http_slow, at most 1 times\n"));
}

TEST(CheckCommand, ReadsTheShippedMotor) {
  const Said said = say("check " + shipped("motor_iq2306.yaml"));
  EXPECT_EQ(said.code, 0) << said.err;
  EXPECT_THAT(said.out, HasSubstr("valid simulated motor\n  motor      2221 RPM/V, 0.045 ohm"));
}

TEST_F(Check, RefusesAFaultScriptAtItsLineAndColumn) {
  const auto refused = [&](const std::string& text, const std::string& words) {
    const std::string path = write("bad.yaml", text);
    const Said said = say("check " + path);
    EXPECT_EQ(said.code, 2);
    EXPECT_EQ(said.out, "");
    EXPECT_THAT(said.err, StartsWith(path + words));
  };
  refused("format: kphi-faults/1\nfaults:\n  - {at_s: 0, for_s: 1, kind: los}\n",
          ":3:31: unknown fault \"los\" of the load cell");
  refused("format: kphi-faults/1\nfaults:\n  - {at_s: 0, kind: motor_sag}\n", ":3:5: motor_sag needs for_s");
  refused("format: kphi-sim-motor/1\nmotor: {resistance_ohm: 0}\n", ":2:25: resistance_ohm: 0 is outside 0.001 to 10");
  refused("format: kphi-faults/1\nquirks: {axia: 1}\nfaults: []\n", ":2:16: \"1\" is not one of false, true");
  refused("format: kphi-fault/1\nfaults: []\n",
          ":1:9: unknown format kphi-fault/1; did you mean format: "
          "kphi-faults/1?");
}

}  // namespace kphi::profiles::check_test
