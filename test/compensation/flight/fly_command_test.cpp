// `kphi fly` as a user meets it: bench campaign, fit, flight.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <utility>

#include "test/compensation/flight/bench_coefficients.hpp"
#include "test/daq/bench_fixture.hpp"
#include "test/gnuplot.hpp"
#include "test/source_dir.hpp"

namespace kphi::test {
namespace fly_command_test {

using testing::HasSubstr;
using testing::Not;
namespace fs = std::filesystem;

const std::string kVehicle = kphi::test::source_dir() + "/profiles/foldable_drone.yaml";

/// Bench and fit once for all tests here.
class Fly : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TemporaryFolder();
    std::ofstream(*folder_ / "campaign.yaml") << short_campaign_text("0, 45, 90, 180, 270", 1);
    std::ofstream(*folder_ / "bench.yaml") << deterministic_config(1).text;
    coefficients_ = bench_coefficients(*folder_ / "campaign.yaml", *folder_ / "bench.yaml", *folder_);
  }
  static void TearDownTestSuite() {
    delete folder_;
    folder_ = nullptr;
  }

  struct Outcome {
    int code;
    std::string out, err;
  };
  static Outcome fly(std::vector<std::string> more, const std::string& coefficients = coefficients_,
                     const std::string& vehicle = kVehicle) {
    std::vector<std::string> arguments{KPHI_PROGRAM, "fly", "--coefficients", coefficients, "--vehicle", vehicle};
    arguments.insert(arguments.end(), more.begin(), more.end());
    Process process(arguments);
    const int code = process.wait();
    return {code, process.out(), process.err()};
  }

  static TemporaryFolder* folder_;
  static std::string coefficients_;
};
TemporaryFolder* Fly::folder_ = nullptr;
std::string Fly::coefficients_;

TEST_F(Fly, PrintsThePapersTablesAndWhatIsNotReproduced) {
  const Outcome flown = fly({});
  ASSERT_EQ(flown.code, 0) << flown.err;
  for (const char* part : {"Table I,", "Table II,", "Table III,", "gamma", "Not reproduced:", "the errors in X",
                           "the velocity term of Table II"}) {
    EXPECT_THAT(flown.out, HasSubstr(part));
  }
  EXPECT_EQ(flown.out, fly({}).out) << "the same seed flies the same";
  EXPECT_NE(flown.out, fly({"--seed", "2"}).out);
}

TEST_F(Fly, SaysInJsonWhatCompensationDoesAndDoesNotDependOnTheThreads) {
  const Outcome flown = fly({"--draws", "3", "--json", "--threads", "1"});
  ASSERT_EQ(flown.code, 0) << flown.err;
  EXPECT_EQ(flown.out, fly({"--draws", "3", "--json", "--threads", "3"}).out);
  const auto told = nlohmann::json::parse(flown.out);
  ASSERT_EQ(told["flights"].size(), 9u);
  const double plain = told["flights"][0]["legs"][1]["mean_error_m"][2];
  const double helped = told["flights"][1]["legs"][1]["mean_error_m"][2];
  EXPECT_GT(plain, 0.12);
  EXPECT_LT(std::fabs(helped), 0.4 * plain);
  EXPECT_EQ(told["study"]["draws"], 3);
  EXPECT_EQ(told["gamma"], 1.4);
  EXPECT_GE(told["not_reproduced"].size(), 2u);
}

TEST_F(Fly, LeavesTracesDrawsAndFigures) {
  const std::string out = *folder_ / "flown";
  const Outcome flown = fly({"--out", out, "--draws", "2"});
  ASSERT_EQ(flown.code, 0) << flown.err;
  for (const char* file : {"hover_xo_nc.csv", "rising_o_switched.csv", "draws.csv", "level_xo_c.gp", "draws.gp"}) {
    EXPECT_TRUE(fs::file_size(fs::path(out) / file) > 100) << file;
  }
  if (!gnuplot_is_installed()) GTEST_SKIP() << "apt install gnuplot-nox";
  for (const char* file : {"hover_xo_nc.svg", "rising_o_switched.svg", "draws.svg"}) {
    std::ostringstream svg;
    svg << std::ifstream(fs::path(out) / file).rdbuf();
    EXPECT_THAT(svg.str(), HasSubstr("</svg>")) << file;
    EXPECT_THAT(svg.str(), HasSubstr("<path")) << file << " draws something";
  }
}

TEST_F(Fly, FliesOneExperimentAlone) {
  const Outcome flown = fly({"--experiment", "level_o_switched"});
  ASSERT_EQ(flown.code, 0) << flown.err;
  EXPECT_THAT(flown.out, HasSubstr("level  O n.c. - O c."));
  EXPECT_THAT(flown.out, Not(HasSubstr("Table I,")));
  EXPECT_EQ(fly({"--experiment", "loop"}).code, 2);
}

/// The foldable drone's file with some things changed, in a file of its own.
std::string changed_vehicle(const TemporaryFolder& folder, const std::string& name,
                            const std::vector<std::pair<std::string, std::string>>& changes) {
  std::ostringstream read;
  read << std::ifstream(kVehicle).rdbuf();
  std::string text = read.str();
  for (const auto& [from, to] : changes) {
    const auto at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    if (at != std::string::npos) text.replace(at, from.size(), to);
  }
  const std::string path = folder / (name + ".yaml");
  std::ofstream(path) << text;
  return path;
}

const std::string kSquare = "half_side_m: 0.045 ", kTurns = "hinge_turn_deg: [0, 90, 180, 270]";

/// With this arm at each corner of a body of these half sides.
std::string outline(double x, double y) {
  std::ostringstream text;
  text << "body: {corners_m: [[" << x << "," << y << "],[" << -x << "," << y << "],[" << -x << "," << -y << "],[" << x
       << "," << -y << "]], hinges: [{x_m: " << x << ", y_m: " << y << ", turn_deg: 0}, {x_m: " << -x << ", y_m: " << y
       << ", turn_deg: 90}, {x_m: " << -x << ", y_m: " << -y << ", turn_deg: 180}, {x_m: " << x << ", y_m: " << -y
       << ", turn_deg: 270}]}";
  return text.str();
}

TEST_F(Fly, FliesABodyThatIsNoSquareAndASquareThatIsGivenAsAnOutlineAsTheSquare) {
  const std::string square = changed_vehicle(*folder_, "outline", {{kSquare, outline(0.045, 0.045)}, {kTurns, ""}});
  const Outcome flown = fly({}, coefficients_, square);
  ASSERT_EQ(flown.code, 0) << flown.err;
  EXPECT_EQ(flown.out, fly({}).out);

  const std::string oblong = changed_vehicle(*folder_, "oblong", {{kSquare, outline(0.05, 0.04)}, {kTurns, ""}});
  const Outcome other = fly({"--json"}, coefficients_, oblong);
  ASSERT_EQ(other.code, 0) << other.err;
  const auto flights = nlohmann::json::parse(other.out)["flights"];
  for (const auto& flight : flights) EXPECT_FALSE(flight["lost"]) << flight["name"];
  const double plain = flights[0]["legs"][1]["mean_error_m"][2], helped = flights[1]["legs"][1]["mean_error_m"][2];
  EXPECT_GT(plain, 0.1);
  EXPECT_LT(std::fabs(helped), 0.5 * plain);
}

TEST_F(Fly, SaysNothingInsteadOfZeroWhereEveryDrawLostAFlight) {
  const std::string limp = changed_vehicle(*folder_, "limp", {{"[12.7, 12.7, 5]", "[1.0, 1.0, 5]"}});
  const Outcome flown = fly({"--draws", "1", "--json"}, coefficients_, limp);
  ASSERT_EQ(flown.code, 0) << flown.err;
  const auto study = nlohmann::json::parse(flown.out)["study"];
  EXPECT_EQ(study["kept"], 0);
  EXPECT_TRUE(study["forward_ratio"].is_null());
  EXPECT_TRUE(study["by_loss_law"].empty());
}

TEST_F(Fly, FliesWhatTheVehicleFileSays) {
  const std::string stiff = changed_vehicle(*folder_, "stiff", {{"[6, 6, 15]", "[6, 6, 30]"}});
  const auto sag = [](const Outcome& flown) {
    return nlohmann::json::parse(flown.out)["flights"][0]["legs"][1]["mean_error_m"][2].get<double>();
  };
  const double usual = sag(fly({"--json", "--experiment", "hover_xo_nc"}));
  EXPECT_NEAR(sag(fly({"--json", "--experiment", "hover_xo_nc"}, coefficients_, stiff)) / usual, 0.5, 0.1)
      << "half the height error for twice the gain";
  const std::string heavy = changed_vehicle(*folder_, "heavy", {{"mass_kg: 0.60", "mass_kg: 2.60"}});
  EXPECT_THAT(fly({}, coefficients_, heavy).err, HasSubstr("2.6 kg"));
}

TEST_F(Fly, RefusesWhatItCannotFlyWithOneLine) {
  struct Case {
    const char* name;
    std::vector<std::pair<std::string, std::string>> changes;
    std::vector<const char*> says;
  };
  for (const Case& refused : std::vector<Case>{
           {"x_only", {{"  O: [180", "  P: [180"}}, {"shape O", "shapes_deg"}},
           {"still", {{"dynamics:", "dynamic:"}}, {"dynamic is not a key"}},
           {"slow", {{"speed_max_rpm: 19100", "speed_max_rpm: 9100"}}, {"speed_max_rpm"}},
           {"spins", {{"[1, -1, 1, -1]", "[1, 1, 1, 1]"}}, {"rotor_spins"}},
           {"by_area", {{"overlap: rim_arc", "overlap: area_share"}}, {"fitted with overlap rim_arc", "area_share"}},
       }) {
    const Outcome flown = fly({}, coefficients_, changed_vehicle(*folder_, refused.name, refused.changes));
    EXPECT_EQ(flown.code, 2) << refused.name;
    EXPECT_EQ(std::count(flown.err.begin(), flown.err.end(), '\n'), 1) << flown.err;
    for (const char* part : refused.says) EXPECT_THAT(flown.err, HasSubstr(part));
  }
  const Outcome no_file = fly({}, "nowhere.yaml");
  EXPECT_EQ(no_file.code, 2);
  EXPECT_THAT(no_file.err, HasSubstr("nowhere.yaml"));
}

TEST_F(Fly, AsksForTheSectionsThatOnlyAFlightNeeds) {
  std::ostringstream read;
  read << std::ifstream(kVehicle).rdbuf();
  const std::string text = read.str();
  const auto without = [&](const std::string& from, const std::string& to) {
    const auto begin = text.find("\n" + from), end = to.empty() ? text.size() : text.find("\n" + to);
    const std::string path = *folder_ / ("without_" + from.substr(0, 7) + ".yaml");
    std::ofstream(path) << text.substr(0, begin + 1) << text.substr(std::min(end, text.size()));
    return fly({}, coefficients_, path);
  };
  for (const auto& [section, next] : {std::pair{"dynamics:", "control:"}, {"control:", ""}}) {
    const Outcome flown = without(section, next);
    EXPECT_EQ(flown.code, 2);
    EXPECT_THAT(flown.err, HasSubstr("no section " + std::string(section).substr(0, 7)));
  }
}

}  // namespace fly_command_test
}  // namespace kphi::test
