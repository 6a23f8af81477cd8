#include "fit/export/targets.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "base/error.hpp"
#include "fit/coefficients/coefficients.hpp"
#include "fit/logs/import_table.hpp"
#include "profiles/vehicle.hpp"
#include "test/compensation/line_of.hpp"
#include "test/fit/campaign_steps.hpp"
#include "test/fit/export/outside_reader.hpp"
#include "test/source_dir.hpp"
#include "test/temporary_folder.hpp"

namespace kphi::fit {
namespace targets_test {

using test::read_with;
using test::TemporaryFolder;
using test::works;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

const std::string kPython = "/usr/bin/python3";  // Debian's, which sees Debian's modules

compensation::Coefficients coefficients(CurveForm form = CurveForm::line) {
  Provenance provenance;
  provenance.propeller_name = "Tom's \"5x4\" -- */ <b> \\";  // made to break out of comments and quotes
  provenance.tool_version = "0.1.0";
  provenance.measured_utc = "2021-05-30T00:00:00Z";
  provenance.runs = {{"runs/5x3_phi000_rep1.h5", std::string(64, 'a'), "", std::nullopt}};
  return compensation::parse_coefficients(
      format_coefficients(analysed(identify(campaign_steps(), {.curve = {.form = form}})), provenance), "c.yaml");
}

const compensation::Coefficients& file() {
  static const compensation::Coefficients kOnce = coefficients();
  return kOnce;
}

const profiles::Vehicle& drone() {
  static const profiles::Vehicle kOnce = profiles::load_vehicle(test::source_dir() + "/profiles/foldable_drone.yaml");
  return kOnce;
}

nlohmann::json yaml_as_json(const std::string& text) {
  const TemporaryFolder folder;
  test::write_file(folder.path() / "file.yaml", text);
  const auto reading =
      read_with(kPython + " -c 'import json,sys,yaml; print(json.dumps(yaml.safe_load(open(sys.argv[1]))))' " +
                (folder.path() / "file.yaml").string());
  EXPECT_EQ(reading.status, 0) << reading.out;
  return nlohmann::json::parse(reading.out);
}

class Yaml : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!works(kPython + " -c 'import yaml'")) GTEST_SKIP() << "apt install python3-yaml";
  }
};

TEST_F(Yaml, OfAgiliciousIsReadByPython) {
  const auto map = yaml_as_json(to_agilicious(file(), {}).text);
  EXPECT_EQ(map["thrust_map"][0].get<double>(), file().curve.thrust_coefficient().value())
      << "to the last bit, and as a float";
  EXPECT_EQ(map["thrust_map"][1], 0.0);
  EXPECT_EQ(map["motor_omega_max"].get<double>(), file().fastest_speed->value());
  const auto covered = yaml_as_json(to_agilicious(file(), {.phi_deg = 180}).text);
  EXPECT_NEAR(covered["thrust_map"][0].get<double>(), CampaignTruth{}.k(180), 5e-9);
}

TEST_F(Yaml, OfRos2IsReadByPythonWithDoublesAndListsOfOneType) {
  const auto parameters = yaml_as_json(to_ros2(file(), {}).text)["/**"]["ros__parameters"]["kphi"];
  EXPECT_EQ(parameters["propeller"], "5x3");
  EXPECT_EQ(parameters["origin"], "unknown");
  EXPECT_EQ(parameters["thrust_coefficient_n_s2_per_rad2"].get<double>(), file().curve.thrust_coefficient().value());
  EXPECT_EQ(parameters["line_slope_n_s2_per_rad3"].get<double>(), compensation::line_of(file().curve).slope_per_rad);
  ASSERT_EQ(parameters["phi_deg"].size(), 5u);
  for (const auto& [key, value] : parameters.items()) {
    if (value.is_string()) continue;
    for (const auto& number : value.is_array() ? value : nlohmann::json::array({value}))
      EXPECT_TRUE(number.is_number_float()) << key << " " << number;
  }
  EXPECT_THAT(to_ros2(file(), {}).lost, Contains(HasSubstr("air_density"))) << "what is unknown is said, not invented";
}

/// The same propeller, its torque measured: 0.013 m times the thrust.
const compensation::Coefficients& file_with_torque() {
  static const compensation::Coefficients kOnce = [] {
    std::vector<results::StepMean> steps = campaign_steps();
    for (results::StepMean& step : steps) {
      step.torque_nm = -0.013 * step.thrust_n;
      step.torque_sd_nm = 1e-4;
    }
    return compensation::parse_coefficients(format_coefficients(analysed(identify(steps)), {}), "c.yaml");
  }();
  return kOnce;
}

/// Values of PX4's parameters by name.
std::map<std::string, double> px4_values(const Export& result) {
  std::istringstream lines(result.text);
  std::map<std::string, double> values;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with('#')) continue;
    int vehicle = 0, component = 0;
    std::string name;
    double value = 0;
    std::istringstream(line) >> vehicle >> component >> name >> value;
    values[name] = value;
  }
  return values;
}

TEST(Px4, TorqueHasTheSignOfTheDirectionAndIsLeftOutWithoutOne) {
  using enum Turn;
  const ExportOptions known{.speed_max_rpm = 19100,
                            .turns = {counter_clockwise, counter_clockwise, clockwise, clockwise}};
  auto values = px4_values(to_px4(file_with_torque(), known));
  EXPECT_NEAR(values["CA_ROTOR0_KM"], 0.013, 1e-5);
  EXPECT_NEAR(values["CA_ROTOR3_KM"], -0.013, 1e-5);
  const Export unknown = to_px4(file_with_torque(), {.speed_max_rpm = 19100});
  EXPECT_FALSE(px4_values(unknown).contains("CA_ROTOR0_KM")) << "a wrong sign crashes the vehicle";
  EXPECT_THAT(unknown.lost, Contains(HasSubstr("CA_ROTORn_KM: 0.013")));
  EXPECT_THAT(to_px4(file(), known).lost, Contains(HasSubstr("the coefficient file has none")));
  EXPECT_THROW((void)to_px4(file_with_torque(), {.turns = {clockwise}}), ConfigurationError) << "four motors";
  EXPECT_THROW((void)parse_turns("ccw,left"), ConfigurationError);
  EXPECT_EQ(parse_turns("ccw,cw"), (std::vector{counter_clockwise, clockwise}));
}

TEST(TorquePerThrust, GrowsWithTheOcclusionAsTheThrustFalls) {
  const auto kappa = [](const ExportOptions& options) {
    const std::string text = to_agilicious(file_with_torque(), options).text;
    return std::strtod(text.c_str() + text.find("kappa: ") + 7, nullptr);
  };
  EXPECT_NEAR(kappa({}), 0.013, 1e-5);
  EXPECT_NEAR(kappa({.phi_deg = 180}), 0.013, 5e-4) << "here torque and thrust fall alike";
  EXPECT_THAT(to_agilicious(file_with_torque(), {}).text, HasSubstr("torque per thrust, 0.013"));
  EXPECT_THAT(to_agilicious(file(), {}).lost, Contains(HasSubstr("torque: the coefficient file has none")));
  const std::string sdf = to_gazebo(file_with_torque(), {.turns = parse_turns("ccw,cw,ccw,cw")}).text;
  EXPECT_NEAR(std::strtod(sdf.c_str() + sdf.find("<momentConstant>") + 16, nullptr), 0.013, 1e-5);
  EXPECT_THAT(sdf, HasSubstr("<turningDirection>cw</turningDirection>"));
}

TEST(Px4, ParametersAreForceAtFullOutput) {
  const Export result = to_px4(file(), {.speed_max_rpm = 20000, .motors = 3});
  std::istringstream lines(result.text);
  std::map<std::string, double> values;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with('#')) continue;
    int vehicle = 0, component = 0, type = 0;
    std::string name;
    double value = 0;
    std::istringstream(line) >> vehicle >> component >> name >> value >> type;
    EXPECT_EQ(type, 9);
    EXPECT_LE(name.size(), 16u) << "MAVLink's limit";
    values[name] = value;
  }
  ASSERT_EQ(values.size(), 4u);
  const double full = from_rpm(20000).value();
  EXPECT_NEAR(values["CA_ROTOR2_CT"], file().curve.thrust_coefficient().value() * full * full, 1e-9);
  EXPECT_EQ(values["THR_MDL_FAC"], 1);
  EXPECT_THAT(result.lost, Contains(HasSubstr("one constant per motor and cannot change it in flight")));
  EXPECT_THROW((void)to_px4(file(), {.speed_max_rpm = 200000}), ConfigurationError) << "above the parameter's range";
}

/// The coefficients with the laws of a log.
compensation::Coefficients with_throttle(double factor, double expo, double linear, std::array<double, 4> cubic) {
  compensation::Coefficients one = file();
  using Law = compensation::Coefficients::ThrottleLaw;
  one.throttle = {
      Law{"px4", 0.05, {{"full_thrust_n", 9, 0.1}, {"THR_MDL_FAC", factor, 0.02}}, {"crazyflie"}},
      Law{"ardupilot", 0.05, {{"MOT_THST_EXPO", expo, 0.03}, {"MOT_SPIN_MIN", 0.15, 0}, {"MOT_SPIN_MAX", 0.95, 0}}, {}},
      Law{"ardupilot_voltage",
          0.02,
          {{"MOT_THST_EXPO", expo + 0.1, 0.03},
           {"MOT_SPIN_MIN", 0.15, 0},
           {"MOT_SPIN_MAX", 0.95, 0},
           {"MOT_BAT_VOLT_MAX", 16.4, 0}},
          {}},
      Law{"betaflight", 0.06, {{"thrust_linear", linear, 3}}, {}},
      Law{"betaflight_4_2", 0.06, {{"thrust_linear", 1.2 * linear, 3}}, {}},
      Law{"crazyflie", 0.001, {}, {}}};
  for (std::size_t i = 0; i < cubic.size(); ++i)
    one.throttle.back().numbers.push_back({"VMOTOR2THRUST" + std::to_string(i), cubic[i], 1e-4});
  return one;
}

TEST(ThrottleOfALog, IsWrittenForEachStackWithItsInterval) {
  const auto log = with_throttle(0.35, 0.5, 55, {-0.02, 0.06, -0.01, 0.005});
  const Export px4 = to_px4(log, {});
  EXPECT_THAT(px4.text, AllOf(HasSubstr("THR_MDL_FAC\t0.35\t9"), HasSubstr("THR_MDL_FAC 0.350 ± 0.020 (95 %"),
                              HasSubstr("cannot tell this law from that of crazyflie")));
  EXPECT_THAT(px4.lost, Not(Contains(HasSubstr("right only for motors"))));
  EXPECT_THAT(to_px4(file(), {}).lost, Contains(HasSubstr("THR_MDL_FAC 1.0 is right only for motors that hold")));
  const Export too_bent = to_px4(with_throttle(1.2, 1.2, 190, {-0.02, 0.06, -0.01, 0.005}), {});
  EXPECT_THAT(too_bent.text, HasSubstr("THR_MDL_FAC\t1\t9"));
  EXPECT_THAT(too_bent.lost, Contains(HasSubstr("PX4 takes 0 to 1")));
  const Export ardupilot = to_ardupilot(log, {});
  EXPECT_THAT(ardupilot.text, AllOf(HasSubstr("\nMOT_THST_EXPO,0.6000\n"), HasSubstr("\nMOT_SPIN_MIN,0.15\n"),
                                    HasSubstr("\nMOT_BAT_VOLT_MAX,16.40\nMOT_OPTIONS,1\n")))
      << "the law with the voltage describes the rows better";
  const Export betaflight = to_betaflight(log, {});
  EXPECT_THAT(betaflight.text,
              AllOf(HasSubstr("# 2026.6 and later: thrust_linear 55.0 ± 3.0"), HasSubstr("\nset thrust_linear = 55\n"),
                    HasSubstr("\n# set thrust_linear = 66\n")));
  EXPECT_THAT(to_betaflight(with_throttle(0, 0, 190, {}), {}).lost, Contains(HasSubstr("Betaflight takes 0 to 150")));
}

/// As crazyflie-firmware's motors.c solves its cubic.
double crazyflie_ratio(const std::array<double, 4>& c, double thrust, double volts) {
  const double p = -c[2] / (3 * c[3]), r = c[1] / (3 * c[3]);
  const double q = p * p * p + (c[2] * c[1] - 3 * c[3] * (c[0] - thrust)) / (6 * c[3] * c[3]);
  const double qrp = std::sqrt(q * q + std::pow(r - p * p, 3));
  return (std::cbrt(q + qrp) + std::cbrt(q - qrp) + p) / volts;
}

TEST(Crazyflie, SolvesTheCubicForTheThrustThatWasMeasured) {
  const std::array<double, 4> cubic{-0.02, 0.06, -0.01, 0.005};
  const std::string text = to_crazyflie(with_throttle(0.35, 0.5, 55, cubic), {}).text;
  std::array<double, 4> read{};
  for (std::size_t i = 0; i < read.size(); ++i) {
    const std::string define = "#define VMOTOR2THRUST" + std::to_string(i) + " ";
    const std::size_t at = text.find(define);
    ASSERT_NE(at, std::string::npos) << text;
    read[i] = std::strtod(text.c_str() + at + define.size(), nullptr);
  }
  for (const double volts : {3.2, 3.7, 4.2}) {
    for (const double u : {0.3, 0.6, 0.9}) {
      const double v = u * volts, thrust = cubic[0] + v * (cubic[1] + v * (cubic[2] + v * cubic[3]));
      EXPECT_NEAR(crazyflie_ratio(read, thrust, volts), u, 1e-9);
    }
  }
  EXPECT_THROW((void)to_crazyflie(with_throttle(0, 0, 0, {0, 0.06, 0.05, 0.001}), {}), ConfigurationError)
      << "turns back: the firmware would find no voltage, or another";
  EXPECT_THROW((void)to_crazyflie(file(), {}), ConfigurationError) << "no throttle in the log";
}

TEST(Gazebo, IsReadByXmllint) {
  if (!works("xmllint --version")) GTEST_SKIP() << "apt install libxml2-utils";
  const TemporaryFolder folder;
  const std::string path = (folder.path() / "motors.sdf").string();
  test::write_file(path, to_gazebo(file(), {}).text);
  const auto read = [&](const std::string& xpath) {
    const auto reading = read_with("xmllint --xpath 'string(" + xpath + ")' " + path);
    EXPECT_EQ(reading.status, 0) << reading.out;
    return std::strtod(reading.out.c_str(), nullptr);
  };
  EXPECT_EQ(read("/sdf/model/plugin[3]/motorConstant"), file().curve.thrust_coefficient().value());
  EXPECT_EQ(read("/sdf/model/plugin[1]/maxRotVelocity"), file().fastest_speed->value());
  EXPECT_EQ(read("count(//plugin)"), 4);
}

TEST(Ros2, HasTheKnotsOfATable) {
  const std::string text = to_ros2(coefficients(CurveForm::table), {}).text;
  EXPECT_THAT(text, HasSubstr("curve_phi_rad: [0.0, 0.785"));
  EXPECT_THAT(text, HasSubstr("curve_k_n_s2_per_rad2: ["));
}

TEST(Targets, SayThatTheyDropAChangeOfKWithTheSpeed) {
  compensation::Coefficients bent = coefficients();
  ASSERT_TRUE(bent.curve.set_speed_trend({1e-4, RadPerSec(1500)}));
  bent.throttle = with_throttle(0.35, 0.5, 55, {-0.02, 0.06, -0.01, 0.005}).throttle;
  const std::set<std::string> constant{"agilicious", "gazebo", "ardupilot"};
  for (const Target& target : targets()) {
    const Export made = target.write(bent, {.vehicle = &drone()});
    const bool said =
        std::ranges::any_of(made.lost, [](const std::string& one) { return one.starts_with("change of k"); });
    EXPECT_EQ(said, constant.contains(target.name)) << target.name;
  }
  EXPECT_THAT(to_px4(bent, {}).lost, Contains(HasSubstr("change of k"))) << "PX4's own multirotor cannot hold it";
}

TEST(CsvExport, IsFittedAgainToTheSameCoefficients) {
  const std::string text = to_csv(file(), {}).text;
  ASSERT_TRUE(is_k_table(text));
  const auto points = read_k_table(text, "K.csv");
  ASSERT_EQ(points.size(), 5u);
  const CurveFit line = fit_curve(points);
  // Not the same weights: u of the table holds what all k have in common, too.
  EXPECT_NEAR(line.value("slope_per_deg") / (compensation::line_of(file().curve).slope_per_rad * kPi / 180), 1, 2e-4);
  EXPECT_EQ(line.K_T, file().curve.thrust_coefficient().value());
}

TEST(Targets, SayWhatTheyCannotHold) {
  std::set<std::string> names;
  for (const Target& target : targets()) {
    SCOPED_TRACE(target.name);
    EXPECT_TRUE(names.insert(target.name).second);
    const Export result =
        target.write(with_throttle(0.35, 0.5, 55, {-0.02, 0.06, -0.01, 0.005}), {.vehicle = &drone()});
    EXPECT_FALSE(result.text.empty());
    EXPECT_FALSE(result.lost.empty());
    for (const std::string& reason : result.lost) EXPECT_THAT(reason, HasSubstr(": ")) << "what, and why";
  }
}

TEST(Targets, RefuseAnOcclusionThatWasNotMeasured) {
  for (const auto write : {to_agilicious, to_px4, to_gazebo}) {
    for (const double phi : {300.0, -1.0}) EXPECT_THROW((void)write(file(), {.phi_deg = phi}), ConfigurationError);
  }
}

TEST(Targets, RefuseAVehicleThatTheyCannotFly) {
  EXPECT_THROW((void)to_ardupilot(file(), {}), ConfigurationError) << "no vehicle, no arms";
  profiles::Vehicle other = drone();
  other.overlap = compensation::OverlapMeasure::area_share;
  for (const auto write : {to_c, to_px4, to_ros2, to_ardupilot})
    EXPECT_THROW((void)write(file(), {.vehicle = &other}), ConfigurationError) << "another measure of the overlap";
  other = drone();
  other.dynamics->spin = {1, 1, -1, -1};
  EXPECT_THROW((void)to_c(file(), {.vehicle = &other}), ConfigurationError);
  other.dynamics.reset();
  EXPECT_THROW((void)to_px4(file(), {.vehicle = &other}), ConfigurationError);
  EXPECT_THROW((void)to_px4(file(), {.phi_deg = 45, .vehicle = &drone()}), ConfigurationError);
}

TEST(Targets, ThatNeedASpeedSaySo) {
  auto bare = file();
  bare.fastest_speed.reset();
  EXPECT_THROW((void)to_px4(bare, {}), ConfigurationError);
  EXPECT_NO_THROW((void)to_agilicious(bare, {}));
}

}  // namespace targets_test
}  // namespace kphi::fit
