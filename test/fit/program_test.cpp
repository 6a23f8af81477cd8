// kphi fit, report, compare, export and import as a person types them, and types them wrong.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <tuple>

#include "compensation/units.hpp"
#include "fit/model/step_selection.hpp"
#include "fit/model/thrust_fit.hpp"
#include "results/file_layer.hpp"
#include "results/reduction/step_averages.hpp"
#include "results/steps_csv.hpp"
#include "test/end_to_end/process.hpp"
#include "test/fit/bench_study.hpp"
#include "test/source_dir.hpp"
#include "test/temporary_folder.hpp"

namespace kphi::fit {
namespace program_test {

using nlohmann::json;
using test::Process;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

struct Answer {
  int code = -1;
  std::string out, err;
};

Answer kphi(std::vector<std::string> arguments, const std::string& input = {}) {
  arguments.insert(arguments.begin(), test::kphi());
  Process process(arguments, input);
  const int code = process.wait();
  return {code, process.out(), process.err()};
}

class FitProgram : public ::testing::Test {
 protected:
  /// A folder with the steps of one simulated campaign.
  std::string steps(const std::string& name, unsigned seed = 1, double inches = 5, int blades = 3, double factor = 1) {
    auto all = study_campaign({}, seed).steps;
    for (auto& step : all) {
      step.propeller = name;
      step.diameter_in = inches;
      step.blades = blades;
      step.thrust_n *= factor;
      step.torque_nm *= factor * inches / 5;
    }
    std::filesystem::create_directories(folder_ / name);
    results::write_steps(folder_ / (name + "/steps.csv"), all);
    return (folder_ / name).string();
  }
  std::string file(const std::string& name, const std::string& text) {
    std::ofstream(folder_ / name) << text;
    return (folder_ / name).string();
  }
  void expect_refused(const std::vector<std::string>& arguments, int code, const std::string& words) {
    const Answer answer = kphi(arguments);
    EXPECT_EQ(answer.code, code) << arguments.front() << ": " << answer.err;
    EXPECT_THAT(answer.err, HasSubstr(words));
    EXPECT_EQ(answer.out, "") << "words go to stderr";
    EXPECT_LE(std::count(answer.err.begin(), answer.err.end(), '\n'), 3) << answer.err;
  }

  test::TemporaryFolder folder_;
};

TEST_F(FitProgram, DrawsTheReportOfTheFitAgainByteForByte) {
  const std::string config = steps("5x3");
  const std::vector<std::vector<std::string>> ways{
      {"--u", "calibration=0.004", "--u", "alignment-deg=1.5", "--u", "clock=2e-5"},
      {"--loss", "huber", "--weights", "thrust", "--estimator", "offset", "--anchored", "--points", "45,180",
       "--curve-loss", "cauchy"},
      {"--leave-out", "90:2:plate slipped", "--propeller", "mine", "--at-speed-rpm", "19100"}};
  for (std::vector<std::string> way : ways) {
    way.insert(way.begin(), {"fit", config});
    const Answer fit = kphi(way);
    ASSERT_EQ(fit.code, 0) << fit.err;
    const std::string page = results::read_text(config + "/report.html");
    ASSERT_EQ(kphi({"report", config}).code, 0);
    EXPECT_TRUE(results::read_text(config + "/report.html") == page) << way[2];
  }
}

TEST_F(FitProgram, FitsTheMeansOfACampaignAsItsSteps) {
  const std::string folder = steps("5x3");
  auto means = results::means_of(results::read_steps(folder + "/steps.csv"));
  results::write_steps(folder + "/means.csv", means);
  const auto fitted = [&](const std::string& table) {
    const Answer answer = kphi(
        {"fit", folder + "/" + table, "--json", "--no-report", "--accept", "--out", folder + "/" + table + ".yaml"});
    EXPECT_EQ(answer.code, 0) << answer.err;
    return std::pair(json::parse(answer.out), answer.err);
  };
  const auto [of_steps, said_of_steps] = fitted("steps.csv");
  const auto [of_means, said_of_means] = fitted("means.csv");
  EXPECT_NEAR(of_means["K_T"].get<double>() / of_steps["K_T"].get<double>(), 1, 1e-6);
  EXPECT_NEAR(of_means["K_T_expanded_95"].get<double>() / of_steps["K_T_expanded_95"].get<double>(), 1, 0.3)
      << "of one campaign, whose zeros do not tell how far they moved";
  EXPECT_THAT(results::read_text(folder + "/means.csv.yaml"), HasSubstr("repetitions: 3"));
  EXPECT_THAT(said_of_means, Not(HasSubstr("unknown number")));
  for (auto& row : means)
    row.repetitions_averaged = row.repetitions_left_out = row.k_scatter_share = row.thrust_scatter_n = std::nan("");
  results::write_steps(folder + "/means.csv", means);
  EXPECT_THAT(fitted("means.csv").second, HasSubstr("averages of an unknown number of repetitions"));
}

TEST_F(FitProgram, HandsTheOverlapMeasureToWhoFlies) {
  const std::string config = steps("5x3");
  const std::string vehicle = test::source_dir() + "/profiles/foldable_drone.yaml";
  const std::string row =
      "theta1_deg,theta2_deg,theta3_deg,theta4_deg,thrust1_n,thrust2_n,thrust3_n,thrust4_n\n45,45,45,45,1,1,1,1\n";
  const std::vector<std::string> compensate{"compensate", "--coefficients", config + "/coefficients.yaml", "--vehicle",
                                            vehicle};
  ASSERT_EQ(kphi({"fit", config, "--no-report"}).code, 0);
  EXPECT_EQ(kphi(compensate, row).code, 0);
  ASSERT_EQ(kphi({"fit", config, "--no-report", "--overlap", "load_share"}).code, 0);
  const Answer refused = kphi(compensate, row);
  EXPECT_EQ(refused.code, 2);
  EXPECT_THAT(refused.err, AllOf(HasSubstr("load_share"), HasSubstr("rim_arc")));
  EXPECT_THAT(kphi({"export", config, "--to", "ros2"}).out, HasSubstr("overlap: \"load_share\""));
  expect_refused({"fit", config, "--overlap", "rim"}, 2, "rim_arc");
}

TEST_F(FitProgram, ComparesAFamilyFromItsFolders) {
  const std::vector<std::string> places{steps("5x2", 1, 5, 2, 0.76), steps("5x3", 2), steps("6x2", 3, 6, 2, 1.55),
                                        steps("6x3", 4, 6, 3, 1.85)};
  for (const auto& config : places) ASSERT_EQ(kphi({"fit", config, "--no-report"}).code, 0);
  std::vector<std::string> words{"compare", places[0], places[1], places[2], places[3]};
  const Answer table = kphi(words);
  EXPECT_EQ(table.code, 0) << table.err;
  EXPECT_THAT(table.out, AllOf(Not(HasSubstr("the paper's statement")), HasSubstr("One slope")));
  words.emplace_back("--claims");
  const Answer claims = kphi(words);
  EXPECT_EQ(claims.code, 0) << claims.err;
  EXPECT_THAT(claims.out, AllOf(HasSubstr("holds"), HasSubstr("the paper's statement"), HasSubstr("One slope")));
  words.insert(words.end(), {"--predict", "7x3", "--json"});
  const json found = json::parse(kphi(words).out);
  EXPECT_EQ(found.at("claims").size(), 16u);
  EXPECT_EQ(found.at("predictions").size(), 5u);
  EXPECT_EQ(found.at("shared_slopes").size(), 2u);
  expect_refused({"compare", places[0], places[1], "--predict", "7x3"}, 2, "at least three");
  expect_refused({"compare", places[0], places[1], places[2], "--predict", "seven"}, 2, "such as 7x3");
  expect_refused({"compare", places[0], places[1], places[2], "--expect", "agree"}, 2, "two results");
  expect_refused({"compare", places[0]}, 2, "RESULT");
}

TEST_F(FitProgram, ComparesLogsOverTheSpeedsOfBoth) {
  // k of this propeller rises by 6 % over the speeds; one log has the slow half of them, the other the fast.
  std::vector<std::string> logs;
  for (const auto& [name, from, to] : {std::tuple("slow", 3000.0, 12000.0), std::tuple("fast", 8000.0, 20000.0)}) {
    StudyTruth rising;
    rising.rise = 0.06;
    rising.calibration = rising.density = rising.clock = 0;
    auto all = study_campaign(rising, 7).steps;
    std::erase_if(all, [&, from = from, to = to](const results::StepMean& step) {
      const double rpm = to_rpm(RadPerSec(step.commanded_speed_rad_s));
      return step.occlusion_deg > 0 || rpm < from || rpm > to;
    });
    std::filesystem::create_directories(folder_ / name);
    results::write_steps(folder_ / (std::string(name) + "/steps.csv"), all);
    logs.push_back((folder_ / name).string());
  }
  const Answer answer = kphi({"compare", logs[0], logs[1], "--json"});
  ASSERT_EQ(answer.code, 0) << answer.err;
  const json found = json::parse(answer.out);
  EXPECT_NEAR(found["differences"][0]["share"].get<double>(), 0, 1e-9) << "the same steps, where both have them";
  EXPECT_THAT(answer.out, HasSubstr("which both reached"));
  const json slow = json::parse(kphi({"fit", logs[0], "--json", "--no-report"}).out),
             fast = json::parse(kphi({"fit", logs[1], "--json", "--no-report"}).out);
  EXPECT_GT(fast["K_T"].get<double>() / slow["K_T"].get<double>(), 1.01) << "or there was nothing to mend";
  const json alone = json::parse(kphi({"compare", logs[0], logs[0], "--json"}).out);
  EXPECT_NEAR(alone["differences"][0]["a"].get<double>() / slow["k_standard"].get<double>(), 1, 1e-12)
      << "a fit and a comparison give one number";
  EXPECT_THAT(kphi({"compare", logs[0], steps("5x3")}).err, HasSubstr("not fitted yet"));
}

TEST_F(FitProgram, ComparesALogWithAFittedCampaignOverTheSpeedsOfBoth) {
  StudyTruth rising;
  rising.rise = 0.06;
  rising.calibration = rising.density = rising.clock = 0;
  const std::string campaign = (folder_ / "campaign").string(), log = (folder_ / "log").string();
  auto all = study_campaign(rising, 7).steps;
  std::filesystem::create_directories(campaign);
  std::filesystem::create_directories(log);
  results::write_steps(campaign + "/steps.csv", all);
  std::erase_if(all, [](const results::StepMean& step) {
    return step.occlusion_deg > 0 || to_rpm(RadPerSec(step.commanded_speed_rad_s)) > 9000;
  });
  results::write_steps(log + "/steps.csv", all);
  ASSERT_EQ(kphi({"fit", campaign, "--no-report", "--accept"}).code, 0);
  for (const auto& [a, b] :
       {std::pair(log, campaign), std::pair(campaign, log), std::pair(log, campaign + "/coefficients.yaml")}) {
    const Answer answer = kphi({"compare", a, b, "--json"});
    ASSERT_EQ(answer.code, 0) << answer.err;
    EXPECT_NEAR(json::parse(answer.out)["differences"][0]["share"].get<double>(), 0, 1e-9) << "the same steps";
    EXPECT_THAT(answer.out, AllOf(HasSubstr("which both reached"), HasSubstr("its runs at 0° alone"),
                                  Not(HasSubstr("different speeds"))));
  }
  std::filesystem::remove(campaign + "/steps.csv");
  EXPECT_THAT(kphi({"compare", log, campaign}).out, HasSubstr("different speeds")) << "nothing left to fit again";
}

TEST_F(FitProgram, SaysByHowMuchTheThrustMayBeWrongWhereTheVehicleFlies) {
  const std::string folder = steps("5x3"), drone = test::source_dir() + "/profiles/foldable_drone.yaml";
  const auto says = AllOf(HasSubstr("thrust within"), HasSubstr("where foldable_drone flies, φ up to 65°"));
  const Answer fitted = kphi({"fit", folder, "--no-report", "--vehicle", drone});
  ASSERT_EQ(fitted.code, 0) << fitted.err;
  EXPECT_THAT(fitted.err, says);
  EXPECT_THAT(kphi({"check", folder + "/coefficients.yaml", drone}).out, says);
  EXPECT_THAT(kphi({"compensate", "--coefficients", folder + "/coefficients.yaml", "--vehicle", drone}, "").err, says);
  const Answer exported = kphi({"export", folder, "--to", "c", "--vehicle", drone});
  EXPECT_EQ(exported.code, 0) << exported.err;
  EXPECT_THAT(exported.err, says);
  EXPECT_THAT(exported.out,
              AllOf(HasSubstr("(95 %) where foldable_drone flies"), HasSubstr("torque per newton of thrust")));
}

TEST_F(FitProgram, RefusesWhatItCannotFitInOneLineWithTheNextMove) {
  const std::string empty = (folder_ / "empty").string();
  std::filesystem::create_directories(empty);
  const std::string config = steps("5x3");
  expect_refused({"fit", (folder_ / "none").string()}, 2, "does not exist");
  expect_refused({"fit", empty}, 2, "`kphi run` or `kphi import`");
  expect_refused({"fit", file("empty.csv", "")}, 2, "empty.csv");
  expect_refused({"fit", file("word.csv", "phi_deg,k_n_s2_per_rad2\n0,1.5e-6\n45,abc\n")}, 2, "word.csv:3");
  expect_refused({"fit", file("unit.csv", "phi_deg,k\n0,1.5e-6\n45,1.4e-6\n90,1.2e-6\n")}, 2,
                 "the unit of k is not known");
  expect_refused({"fit", file("nan.csv", "phi_deg,k_n_s2_per_rad2\n0,nan\n45,1e-6\n90,1e-6\n")}, 2, "nan.csv:2");
  expect_refused({"fit", file("nothing.csv", "a,b\n1,2\n")}, 2, "nothing.csv");
  expect_refused(
      {"fit", file("k.csv", "phi_deg,k_n_s2_per_rad2\n0,1.5e-6\n45,1.4e-6\n90,1.2e-6\n"), "--u", "clock=1e-4"}, 2,
      "--u needs steps");
  expect_refused({"fit", config, "--u", "clock"}, 2, "NAME=VALUE");
  expect_refused({"fit", config, "--u", "clock=nan"}, 2, "NAME=VALUE");
  expect_refused({"fit", config, "--raw"}, 2, "campaign folder");
  expect_refused({"fit", config, "--leave-out", "90:2"}, 2, "plate slipped");
  expect_refused({"fit", config, "--leave-out", "91:2:x"}, 5, "91");
  expect_refused({"fit", config, "--points", "45,91"}, 5, "91");
  expect_refused({"fit", config, "--speed-range-rpm", "5000"}, 2, "3000:19100");
  expect_refused({"fit", config, "--speed-range-rpm", "30000:40000"}, 5, "outside the speed range");
  expect_refused({"fit", config, "--at-speed-rpm", "123"}, 5, "name a speed of the profile");
  expect_refused({"fit", config, "--loss", "soft"}, 2, "\"soft\" is not one of cauchy, huber, none, tukey");
  EXPECT_FALSE(std::filesystem::exists(config + "/coefficients.yaml")) << "what is refused leaves nothing behind";
}

TEST_F(FitProgram, RefusesReportsComparisonsAndExportsOfWhatIsNotThere) {
  const std::string config = steps("5x3");
  expect_refused({"report", config}, 2, "kphi fit " + config);
  expect_refused({"compare", config, config}, 2, "not fitted yet; run `kphi fit");
  expect_refused({"export", config, "--to", "px4"}, 2, "not fitted yet; run `kphi fit");
  ASSERT_EQ(kphi({"fit", config, "--no-report"}).code, 0);
  expect_refused({"export", config, "--to", "cleanflight"}, 2, "agilicious");
  expect_refused({"export", config, "--to", "ardupilot"}, 2, "name the --vehicle");
  expect_refused({"fit", steps("mirrored", 1, 5, 3, -1)}, 5, "positive");
  expect_refused({"export", config, "--to", "gazebo", "--phi-deg", "300"}, 2, "0 to 270");
  expect_refused({"export", config, "--to", "gazebo", "--phi-deg", "nan"}, 2, "nan is not a finite number");
  expect_refused({"import", file("unit.csv", "Thrust (stone),Motor Electrical Speed (RPM)\n1,2\n"), "--out",
                  (folder_ / "tables").string()},
                 2, "stone");
  expect_refused({"import", folder_.path().string(), "--out", (folder_ / "tables").string()}, 2, "");
}

TEST_F(FitProgram, TakesOneValueForEachOptionThatMayBeRepeated) {
  const std::string config = steps("5x3");
  EXPECT_EQ(kphi({"fit", "--no-report", "--u", "clock=1e-5", "--leave-out", "90:2:plate slipped", config}).code, 0)
      << "the folder is no second value";
}

TEST_F(FitProgram, ExitsWithFiveForAResultThatMustNotFlyUnlessItIsAccepted) {
  const std::string folder = steps("5x3");
  auto exchanged = results::read_steps(folder + "/steps.csv");
  for (auto& step : exchanged)
    if (step.occlusion_deg == 90 || step.occlusion_deg == 180) step.occlusion_deg = 270 - step.occlusion_deg;
  results::write_steps(folder + "/steps.csv", exchanged);
  const Answer refused = kphi({"fit", folder, "--no-report"});
  EXPECT_EQ(refused.code, 5);
  EXPECT_THAT(refused.out, AllOf(HasSubstr("do not fly yet"), HasSubstr("exchanged")));
  EXPECT_THAT(refused.err, HasSubstr("--accept"));
  EXPECT_EQ(kphi({"fit", folder, "--no-report", "--accept"}).code, 0);
}

TEST_F(FitProgram, FliesTheTableWhereKOverPhiIsNoLine) {
  const std::string folder = (folder_ / "bent").string();
  std::filesystem::create_directories(folder);
  results::write_steps(folder + "/steps.csv", study_campaign({.bend = -0.2}, 1).steps);
  const Answer line = kphi({"fit", folder, "--no-report"});
  EXPECT_EQ(line.code, 5);
  EXPECT_THAT(line.out, HasSubstr("fit a table (--form table)"));
  // Between plates so far apart a curve that bends so much may be anywhere.
  const Answer table = kphi({"fit", folder, "--form", "table", "--accept"});
  EXPECT_EQ(table.code, 0) << table.err << table.out;
  EXPECT_THAT(table.out, AllOf(HasSubstr("k(180 deg)"), Not(HasSubstr("k(0 deg)")), Not(HasSubstr("is not a line"))));
  EXPECT_THAT(results::read_text(folder + "/report.html"), HasSubstr("table"));
  const std::string page = results::read_text(folder + "/report.html");
  ASSERT_EQ(kphi({"report", folder}).code, 0);
  EXPECT_TRUE(results::read_text(folder + "/report.html") == page) << "the file says that it was a table";
  const json found = json::parse(kphi({"fit", folder, "--form", "table", "--no-report", "--json"}).out);
  ASSERT_EQ(found.at("curve").at("knots").size(), 5u);
  EXPECT_EQ(found.at("curve").at("knots")[4].at("phi_deg"), 270);

  const std::string coefficients = folder + "/coefficients.yaml";
  const std::string vehicle = test::source_dir() + "/profiles/foldable_drone.yaml";
  const auto compensate = [&](const std::string& files) {
    return kphi({"compensate", "--coefficients", files, "--vehicle", vehicle},
                "theta1_deg,theta2_deg,theta3_deg,theta4_deg,thrust1_n,thrust2_n,thrust3_n,thrust4_n\n"
                "180,180,180,180,1,1,1,1\n");
  };
  const Answer one = compensate(coefficients),
               four = compensate(coefficients + "," + coefficients + "," + coefficients + "," + coefficients);
  EXPECT_EQ(one.code, 0) << one.err;
  EXPECT_EQ(one.out, four.out);
  const Answer two = compensate(coefficients + "," + coefficients);
  EXPECT_EQ(two.code, 2);
  EXPECT_THAT(two.err, HasSubstr("names 2 files, but the vehicle has 4 rotors"));
}

TEST_F(FitProgram, RefusesALogWithoutOcclusionsWhoseThrustNoPowerMakes) {
  const std::string folder = steps("5x3");
  auto log = results::read_steps(folder + "/steps.csv");
  std::erase_if(log, [](const auto& step) { return step.occlusion_deg != 0; });
  for (auto& step : log) step.thrust_n *= 4;
  results::write_steps(folder + "/steps.csv", log);
  const Answer refused = kphi({"fit", folder, "--no-report"});
  EXPECT_EQ(refused.code, 5);
  EXPECT_THAT(refused.out, AllOf(HasSubstr("do not fly yet"), HasSubstr("an ideal disk of this diameter needs")));
  EXPECT_EQ(kphi({"fit", folder, "--no-report", "--accept"}).code, 0);
}

TEST_F(FitProgram, FitsALogWithoutOcclusionsToKTAlone) {
  const std::string folder = steps("5x3");
  auto log = results::read_steps(folder + "/steps.csv");
  std::erase_if(log, [](const auto& step) { return step.occlusion_deg != 0; });
  results::write_steps(folder + "/steps.csv", log);
  const Answer fit = kphi({"fit", folder});
  EXPECT_EQ(fit.code, 0) << fit.err;
  EXPECT_THAT(fit.out, AllOf(HasSubstr("K_T alone, no k(φ) to fly with"), HasSubstr("± is 95 %")));
  EXPECT_THAT(results::read_text(folder + "/coefficients.yaml"), AllOf(HasSubstr("form: none"), HasSubstr("no_curve")));
  const std::string page = results::read_text(folder + "/report.html");
  EXPECT_THAT(page, AllOf(HasSubstr("no occlusion was measured"), HasSubstr("Uncertainty budget")));
  ASSERT_EQ(kphi({"report", folder}).code, 0);
  EXPECT_TRUE(results::read_text(folder + "/report.html") == page);
  const json found = json::parse(kphi({"fit", folder, "--no-report", "--json"}).out);
  EXPECT_TRUE(found.at("curve").is_null());
  EXPECT_EQ(found.at("verdict"), "no_curve");
  EXPECT_NEAR(found.at("K_T").get<double>() / fit_thrust(points_of(log)).parameters.k, 1, 1e-4) << "by the slow steps";
  const std::string vehicle = test::source_dir() + "/profiles/foldable_drone.yaml";
  for (const char* target : {"px4", "gazebo", "agilicious", "ros2", "csv", "mcap"})
    EXPECT_EQ(kphi({"export", folder, "--to", target, "--out", folder + "/" + target}).code, 0) << target;
  EXPECT_THAT(results::read_text(folder + "/px4"), HasSubstr("CA_ROTOR0_CT"));
  EXPECT_THAT(kphi({"export", folder, "--to", "px4"}).err,
              AllOf(HasSubstr("THR_MDL_FAC 1.0 is right only for motors that hold a commanded speed"),
                    HasSubstr("no occlusion was measured")));
  EXPECT_THAT(results::read_text(folder + "/ros2"), Not(HasSubstr("line_slope")));
  expect_refused({"export", folder, "--to", "c"}, 2, "K_T alone, no k(φ): kphi_curve needs occlusions");
  for (const char* target : {"c", "px4", "ros2", "ardupilot"})
    expect_refused({"export", folder, "--to", target, "--vehicle", vehicle}, 2, "K_T alone, no k(φ)");
  expect_refused({"export", folder, "--to", "ardupilot"}, 2, "name the --vehicle");
  expect_refused({"export", folder, "--to", "betaflight"}, 2, "no throttle law for betaflight");
  expect_refused({"export", folder, "--to", "gazebo", "--phi-deg", "45"}, 2, "K_T alone, no k(φ): --phi-deg");
  expect_refused({"fly", "--coefficients", folder + "/coefficients.yaml", "--vehicle", vehicle}, 2,
                 "K_T alone, no k(φ): no occlusion was measured");
  EXPECT_EQ(kphi({"check", folder + "/coefficients.yaml"}).code, 0);
  EXPECT_EQ(kphi({"compare", folder, folder}).code, 0);
}

TEST_F(FitProgram, TellsAllItFoundAsJson) {
  const Answer fit = kphi({"fit", steps("5x3"), "--no-report", "--json"});
  ASSERT_EQ(fit.code, 0);
  const json found = json::parse(fit.out);
  EXPECT_EQ(found.at("overlap"), "rim_arc");
  EXPECT_EQ(found.at("analysis").at("speed").size(), 5u);
  EXPECT_TRUE(found.at("analysis").at("outlying_runs").is_array());
}

TEST_F(FitProgram, ExplainsEveryCommand) {
  for (const char* command : {"fit", "report", "compare", "export", "import"}) {
    const Answer help = kphi({command, "--help"});
    EXPECT_EQ(help.code, 0);
    EXPECT_THAT(help.out, HasSubstr("kphi " + std::string(command))) << "an example to type";
    EXPECT_THAT(help.out, Not(HasSubstr("ENUM"))) << "a word of the program's own inside";
  }
}

/// A certified problem of NIST as a table of k over φ. Through the origin: with k = 0 at φ = 0, where the line starts.
struct NistTable {
  std::string text = "phi_deg,k_n_s2_per_rad2\n";
  std::vector<std::array<double, 2>> certified;  ///< estimate and its standard deviation, one per term
  double residual_deviation = 0;
  bool through_origin = false;
};

NistTable nist(const std::string& name) {
  NistTable table;
  std::istringstream lines(results::read_text(std::string(test::source_dir()) + "/test/fit/nist/" + name + ".txt"));
  for (std::string line, word, x, y; std::getline(lines, line);) {
    std::istringstream words(line);
    words >> word >> y >> x;
    if (word == "data") table.text += x + "," + y + "\n";
    if (word == "certified") table.certified.push_back({std::stod(y), std::stod(x)});
    if (word == "residual_deviation") table.residual_deviation = std::stod(y);
    if (word == "model") table.through_origin = line.ends_with("1 1");
  }
  if (table.through_origin) table.text += "0,0\n";
  return table;
}

TEST_F(FitProgram, FitsTheLinesThatNistCertified) {
  for (const char* name : {"Norris", "NoInt1", "NoInt2"}) {
    const NistTable problem = nist(name);
    std::vector<std::string> fit{"fit", file(std::string(name) + ".csv", problem.text), "--json", "--no-report"};
    if (problem.through_origin) fit.emplace_back("--anchored");
    const Answer answer = kphi(fit);
    EXPECT_EQ(answer.code, 5) << "no drone flies on it";
    EXPECT_THAT(answer.err, HasSubstr("no coefficient file was written"));
    EXPECT_FALSE(std::filesystem::exists(folder_ / "coefficients.yaml"));
    const json found = json::parse(answer.out);
    std::vector<nlohmann::json> terms{found["curve"]["intercept"], found["curve"]["slope_per_deg"]};
    if (problem.through_origin) terms.erase(terms.begin());
    ASSERT_EQ(terms.size(), problem.certified.size());
    for (std::size_t i = 0; i < terms.size(); ++i) {
      EXPECT_NEAR(terms[i]["value"].get<double>() / problem.certified[i][0], 1, 1e-10) << name;
      EXPECT_NEAR(terms[i]["u"].get<double>() / problem.certified[i][1], 1, 1e-10) << name;
    }
    EXPECT_NEAR(found["scatter"].get<double>() / problem.residual_deviation, 1, 1e-10) << name;
  }
}

TEST_F(FitProgram, AveragesTheRowsOfATableThatNamesAnAngleTwice) {
  const std::string table =
      file("twice.csv",
           "phi_deg,k_n_s2_per_rad2\n0,1.5e-6\n0,1.503e-6\n90,1.201e-6\n90,1.199e-6\n180,8.99e-7\n"
           "180,9.01e-7\n270,6.01e-7\n270,6e-7\n");
  const std::string out = (folder_ / "twice.yaml").string();
  const Answer twice = kphi({"fit", table, "--no-report", "--accept", "--out", out});
  EXPECT_EQ(twice.code, 0) << twice.err;
  EXPECT_THAT(twice.err,
              HasSubstr("4 of 4 angles are listed more than once, in 8 rows: averaged; their scatter, 0.13 % of "
                        "k by 4 degrees of freedom, is the error of every k"));
  const std::string text = results::read_text(out);
  EXPECT_THAT(text, HasSubstr("phi_deg: 90.0, k: 1.2e-06, u: "));
  EXPECT_THAT(text, Not(HasSubstr("u: unknown")));
}

TEST_F(FitProgram, FitsStepsWithoutTheirZeroAndSaysSo) {
  const std::string folder = steps("5x3");
  std::string text = results::read_text(folder + "/steps.csv");
  std::istringstream lines(text);
  std::string header, without;
  std::getline(lines, header);
  const auto place =
      std::count(header.begin(), header.begin() + static_cast<std::ptrdiff_t>(header.find("zero_n")), ',');
  lines.seekg(0);
  for (std::string line; std::getline(lines, line);) {
    std::size_t begin = 0;
    for (long i = 0; i < place; ++i) begin = line.find(',', begin) + 1;
    without += line.erase(begin, line.find(',', begin) + 1 - begin) + "\n";
  }
  const std::string out = (folder_ / "k.yaml").string();
  const Answer fit = kphi({"fit", file("steps.csv", without), "--no-report", "--accept", "--out", out, "--json"});
  const Answer whole = kphi({"fit", folder, "--no-report", "--accept", "--json"});
  EXPECT_EQ(fit.code, 0) << fit.err;
  EXPECT_THAT(fit.err, HasSubstr("the zero that was subtracted from the thrust is unknown (no zero_n)"));
  EXPECT_EQ(json::parse(fit.out)["K_T"], json::parse(whole.out)["K_T"]);
  EXPECT_THAT(whole.err, Not(HasSubstr("zero that was subtracted")));
}

TEST_F(FitProgram, FitsATableThatCannotFlyAsFarAsItGoes) {
  const Answer without = kphi({"fit", file("without.csv", "phi_deg,k_n_s2_per_rad2\n90,1.2e-6\n180,8e-7\n")});
  EXPECT_EQ(without.code, 5);
  EXPECT_THAT(without.out, AllOf(HasSubstr("it has no k at phi_deg 0"), Not(HasSubstr("slope      -4.44444e-09 ±"))));
}

/// Thirty logs of one stand that kphi has not seen: a title, German names, semicolons, decimal commas, thousands.
TEST_F(FitProgram, ReadsAFolderOfThirtyLogsOfOneKind) {
  std::vector<std::string> logs;
  for (int i = 0; i < 30; ++i) {
    std::string text = fmt::format("Schubmessung Nr. {}\r\n\r\nZeit [s];Gas [%];Drehzahl [1/min];Schub [g]\r\n", i + 1);
    for (int step = 0; step < 14; ++step) {
      const double rpm = 3200 + 900 * step, omega = rpm * kRadPerSecPerRpm;
      const double grams = (1 + 0.002 * (i % 5)) * 1.3e-6 * omega * omega / 9.80665e-3;
      const std::string speed = fmt::format("{:.0f}", rpm), thrust = fmt::format("{:.1f}", grams);
      text += fmt::format("{},0;{};{}.{};{},{}\r\n", 3 * step, 6 * step + 10, speed.substr(0, speed.size() - 3),
                          speed.substr(speed.size() - 3), thrust.substr(0, thrust.size() - 2), thrust.back());
    }
    logs.push_back(file(fmt::format("messung{:02}.csv", i + 1), text));
  }
  const std::string tables = (folder_ / "tables").string(), layout = (folder_ / "stand.yaml").string();
  const Answer one = kphi({"import", logs.front(), "--out", tables, "--layout", layout});
  ASSERT_EQ(one.code, 0) << one.err;
  EXPECT_THAT(one.err, AllOf(HasSubstr("names in line 3, rows from line 4"),
                             HasSubstr("4, separated by semicolon; numbers such as 1.234,5"),
                             HasSubstr("column 4 \"Schub [g]\" in g"), HasSubstr("written to " + layout),
                             HasSubstr("next: kphi fit '" + tables + "/messung01'")));
  EXPECT_EQ(kphi({"check", layout}).code, 0);
  std::vector<std::string> all{"import", "--out", tables, "--layout", layout, "--same-propeller"};
  all.insert(all.end(), logs.begin(), logs.end());
  const Answer imported = kphi(all);
  ASSERT_EQ(imported.code, 0) << imported.err;
  EXPECT_THAT(imported.err, HasSubstr("next: kphi report " + tables + "/*/ --out " + tables + "/report.html"));
  const Answer listed = kphi({"list", tables});
  EXPECT_EQ(std::ranges::count(listed.out, '\n'), 31) << listed.out;
  EXPECT_THAT(listed.out, HasSubstr("messung30"));
  EXPECT_EQ(kphi({"fit", tables + "/messung01"}).code, 0);
  std::vector<std::string> page{"report", "--out", (folder_ / "all.html").string()};
  for (int i = 0; i < 30; ++i) page.push_back(fmt::format("{}/messung{:02}", tables, i + 1));
  const Answer report = kphi(page);
  EXPECT_EQ(report.code, 0) << report.err;
  const Answer compared = kphi({"compare", tables + "/messung01", tables + "/messung05"});
  EXPECT_EQ(compared.code, 0) << compared.err;
  EXPECT_THAT(compared.out, HasSubstr("K_T"));
}

}  // namespace program_test
}  // namespace kphi::fit
