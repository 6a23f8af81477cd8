// `kphi fly` as a user meets it: bench campaign, fit, flight.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <utility>

#include "compensation/file/coefficient_file.hpp"
#include "test/compensation/flight/bench_coefficients.hpp"
#include "test/compensation/line_of.hpp"
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
  static Outcome fly(const std::vector<std::string>& more, const std::string& coefficients = coefficients_,
                     const std::string& vehicle = kVehicle) {
    std::vector<std::string> arguments{test::kphi(), "fly", "--coefficients", coefficients, "--vehicle", vehicle};
    arguments.insert(arguments.end(), more.begin(), more.end());
    Process process(arguments);
    const int code = process.wait();
    return {code, process.out(), process.err()};
  }

  using Changes = std::vector<std::pair<std::string, std::string>>;
  /// With the foldable drone's file after these changes.
  static Outcome fly_changed(const Changes& changes, const std::vector<std::string>& more = {}) {
    std::string text = bytes_of(kVehicle);
    for (const auto& [from, to] : changes) {
      EXPECT_NE(text.find(from), std::string::npos) << from;
      text.replace(std::min(text.find(from), text.size()), from.size(), to);
    }
    const std::string path = *folder_ / "vehicle.yaml";
    std::ofstream(path) << text;
    return fly(more, coefficients_, path);
  }

  static TemporaryFolder* folder_;
  static std::string coefficients_;
};
TemporaryFolder* Fly::folder_ = nullptr;
std::string Fly::coefficients_;

TEST_F(Fly, PrintsThePapersTablesAndWhatIsNotReproduced) {
  const Outcome flown = fly({});
  ASSERT_EQ(flown.code, 0) << flown.err;
  for (const char* part : {"Table I   X -> O n.c.", "Table II  X", "Table III level", "gamma 1.4",
                           "Not reproduced:", "the errors in X", "the velocity term of Table II"}) {
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
    const std::string svg = bytes_of(fs::path(out) / file);
    EXPECT_THAT(svg, HasSubstr("</svg>")) << file;
    EXPECT_THAT(svg, HasSubstr("<path")) << file << " draws something";
  }
}

TEST_F(Fly, FliesUnlikePropellersWithAFileForEach) {
  const compensation::ThrustCurve curve = compensation::load_coefficients(coefficients_).curve;
  const auto write_scaled = [&](const char* name, double share) {
    const compensation::Line line = compensation::line_of(curve);
    const std::string path = *folder_ / (std::string(name) + ".yaml");
    std::ofstream(path) << "format: kphi-coefficients/2\npropeller: {id: " << name << "}\nk_unit: N/(rad/s)^2\n"
                        << "overlap: rim_arc\nK_T: {value: " << share * curve.thrust_coefficient().value()
                        << "}\ncurve: {form: line, anchored: false, intercept: {value: "
                        << share * line.intercept.value()
                        << "}, slope_per_deg: {value: " << share * line.slope_per_rad * kPi / 180
                        << "}}\nvalid: {phi_deg: [0, 270]}\n";
    return path;
  };
  const std::string weak = write_scaled("weak", 1), strong = write_scaled("strong", 1.3);
  const std::string world = *folder_ / "unlike.yaml";
  std::ofstream(world) << "format: kphi-world/1\nname: unlike\nk_t_n_per_rpm2: "
                       << to_newtons_per_rpm2(curve.thrust_coefficient())
                       << "\nloss_law: quadratic\ngamma: 1.4\nrotor_thrust_share: [1, 1.3, 1, 1.3]\n";
  const Outcome right = fly({"--world", world}, weak + "," + strong + "," + weak + "," + strong);
  const Outcome wrong = fly({"--world", world}, weak);
  EXPECT_EQ(right.code, 0) << right.out << right.err;
  EXPECT_THAT(right.out, HasSubstr("strong.yaml)"));
  EXPECT_EQ(wrong.code, 5) << wrong.out;
}

TEST_F(Fly, DoesNotCondemnAPropellerOfTwoBladesButOneWhoseThrustNoSuchPropellerHas) {
  const auto two_blades = [](double k_t_share) {
    const compensation::ThrustCurve curve = compensation::load_coefficients(coefficients_).curve;
    const double k_t = k_t_share * from_newtons_per_rpm2(1.3e-8).value(),
                 share = k_t / curve.thrust_coefficient().value();
    const compensation::Line line = compensation::line_of(curve);
    const std::string path = *folder_ / "two.yaml";
    std::ofstream(path) << "format: kphi-coefficients/2\npropeller: {id: 5x2, diameter_in: 5, blades: 2}\n"
                        << "k_unit: N/(rad/s)^2\noverlap: rim_arc\nK_T: {value: " << k_t
                        << "}\ncurve: {form: line, anchored: false, intercept: {value: "
                        << share * line.intercept.value()
                        << "}, slope_per_deg: {value: " << share * line.slope_per_rad * kPi / 180
                        << "}}\nvalid: {phi_deg: [0, 270]}\n";
    return fly({}, path);
  };
  const Outcome right = two_blades(1), wrong = two_blades(1.5);
  EXPECT_EQ(right.code, 0) << right.out;
  EXPECT_THAT(right.out, HasSubstr("within 30 % of the 1.3e-08 N/RPM^2 published"));
  EXPECT_EQ(wrong.code, 5) << wrong.out;
  EXPECT_THAT(wrong.out, HasSubstr("the file's is off by +50 %"));
}

TEST_F(Fly, FliesAnotherShapeOfTheVehicleForO) {
  const auto sags = [](const Outcome& flown) {
    const auto flights = nlohmann::json::parse(flown.out)["flights"];
    const auto of = [&](std::size_t i) { return flights[i]["legs"][1]["mean_error_m"][2].get<double>(); };
    return of(0) - of(1);  // without compensation, with it
  };
  EXPECT_GT(sags(fly({"--json"})), 0.08);
  EXPECT_LT(std::fabs(sags(fly({"--folded", "H", "--json"}))), 0.02) << "nothing is covered in H";
  EXPECT_THAT(fly({"--folded", "H"}).out, HasSubstr("for O: shape H"));
  EXPECT_EQ(fly({"--folded", "Z"}).code, 2);
}

TEST_F(Fly, FliesOneExperimentAlone) {
  const Outcome flown = fly({"--experiment", "level_o_switched"});
  ASSERT_EQ(flown.code, 0) << flown.err;
  EXPECT_THAT(flown.out, HasSubstr("Table III level  O n.c. - O c., O c."));
  EXPECT_THAT(flown.out, Not(HasSubstr("Table I  ")));
  EXPECT_EQ(fly({"--experiment", "loop"}).code, 2);
}

/// With this arm at each corner of a body of these half sides.
std::vector<std::pair<std::string, std::string>> outline(double x, double y) {
  return {{"half_side_m: 0.045 ",
           fmt::format("body: {{corners_m: [[{0},{1}],[-{0},{1}],[-{0},-{1}],[{0},-{1}]], hinges: ["
                       "{{x_m: {0}, y_m: {1}, turn_deg: 0}}, {{x_m: -{0}, y_m: {1}, turn_deg: 90}}, "
                       "{{x_m: -{0}, y_m: -{1}, turn_deg: 180}}, {{x_m: {0}, y_m: -{1}, turn_deg: 270}}]}}",
                       x, y)},
          {"hinge_turn_deg: [0, 90, 180, 270]", ""}};
}

TEST_F(Fly, FliesABodyThatIsNoSquareAndASquareThatIsGivenAsAnOutlineAsTheSquare) {
  const Outcome flown = fly_changed(outline(0.045, 0.045));
  ASSERT_EQ(flown.code, 0) << flown.err;
  EXPECT_EQ(flown.out, fly({}).out);

  const Outcome other = fly_changed(outline(0.05, 0.04), {"--json"});
  ASSERT_EQ(other.code, 0) << other.err;
  const auto flights = nlohmann::json::parse(other.out)["flights"];
  for (const auto& flight : flights) EXPECT_FALSE(flight["lost"]) << flight["name"];
  const double plain = flights[0]["legs"][1]["mean_error_m"][2], helped = flights[1]["legs"][1]["mean_error_m"][2];
  EXPECT_GT(plain, 0.1);
  EXPECT_LT(std::fabs(helped), 0.5 * plain);
}

/// A body of eight corners with an arm at each.
std::string octo_text() {
  std::string corners, hinges;
  for (int i = 0; i < 8; ++i) {
    const double angle = kPi / 4 * i, x = 0.12 * std::cos(angle), y = 0.12 * std::sin(angle);
    corners += fmt::format("{}[{:.5f}, {:.5f}]", i == 0 ? "" : ", ", x, y);
    hinges += fmt::format("    - {{x_m: {:.5f}, y_m: {:.5f}, turn_deg: {}}}\n", x, y, 45 * i - 67.5);
  }
  const std::string hexa = bytes_of(source_dir() + "/profiles/foldable_hexa.yaml");
  std::string text = "format: kphi-vehicle/1\nname: octo\nbody:\n  corners_m: [" + corners + "]\n  hinges:\n" + hinges +
                     "arm_length_m: 0.155\npropeller_radius_m: 0.0635\nshapes_deg:\n"
                     "  open: [67.5, 67.5, 67.5, 67.5, 67.5, 67.5, 67.5, 67.5]\n"
                     "  folded: [180, 180, 180, 180, 180, 180, 180, 180]\n" +
                     hexa.substr(hexa.find("\narm_angle_min_deg"));
  const std::string spins = "[1, -1, 1, -1, 1, -1]", mass = "mass_kg: 0.90";
  text.replace(text.find(spins), spins.size(), "[1, -1, 1, -1, 1, -1, 1, -1]");
  return text.replace(text.find(mass), mass.size(), "mass_kg: 1.20");
}

TEST_F(Fly, FliesSixAndEightRotorsAndArmsThatGetShorter) {
  const std::string octo = *folder_ / "octo.yaml";
  std::ofstream(octo) << octo_text();
  const struct {
    std::string vehicle;
    std::size_t rotors;
    std::vector<std::string> shapes;
  } cases[] = {{source_dir() + "/profiles/foldable_hexa.yaml", 6, {}},
               {octo, 8, {"--open", "open", "--folded", "folded"}},
               {source_dir() + "/profiles/telescoping_quad.yaml", 4, {}}};
  for (const auto& [vehicle, rotors, shapes] : cases) {
    const auto sag = [&, file = vehicle, named = shapes](const char* experiment, std::vector<std::string> options) {
      options.insert(options.end(), {"--json", "--experiment", experiment});
      options.insert(options.end(), named.begin(), named.end());
      const Outcome flown = fly(options, coefficients_, file);
      EXPECT_EQ(flown.code, 0) << file << flown.err;
      const auto flight = nlohmann::json::parse(flown.out)["flights"][0];
      EXPECT_FALSE(flight["lost"]) << file << experiment;
      return flight["legs"][1]["mean_error_m"][2].get<double>();
    };
    const std::string out = *folder_ / fmt::format("flown_{}", rotors);
    const double plain = sag("hover_xo_nc", {"--draws", "2"}), helped = sag("hover_xo_c", {"--out", out});
    EXPECT_GT(plain, 0.05) << vehicle;
    EXPECT_LT(std::fabs(helped), 0.5 * plain) << vehicle;
    EXPECT_THAT(bytes_of(fs::path(out) / "hover_xo_c.csv"), HasSubstr(fmt::format(",speed{}_rad_s\n", rotors)));
  }
  const Outcome judged = fly({}, coefficients_, cases[0].vehicle);
  EXPECT_EQ(judged.code, 0) << judged.out;
  EXPECT_THAT(
      judged.out,
      HasSubstr("The paper's drone has four rotors, this vehicle 6: the paper's numbers are no measure of it."));
}

TEST_F(Fly, RefusesWorldsCoefficientsAndVehiclesOfOtherRotorsWithOneLine) {
  const std::string hexa = source_dir() + "/profiles/foldable_hexa.yaml", three = *folder_ / "three.yaml";
  std::string text = bytes_of(source_dir() + "/profiles/telescoping_quad.yaml");
  for (const auto& [from, to] : {std::pair<std::string, std::string>{", [0.128, -0.128]]", "]"},
                                 {", [0.072, -0.072]]", "]"},
                                 {"[1, -1, 1, -1]", "[1, -1, 1]"}})
    text.replace(text.find(from), from.size(), to);
  std::ofstream(three) << text;
  const struct {
    Outcome flown;
    const char* says;
  } refused[] = {
      {fly({"--world", source_dir() + "/profiles/world_example.yaml"}, coefficients_, hexa), "are of 4 rotors, but"},
      {fly({}, coefficients_ + "," + coefficients_, hexa), "names 2 files, but the vehicle has 6 rotors"},
      {fly({"--folded", "T"}, coefficients_, hexa), "it has O, X, half: name two of them with --open and --folded"},
      {fly({}, coefficients_, three), "three rotors make no yaw of their own"}};
  for (const auto& [flown, says] : refused) {
    EXPECT_EQ(flown.code, 2) << says;
    EXPECT_THAT(flown.err, HasSubstr(says));
  }
}

TEST_F(Fly, FliesInAWorldThatTheControllerDoesNotKnowAndSaysWhetherTheCoefficientsAreFitToFly) {
  const Outcome assumed = fly({"--draws", "8"});
  EXPECT_EQ(assumed.code, 0) << assumed.out;
  EXPECT_THAT(assumed.out, HasSubstr("the file's own: within 30 % of the 1.7e-08 N/RPM^2 published"));
  EXPECT_THAT(assumed.out,
              testing::StartsWith("verdict: fit to fly in this world; the vehicle is lost in 0 of 8 draws"));
  EXPECT_THAT(assumed.out, HasSubstr("it would say the same of a k(φ) that falls "));

  const std::string world = *folder_ / "world.yaml";
  std::ofstream(world)
      << "format: kphi-world/1\nname: thin\nk_t_n_per_rpm2: 0.85e-8\nloss_law: quadratic\ngamma: 1.4\n";
  const Outcome thin = fly({"--draws", "8", "--world", world});
  EXPECT_EQ(thin.code, 5);
  EXPECT_THAT(thin.out,
              testing::StartsWith("verdict: NOT fit to fly in this world\n- would lose the vehicle in 8 of 8 draws"));
  const auto told = nlohmann::json::parse(fly({"--draws", "2", "--world", world, "--json"}).out);
  EXPECT_EQ(told["verdict"]["fitness"], "loses_the_vehicle");
  EXPECT_EQ(told["world"]["file"], world);
  EXPECT_EQ(told["paper"].size(), 51u);
  EXPECT_EQ(fly({"--world", kVehicle}).code, 2) << "a vehicle file is not a world file";
}

TEST_F(Fly, SaysNothingInsteadOfZeroWhereEveryDrawLostAFlight) {
  const Outcome flown = fly_changed({{"[12.7, 12.7, 5]", "[1.0, 1.0, 5]"}}, {"--draws", "1", "--json"});
  ASSERT_EQ(flown.code, 5) << flown.err;
  const auto study = nlohmann::json::parse(flown.out)["study"];
  EXPECT_EQ(study["kept"], 0);
  EXPECT_TRUE(study["forward_ratio"].is_null());
  EXPECT_TRUE(study["by_loss_law"].empty());
}

TEST_F(Fly, FliesWhatTheVehicleFileSays) {
  const auto sag = [](const Outcome& flown) {
    return nlohmann::json::parse(flown.out)["flights"][0]["legs"][1]["mean_error_m"][2].get<double>();
  };
  const std::vector<std::string> hover{"--json", "--experiment", "hover_xo_nc"};
  EXPECT_NEAR(sag(fly_changed({{"[6, 6, 15]", "[6, 6, 30]"}}, hover)) / sag(fly(hover)), 0.5, 0.1)
      << "half the height error for twice the gain";
  EXPECT_THAT(fly_changed({{"mass_kg: 0.60", "mass_kg: 2.60"}}).err, HasSubstr("2.6 kg"));
}

TEST_F(Fly, RefusesWhatItCannotFlyWithOneLine) {
  struct Case {
    std::pair<std::string, std::string> change;
    std::vector<const char*> says;
  };
  for (const Case& refused : std::vector<Case>{
           {{"  O: [180", "  P: [180"}, {"shape O", "shapes_deg"}},
           {{"dynamics:", "dynamic:"}, {"dynamic is not a key"}},
           {{"speed_max_rpm: 19100", "speed_max_rpm: 9100"}, {"speed_max_rpm"}},
           {{"[1, -1, 1, -1]", "[1, 1, 1, 1]"}, {"rotor_spins"}},
           {{"overlap: rim_arc", "overlap: area_share"}, {"fitted with overlap rim_arc", "area_share"}},
       }) {
    const Outcome flown = fly_changed({refused.change});
    EXPECT_EQ(flown.code, 2) << refused.change.second;
    const std::size_t refusal = flown.err.find("kphi: ");  // behind what is said of the coefficients
    ASSERT_NE(refusal, std::string::npos) << flown.err;
    EXPECT_EQ(std::count(flown.err.begin() + static_cast<std::ptrdiff_t>(refusal), flown.err.end(), '\n'), 1)
        << flown.err;
    for (const char* part : refused.says) EXPECT_THAT(flown.err, HasSubstr(part));
  }
  const Outcome no_file = fly({}, "nowhere.yaml");
  EXPECT_EQ(no_file.code, 2);
  EXPECT_THAT(no_file.err, HasSubstr("nowhere.yaml"));
}

TEST_F(Fly, AsksForTheSectionsThatOnlyAFlightNeeds) {
  const std::string text = bytes_of(kVehicle);
  const auto begin = text.find("\ndynamics:") + 1, end = text.find("\ncontrol:") + 1;
  for (const auto& [section, words] :
       {std::pair{text.substr(begin, end - begin), "no section dynamic"}, {text.substr(end), "no section control"}}) {
    const Outcome flown = fly_changed({{section, ""}});
    EXPECT_EQ(flown.code, 2);
    EXPECT_THAT(flown.err, HasSubstr(words));
  }
}

}  // namespace fly_command_test
}  // namespace kphi::test
