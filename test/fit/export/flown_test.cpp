// Each export in the hands of what it is made for, compiled or run by its own kind, flies the speeds of Compensator.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <cmath>
#include <random>
#include <set>
#include <sstream>

#include "base/error.hpp"
#include "compensation/compensator.hpp"
#include "compensation/mixing.hpp"
#include "fit/coefficients/coefficients.hpp"
#include "fit/export/targets.hpp"
#include "profiles/vehicle.hpp"
#include "test/fit/campaign_steps.hpp"
#include "test/fit/export/outside_reader.hpp"
#include "test/source_dir.hpp"
#include "test/temporary_folder.hpp"

namespace kphi::fit {
namespace flown_test {

using compensation::Compensator;
using compensation::Rotors;
using test::read_with;
using test::TemporaryFolder;
using test::works;
using ::testing::HasSubstr;

/// Torque measured; with a trend where the target can hold one.
compensation::Coefficients coefficients(CurveForm form, bool trend) {
  std::vector<results::StepMean> steps = campaign_steps();
  for (results::StepMean& step : steps) {
    step.torque_nm = -0.013 * step.thrust_n * (1 + 0.001 * step.occlusion_deg);
    step.torque_sd_nm = 1e-4;
  }
  auto file = compensation::parse_coefficients(
      format_coefficients(analysed(identify(steps, {.curve = {.form = form}})), {}), "c.yaml");
  file.curve.set_speed_trend({trend ? 1e-4 : 0.0, RadPerSec(1200)});
  return file;
}

/// The square one, and one with six corners and an arm that turns the other way round.
std::vector<profiles::Vehicle> vehicles() {
  const std::string path = test::source_dir() + "/profiles/foldable_drone.yaml";
  profiles::Vehicle square = profiles::load_vehicle(path), other = square;
  const double corners[][2] = {{.06, -.04}, {.06, .04}, {0, .055}, {-.06, .04}, {-.06, -.04}, {0, -.055}};
  std::vector<compensation::Position> outline;
  for (const auto& [x, y] : corners) outline.push_back({Metres(x), Metres(y)});
  other.name = "six.corners";
  other.body = compensation::PolygonBody{*compensation::ConvexPolygon::from(outline.data(), outline.size()),
                                         Rotors<compensation::Hinge>(4)};
  other.half_side = Metres(0);
  const std::size_t at[] = {1, 3, 4, 0};
  for (std::size_t i = 0; i < 4; ++i)
    other.body->hinges[i] = {outline[at[i]], from_degrees(90.0 * static_cast<double>(i)), false};
  other.body->hinges[3] = {outline[0], from_degrees(0), true};
  return {square, other};
}

struct Case {
  std::array<double, 4> arms, thrusts;
};

/// Folded and unfolded; a vehicle's arms with the end stops as they are.
std::vector<Case> cases() {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> arm(0.3, kPi - 1e-6), thrust(0.05, 4.5);
  std::vector<Case> all;
  for (int i = 0; i < 60; ++i) {
    Case one{};
    for (double& angle : one.arms) angle = arm(random);
    for (double& newtons : one.thrusts) newtons = thrust(random);
    all.push_back(one);
  }
  return all;
}

Compensator compensator_of(const compensation::Coefficients& file, const profiles::Vehicle& vehicle) {
  return *Compensator::build(Rotors<compensation::ThrustCurve>(4, file.curve), profiles::airframe_of(vehicle))
              .compensator;
}

/// Four speeds a line, within `share` of those of the library.
void expect_speeds(const std::string& output, const compensation::Coefficients& file, const profiles::Vehicle& vehicle,
                   double share) {
  Compensator compensator = compensator_of(file, vehicle);
  std::istringstream numbers(output);
  double worst = 0;
  for (const Case& one : cases()) {
    compensator.set_arms({Radians(one.arms[0]), Radians(one.arms[1]), Radians(one.arms[2]), Radians(one.arms[3])});
    const auto wanted = compensator.speeds_for(
        {Newtons(one.thrusts[0]), Newtons(one.thrusts[1]), Newtons(one.thrusts[2]), Newtons(one.thrusts[3])});
    for (const RadPerSec speed : wanted.speeds) {
      double got = 0;
      ASSERT_TRUE(numbers >> got) << output.substr(0, 2000);
      worst = std::max(worst, std::fabs(got / speed.value() - 1));
    }
  }
  EXPECT_LT(worst, share);
  ::testing::Test::RecordProperty(fmt::format("worst_share_{}_{}", vehicle.name, share), fmt::format("{:.2g}", worst));
}

std::string cases_text() {
  std::string text;
  for (const Case& one : cases()) {
    for (const double number : one.arms) text += fmt::format("{:.17g} ", number);
    for (const double number : one.thrusts) text += fmt::format("{:.17g} ", number);
    text += "\n";
  }
  return text;
}

/// Calls `fly(file, vehicle)` with every form of a curve on every vehicle.
template <class Fly>
void for_all(bool trend, const Fly& fly) {
  for (const profiles::Vehicle& vehicle : vehicles()) {
    for (const CurveForm form : kCurveForms) {
      SCOPED_TRACE(vehicle.name);
      fly(coefficients(form, trend), vehicle);
    }
  }
}

/// Writes `export_text` and `main_text`, compiles, and returns what the program says to the cases.
std::string compiled_and_run(const std::string& compiler, const std::string& main_name, const std::string& main_text,
                             const std::string& export_name, const std::string& export_text,
                             const std::string& libraries) {
  const TemporaryFolder folder;
  const std::string path = folder.path().string() + "/";
  test::write_file(path + main_name, main_text);
  test::write_file(path + export_name, export_text);
  test::write_file(path + "cases", cases_text());
  const auto made = read_with(compiler + " -I" + test::source_dir() + " -I" + path + " -o " + path + "flown " + path +
                              main_name + " " + libraries + " -lm");
  EXPECT_EQ(made.status, 0) << made.out;
  const auto ran = read_with(path + "flown " + path + export_name + " < " + path + "cases");
  EXPECT_EQ(ran.status, 0) << ran.out;
  return ran.out;
}

constexpr const char* kFlightInC = R"(
#include <stdio.h>
#include "k.h"
int main(void) {
  kphi_curve curves[4];
  const kphi_airframe airframe = @VEHICLE@_airframe();
  static kphi_compensator compensator;
  double n[8];
  int i;
  for (i = 0; i < 4; ++i) curves[i] = kphi_5x3_curve();
  if (kphi_compensator_build(&compensator, curves, &airframe, KPHI_LAW_CLAMPED) != 0) return 1;
  if (@VEHICLE@_masses().body <= 0 || @VEHICLE@_SPINS[0] != 1 || @VEHICLE@_ROTORS != 4) return 2;
  while (scanf("%lf %lf %lf %lf %lf %lf %lf %lf", n, n + 1, n + 2, n + 3, n + 4, n + 5, n + 6, n + 7) == 8) {
    kphi_real arms[4], thrusts[4], speeds[4];
    for (i = 0; i < 4; ++i) arms[i] = (kphi_real)n[i], thrusts[i] = (kphi_real)n[4 + i];
    kphi_set_arms(&compensator, arms);
    kphi_speeds_for(&compensator, thrusts, speeds, NULL);
    for (i = 0; i < 4; ++i) printf("%.17g\n", (double)speeds[i]);
  }
  return 0;
}
)";

std::string with_name(std::string text, const std::string& name) {
  for (std::size_t at = 0; (at = text.find("@VEHICLE@", at)) != std::string::npos;) text.replace(at, 9, name);
  return text;
}

TEST(ExportFlown, ToCAsTheLibraryInDoubleAndInFloat) {
  if (!works("cc --version")) GTEST_SKIP() << "no compiler";
  constexpr const char* kStrict = "cc -std=c99 -Wall -Wextra -Wpedantic -Wconversion -Werror ";
  for_all(true, [](const compensation::Coefficients& file, const profiles::Vehicle& vehicle) {
    const std::string text = to_c(file, {.vehicle = &vehicle}).text;
    const std::string flight = with_name(kFlightInC, vehicle.body ? "kphi_six_corners" : "kphi_foldable_drone");
    expect_speeds(compiled_and_run(kStrict, "flight.c", flight, "k.h", text, KPHI_DOUBLE_LIBRARY), file, vehicle,
                  1e-12);
    expect_speeds(
        compiled_and_run(std::string(kStrict) + "-DKPHI_FLOAT", "flight.c", flight, "k.h", text, KPHI_FLOAT_LIBRARY),
        file, vehicle, 1e-6);
  });
  const auto square = vehicles().front();
  const auto file = coefficients(CurveForm::line, false);
  expect_speeds(compiled_and_run("c++ -std=c++14 -Wall -Wextra -Wno-old-style-cast -Werror ", "flight.cpp",
                                 with_name(kFlightInC, "kphi_foldable_drone"), "k.h",
                                 to_c(file, {.vehicle = &square}).text, KPHI_DOUBLE_LIBRARY),
                file, square, 1e-12);
}

/// Of any number of rotors, by arms or by hubs; thrusts of 1, 2, 3 N and so on in the reference shape.
constexpr const char* kAnyFlightInC = R"(
#include <stdio.h>
#include "k.h"
int main(void) {
  kphi_curve curves[KPHI_MAX_ROTORS];
  const kphi_airframe airframe = @VEHICLE@_airframe();
  static kphi_compensator compensator;
  kphi_real thrusts[KPHI_MAX_ROTORS], speeds[KPHI_MAX_ROTORS];
  int i;
  for (i = 0; i < @VEHICLE@_ROTORS; ++i) curves[i] = kphi_5x3_curve(), thrusts[i] = (kphi_real)(1 + i);
  if (kphi_compensator_build(&compensator, curves, &airframe, KPHI_LAW_CLAMPED) != 0) return 1;
  @TELL@;
  kphi_speeds_for(&compensator, thrusts, speeds, NULL);
  for (i = 0; i < @VEHICLE@_ROTORS; ++i) printf("%d %.17g\n", @VEHICLE@_SPINS[i], (double)speeds[i]);
  return 0;
}
)";

TEST(ExportFlown, ToCOfSixArmsAndOfHubsThatAreTold) {
  if (!works("cc --version")) GTEST_SKIP() << "no compiler";
  const auto file = coefficients(CurveForm::line, false);
  const struct {
    std::string name, tell;
  } cases[] = {{"foldable_hexa", "kphi_set_arms(&compensator, kphi_foldable_hexa_REFERENCE_RAD)"},
               {"telescoping_quad", "kphi_set_hubs(&compensator, kphi_telescoping_quad_REFERENCE_M, NULL, 0)"}};
  for (const auto& [name, tell] : cases) {
    const std::string path = test::source_dir() + "/profiles/" + name + ".yaml";
    profiles::Vehicle vehicle = profiles::load_vehicle(path);
    vehicle.shapes.erase("X");  // of the folded shape
    vehicle.hubs.erase("X");
    std::string flight = with_name(kAnyFlightInC, "kphi_" + name);
    flight.replace(flight.find("@TELL@"), 6, tell);
    std::istringstream out(compiled_and_run("cc -std=c99 -Wall -Wextra -Wpedantic -Wconversion -Werror ", "flight.c",
                                            flight, "k.h", to_c(file, {.vehicle = &vehicle}).text,
                                            KPHI_DOUBLE_LIBRARY));
    const std::size_t rotors = profiles::rotors_of(vehicle);
    Compensator compensator =
        *Compensator::build(Rotors<compensation::ThrustCurve>(rotors, file.curve), profiles::airframe_of(vehicle))
             .compensator;
    Rotors<Newtons> thrusts(rotors);
    for (std::size_t i = 0; i < rotors; ++i) thrusts[i] = Newtons(1.0 + static_cast<double>(i));
    compensator.set_hubs(profiles::hubs_of(vehicle, "O"));
    const auto wanted = compensator.speeds_for(thrusts).speeds;
    EXPECT_LT(compensator.scaling_factors()[rotors - 1], 0.95) << name;
    for (std::size_t i = 0; i < rotors; ++i) {
      int spin = 0;
      double speed = 0;
      ASSERT_TRUE(out >> spin >> speed) << name;
      EXPECT_EQ(spin, i % 2 == 0 ? 1 : -1);
      EXPECT_NEAR(speed / wanted[i].value(), 1, 1e-6) << name << i;
    }
  }
}

TEST(ExportFlown, OfHubsThatAreToldGoesToCAlone) {
  const auto file = coefficients(CurveForm::line, false);
  const profiles::Vehicle quad = profiles::load_vehicle(test::source_dir() + "/profiles/telescoping_quad.yaml"),
                          hexa = profiles::load_vehicle(test::source_dir() + "/profiles/foldable_hexa.yaml");
  for (const auto& [write, name] : {std::pair{&to_px4, "px4"}, {&to_ros2, "ros2"}, {&to_ardupilot, "ardupilot"}}) {
    try {
      (void)write(file, {.vehicle = &quad});
      ADD_FAILURE() << name;
    } catch (const ConfigurationError& refused) {
      EXPECT_THAT(refused.what(), HasSubstr(std::string("--to ") + name + ": it computes the hubs from arm angles"));
    }
    EXPECT_NO_THROW((void)write(file, {.vehicle = &hexa})) << name;
  }
  profiles::Vehicle of_parts = hexa;
  const compensation::Position nose[] = {
      {Metres(0.2), Metres(-0.02)}, {Metres(0.25), Metres(0)}, {Metres(0.2), Metres(0.02)}};
  of_parts.body->more[0] = compensation::ConvexPolygon::from(nose, 3);
  EXPECT_THROW((void)to_px4(file, {.vehicle = &of_parts}), ConfigurationError) << "it knows one part";
  EXPECT_THAT(to_c(file, {.vehicle = &of_parts}).text,
              HasSubstr("more_corner_counts[0] = 3;\n  made.more_corners[0][0][0] = (kphi_real)0.2;"));
  EXPECT_THAT(to_px4(file, {.vehicle = &hexa}).text, HasSubstr("CA_ROTOR_COUNT\t6"));
  EXPECT_THAT(to_px4(file, {.vehicle = &hexa}).text, HasSubstr("KPHI_H5_X\t0.05\t"));
}

constexpr const char* kFlightInPx4 = R"(
#include <cmath>
#include <cstdio>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include "compensation/integrations/px4_morphing_rotors.hpp"
static std::map<std::string, float> parameters;
static float parameter(const char* name) {
  const auto found = parameters.find(name);
  return found == parameters.end() ? NAN : found->second;
}
int main(int, char** arguments) {
  std::ifstream lines(arguments[1]);
  for (std::string line; std::getline(lines, line);) {
    if (line[0] == '#') continue;
    int vehicle, component;
    std::string name;
    double value;
    std::istringstream(line) >> vehicle >> component >> name >> value;
    if (name.size() > 16) return 3;
    parameters[name] = static_cast<float>(value);
  }
  static MorphingVehicle vehicle;
  if (const char* missing = read_morphing_vehicle(parameter, vehicle)) return std::puts(missing), 1;
  static ActuatorEffectivenessMorphing child;
  if (const char* refusal = child.build(vehicle)) return std::puts(refusal), 2;
  const float still[4] = {};
  double n[8];
  ActuatorEffectiveness::ActuatorVector set_point, lowest, highest;
  while (std::scanf("%lf %lf %lf %lf %lf %lf %lf %lf", n, n + 1, n + 2, n + 3, n + 4, n + 5, n + 6, n + 7) == 8) {
    float arms[4];
    for (int i = 0; i < 4; ++i) arms[i] = static_cast<float>(n[i]);
    child.armsMeasured(arms, still, 0);
    ActuatorEffectiveness::Configuration configuration;
    if (!child.getEffectivenessMatrix(configuration, EffectivenessUpdateReason::NO_EXTERNAL_UPDATE)) return 4;
    for (int i = 0; i < 4; ++i)
      set_point(i) = static_cast<float>(n[4 + i]) / (vehicle.full_thrust * -configuration.effectiveness_matrices[0](5, i));
    child.updateSetpoint({}, 0, set_point, lowest, highest);
    for (int i = 0; i < 4; ++i) std::printf("%.9g\n", std::sqrt(static_cast<double>(set_point(i))) * parameter("KPHI_W_MAX"));
  }
}
)";

std::string px4_compiler() {
  const std::string source = test::source_dir();
  return "c++ -std=c++14 -DKPHI_FLOAT -I" + source + "/test/compensation/integrations/px4 " + source +
         "/compensation/integrations/px4_morphing_rotors.cpp " + source +
         "/compensation/integrations/px4_morphing_parameters.cpp";
}

TEST(ExportFlown, ToPx4ByTheMorphingChild) {
  if (!works("c++ --version")) GTEST_SKIP() << "no compiler";
  for_all(true, [](const compensation::Coefficients& file, const profiles::Vehicle& vehicle) {
    expect_speeds(compiled_and_run(px4_compiler(), "flight.cpp", kFlightInPx4, "vehicle.params",
                                   to_px4(file, {.vehicle = &vehicle}).text, KPHI_FLOAT_LIBRARY),
                  file, vehicle, 1e-6);
  });
}

TEST(ExportFlown, ToPx4HasEveryParameterThatItsYamlDeclares) {
  std::set<std::string> declared, written;
  const YAML::Node yaml = YAML::LoadFile(test::source_dir() + "/compensation/integrations/px4_parameters.yaml");
  for (const auto& group : yaml["parameters"]) {
    for (const auto& parameter : group["definitions"]) {
      const auto name = parameter.first.as<std::string>();
      const int instances = parameter.second["num_instances"] ? parameter.second["num_instances"].as<int>() : 1;
      for (int i = 0; i < instances; ++i) {
        std::string one = name;
        if (const auto at = one.find("${i}"); at != std::string::npos) one.replace(at, 4, std::to_string(i));
        EXPECT_LE(one.size(), 16u) << one;
        declared.insert(one);
      }
    }
  }
  for_all(true, [&](const compensation::Coefficients& file, const profiles::Vehicle& vehicle) {
    std::istringstream lines(to_px4(file, {.vehicle = &vehicle}).text);
    for (std::string line; std::getline(lines, line);) {
      std::string ids, component, name;
      std::istringstream(line) >> ids >> component >> name;
      if (!name.starts_with("KPHI_")) continue;
      EXPECT_TRUE(declared.contains(name)) << name;
      written.insert(name);
    }
  });
  EXPECT_TRUE(written.contains("KPHI_TREND") && written.contains("KPHI_VERDICT") && written.contains("KPHI_C5_Y"));
}

/// A YAML value as rclcpp types it, in C++.
std::string in_cpp(const YAML::Node& node) {
  const auto scalar = [](const YAML::Node& one) -> std::pair<std::string, std::string> {
    const std::string text = one.Scalar();
    const std::string quoted = "std::string(R\"k(" + text + ")k\")";
    if (one.Tag() == "!") return {"std::string", quoted};
    if (text == "true" || text == "false") return {"bool", text};
    try {
      (void)one.as<double>();
    } catch (const YAML::Exception&) {
      return {"std::string", quoted};
    }
    return text.find('.') == std::string::npos ? std::pair<std::string, std::string>{"std::int64_t", text}
                                               : std::pair<std::string, std::string>{"double", text};
  };
  if (node.IsScalar()) return scalar(node).first + "(" + scalar(node).second + ")";
  std::string items;
  for (const auto& one : node) items += scalar(one).second + ",";
  return "std::vector<" + scalar(node[0]).first + ">{" + items + "}";
}

constexpr const char* kFlightInRos2 = R"(
#define main node_main
#include "compensation/integrations/ros2_compensator_node.cpp"
#undef main
#include "parameters.hpp"
int main() {
  set_parameters();
  rclcpp::on_spin = [] {
    double n[8];
    while (std::scanf("%lf %lf %lf %lf %lf %lf %lf %lf", n, n + 1, n + 2, n + 3, n + 4, n + 5, n + 6, n + 7) == 8) {
      sensor_msgs::msg::JointState arms;
      arms.name = {"arm_3", "wheel", "arm_1", "arm_4", "arm_2"};
      arms.position = {n[2], 9, n[0], n[3], n[1]};
      rclcpp::subscriptions.at("arms")(arms);
      rclcpp::subscriptions.at("rotor_thrusts")(std_msgs::msg::Float64MultiArray{{n[4], n[5], n[6], n[7]}});
      for (const double speed : std::any_cast<std_msgs::msg::Float64MultiArray>(rclcpp::published.at("rotor_speeds")).data)
        std::printf("%.17g\n", speed);
    }
  };
  return node_main(0, nullptr);
}
)";

TEST(ExportFlown, ToRos2ByTheNode) {
  if (!works("c++ --version")) GTEST_SKIP() << "no compiler";
  const std::string compiler = "c++ -std=c++17 -I" + test::source_dir() + "/test/compensation/integrations/ros2";
  for_all(true, [&](const compensation::Coefficients& file, const profiles::Vehicle& vehicle) {
    const YAML::Node parameters = YAML::Load(to_ros2(file, {.vehicle = &vehicle}).text)["/**"]["ros__parameters"];
    std::string text = "#include <cstdint>\nvoid set_parameters() {\n";
    for (const auto& group : parameters) {
      for (const auto& parameter : group.second)
        text += fmt::format("rclcpp::parameters[\"{}.{}\"] = {};\n", group.first.Scalar(), parameter.first.Scalar(),
                            in_cpp(parameter.second));
    }
    expect_speeds(
        compiled_and_run(compiler, "flight.cpp", kFlightInRos2, "parameters.hpp", text + "}\n", KPHI_DOUBLE_LIBRARY),
        file, vehicle, 1e-12);
  });
}

/// Throttle, roll, pitch and yaw, as ArduPilot's mixer has them.
using Demand = std::array<double, 4>;

/// What that demand is in N and N m in the reference shape, where one of throttle is a full motor in the mean, and one
/// of roll, pitch or yaw moves the hardest worked motor by half of one.
compensation::Wrench own_wrench(const Demand& demand, const compensation::Mixer& mixer, double full) {
  const auto thrusts_of = [&](double thrust, double roll, double pitch, double yaw) {
    const compensation::ThrustLimits wide{{}, Rotors<Newtons>(4, Newtons(1e3))};
    return mixer.mix({Newtons(thrust), NewtonMetres(roll), NewtonMetres(pitch), NewtonMetres(yaw)}, wide).thrusts;
  };
  const double lift = 4 * full;  // enough that no thrust is less than nothing
  const auto level = thrusts_of(lift, 0, 0, 0);
  const auto unit = [&](double roll, double pitch, double yaw) {
    const auto moved = thrusts_of(lift, roll, pitch, yaw);
    double largest = 0;
    for (std::size_t i = 0; i < 4; ++i) largest = std::max(largest, std::fabs((moved[i] - level[i]).value()));
    return full / (2 * largest);
  };
  return {Newtons(demand[0] * lift), NewtonMetres(demand[1] * unit(1e-3, 0, 0) * 1e-3),
          NewtonMetres(-demand[2] * unit(0, 1e-3, 0) * 1e-3), NewtonMetres(-demand[3] * unit(0, 0, 1e-3) * 1e-3)};
}

TEST(ExportFlown, ToArduPilotByItsScriptedMatrix) {
  if (!works("lua5.4 -v")) GTEST_SKIP() << "apt install lua5.4";
  const Demand demand{0.35, 0.04, -0.05, 0.02};
  for_all(false, [&](const compensation::Coefficients& file, const profiles::Vehicle& vehicle) {
    const TemporaryFolder folder;
    const std::string path = folder.path().string() + "/";
    const Export script = to_ardupilot(file, {.vehicle = &vehicle});
    test::write_file(path + "kphi.lua", script.text);
    std::string arms;
    for (const Case& one : cases())
      arms += fmt::format("{:.17g} {:.17g} {:.17g} {:.17g}\n", one.arms[0], one.arms[1], one.arms[2], one.arms[3]);
    test::write_file(path + "arms", arms);
    const auto ran =
        read_with(fmt::format("lua5.4 {} {}kphi.lua {:.17g} {:.17g} < {}arms",
                              test::source_dir() + "/test/compensation/integrations/ardupilot/bindings.lua", path,
                              vehicle.arm_angle_min.value(), vehicle.arm_angle_max.value(), path));
    ASSERT_EQ(ran.status, 0) << ran.out;
    EXPECT_THAT(ran.out, HasSubstr("kphi: k is "));

    Compensator compensator = compensator_of(file, vehicle);
    const compensation::Masses masses{vehicle.dynamics->mass_kg - 4 * vehicle.dynamics->hub_mass_kg,
                                      {},
                                      Rotors<double>(4, vehicle.dynamics->hub_mass_kg)};
    const double kappa = file.torque.front().k_q / file.curve.thrust_coefficient().value();
    const double fastest = vehicle.speed_max.value();
    const double full = file.curve.thrust_coefficient().value() * fastest * fastest;
    compensator.set_arms(vehicle.shapes.at("X"));
    auto mixer = compensation::Mixer::build(compensator.layout(masses, {1, -1, 1, -1}), {Metres(kappa), 0});
    ASSERT_TRUE(mixer);
    const compensation::Wrench wanted = own_wrench(demand, *mixer, full);
    std::istringstream lines(ran.out.substr(ran.out.find('\n') + 1));
    double worst = 0;
    int compared = 0;
    for (const Case& one : cases()) {
      compensator.set_arms({Radians(one.arms[0]), Radians(one.arms[1]), Radians(one.arms[2]), Radians(one.arms[3])});
      std::array<double, 4> outputs{};
      for (double& output : outputs) {
        for (const double part : demand) {
          double factor = 0;
          ASSERT_TRUE(lines >> factor);
          output += part * factor;
        }
      }
      if (!mixer->set_layout(compensator.layout(masses, {1, -1, 1, -1}), compensator.drag_scale())) continue;
      const auto mixed = mixer->mix(wanted, {{}, compensator.thrust_max()});
      if (mixed.concessions.any()) continue;  // ArduPilot gives up in an order of its own
      const auto speeds = compensator.speeds_for(mixed.thrusts).speeds;
      for (std::size_t i = 0; i < 4; ++i)
        worst = std::max(worst, std::fabs(fastest * std::sqrt(outputs[i]) / speeds[i].value() - 1));
      ++compared;
    }
    EXPECT_GT(compared, 20);
    EXPECT_LT(worst, 1e-6);
  });
}

TEST(ExportFlown, EveryExportOfAVehicleCarriesOriginAndVerdict) {
  compensation::Coefficients file = coefficients(CurveForm::line, false);
  file.origin = "simulated";
  file.verdict = "with_care";
  const auto square = vehicles().front();
  EXPECT_THAT(to_c(file, {.vehicle = &square}).text, HasSubstr("kphi_5x3_SIMULATED 1"));
  EXPECT_THAT(to_c(file, {.vehicle = &square}).text, HasSubstr("kphi_5x3_VERDICT \"fly with care"));
  EXPECT_THAT(to_px4(file, {.vehicle = &square}).text, HasSubstr("KPHI_ORIGIN\t2\t6\n1\t1\tKPHI_VERDICT\t2\t6"));
  EXPECT_THAT(to_ros2(file, {.vehicle = &square}).text, HasSubstr("origin: \"simulated\""));
  EXPECT_THAT(to_ardupilot(file, {.vehicle = &square}).text, HasSubstr("origin = \"SIMULATED, no propeller turned\""));
}

}  // namespace flown_test
}  // namespace kphi::fit
