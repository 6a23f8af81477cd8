// `kphi fly` as a user meets it: bench campaign, fit, flight.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "test/compensation/flight/bench_coefficients.hpp"
#include "test/daq/bench_fixture.hpp"
#include "test/source_dir.hpp"

namespace kphi::test {
namespace {

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
    std::ofstream(*folder_ / "bench.yaml") << deterministic_place(1).text;
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
  if (flown.err.find("no figures") != std::string::npos) GTEST_SKIP() << flown.err;
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

TEST_F(Fly, RefusesWhatItCannotFlyWithOneLine) {
  const Outcome no_file = fly({}, "nowhere.yaml");
  EXPECT_EQ(no_file.code, 2);
  EXPECT_THAT(no_file.err, HasSubstr("nowhere.yaml"));

  const std::string vehicle = *folder_ / "x_only.yaml";
  std::ofstream(vehicle) << "format: kphi-vehicle/1\nname: x_only\nhalf_side_m: 0.045\narm_length_m: 0.117\n"
                            "propeller_radius_m: 0.0635\nshapes_deg: {X: [45, 45, 45, 45]}\narm_angle_min_deg: -90\n"
                            "arm_angle_max_deg: 180\nspeed_min_rpm: 0\nspeed_max_rpm: 19100\n";
  const Outcome no_o = fly({}, coefficients_, vehicle);
  EXPECT_EQ(no_o.code, 2);
  EXPECT_THAT(no_o.err, HasSubstr("shape O"));

  const std::string oblong = *folder_ / "oblong.yaml";
  std::ofstream(oblong) << "format: kphi-vehicle/1\nname: oblong\narm_length_m: 0.117\npropeller_radius_m: 0.0635\n"
                           "body: {corners_m: [[0.1, 0.05], [-0.1, 0.05], [-0.1, -0.05], [0.1, -0.05]], hinges: [\n"
                           "  {x_m: 0.1, y_m: 0.05, turn_deg: 0}, {x_m: -0.1, y_m: 0.05, turn_deg: 90},\n"
                           "  {x_m: -0.1, y_m: -0.05, turn_deg: 180}, {x_m: 0.1, y_m: -0.05, turn_deg: 270}]}\n"
                           "shapes_deg: {X: [45, 45, 45, 45], O: [180, 180, 180, 180]}\narm_angle_min_deg: -90\n"
                           "arm_angle_max_deg: 180\nspeed_min_rpm: 0\nspeed_max_rpm: 19100\n";
  const Outcome no_square = fly({}, coefficients_, oblong);
  EXPECT_EQ(no_square.code, 2);
  EXPECT_THAT(no_square.err, HasSubstr("square bodies only"));

  std::ostringstream text;
  text << std::ifstream(kVehicle).rdbuf();
  std::string slow = text.str();
  slow.replace(slow.find("speed_max_rpm: 19100"), 20, "speed_max_rpm: 9100 ");
  const std::string slow_vehicle = *folder_ / "slow.yaml";
  std::ofstream(slow_vehicle) << slow;
  const Outcome weak = fly({}, coefficients_, slow_vehicle);
  EXPECT_EQ(weak.code, 2);
  EXPECT_THAT(weak.err, HasSubstr("speed_max_rpm"));
}

}  // namespace
}  // namespace kphi::test
