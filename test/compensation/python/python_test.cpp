// The Python module: the same numbers as in C++, to the last bit.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <random>
#include <sstream>

#include "compensation/file/coefficient_file.hpp"
#include "test/compensation/example_vehicle.hpp"
#include "test/fit/export/outside_reader.hpp"
#include "test/source_dir.hpp"
#include "test/temporary_folder.hpp"

namespace kphi::compensation::python_test {

using test::read_with;
using testing::HasSubstr;

class PythonModule : public testing::Test {
 protected:
  void SetUp() override {
    if (std::string(KPHI_PYTHON_MODULE).empty()) GTEST_SKIP() << "apt install pybind11-dev, and configure again";
    if (!test::works("/usr/bin/python3 -c 'import numpy'")) GTEST_SKIP() << "apt install python3-numpy";
    std::string file = "file = kphi.load_coefficients('" + path("c.yaml") + "')\n";
    test::write_file(path("c.yaml"), kFile);
    head_ = "import sys, numpy as np\nsys.path.insert(0, '" + std::string(KPHI_PYTHON_MODULE) +
            "')\nimport kphi_compensation as kphi\n"
            "def show(numbers):\n  print(' '.join(float(one).hex() for one in np.ravel(numbers)))\n" +
            file +
            "airframe = kphi.Airframe(half_side=0.045, arm_length=0.117, propeller_radius=0.0635, fastest_speed=2000)\n"
            "compensator = kphi.Compensator.build([file.curve] * 4, airframe)\n";
  }
  [[nodiscard]] std::string path(const std::string& name) const { return (folder_.path() / name).string(); }
  /// What it prints.
  [[nodiscard]] std::string run(const std::string& script, int status = 0) const {
    test::write_file(path("script.py"), head_ + script);
    const auto ran = read_with("/usr/bin/python3 " + path("script.py"));
    EXPECT_EQ(ran.status == 0, status == 0) << ran.out;
    return ran.out;
  }
  /// Next line, as numbers; hexadecimal, so to the bit.
  static std::vector<double> line_of(std::istream& text) {
    std::string line, word;
    std::getline(text, line);
    std::vector<double> numbers;
    for (std::istringstream words(line); words >> word;) numbers.push_back(std::strtod(word.c_str(), nullptr));
    return numbers;
  }
  template <class T>
  static std::vector<double> values(const Rotors<T>& rotors) {
    std::vector<double> all;
    for (const T& one : rotors) all.push_back(number(one));
    return all;
  }
  static double number(double value) { return value; }
  template <class Unit>
  static double number(Quantity<Unit> value) {
    return value.value();
  }

  static constexpr const char* kFile = R"(format: kphi-coefficients/2
origin: simulated
propeller: {id: 5x3, name: "5040", diameter_in: 5.0, blades: 3}
k_unit: N/(rad/s)^2
overlap: rim_arc
K_T: {value: 1.55e-06, u: 1.0e-09, freedom: 12, expanded_95: 2.2e-09, phi_deg: 0.0}
curve:
  form: line
  anchored: false
  intercept: {value: 1.6e-06, u: 1.0e-09, freedom: .inf, expanded_95: 2.0e-09}
  slope_per_deg: {value: -4.5e-09, u: unknown}
  points_deg: [45.0, 90.0, 180.0, 270.0]
valid: {phi_deg: [0.0, 270.0], speed_rpm: [3000.0, 19100.0]}
speed_trend: {share_per_1000_rpm: 0.01, reference_rpm: 12000}
torque:
  - {phi_deg: 0.0, k_q: 2.0e-08}
  - {phi_deg: 90.0, k_q: 1.9e-08}
  - {phi_deg: 270.0, k_q: 1.5e-08}
provenance:
  campaign: icra2021_5in_3blade
  fit: {model: "T = k w^2", estimator: huber}
  runs: [{file: runs/5x3_phi000_rep1.h5, sha256: 00ff}]
)";
  test::TemporaryFolder folder_;
  std::string head_;
};

std::string list_of(const std::vector<double>& numbers) {
  std::ostringstream text;
  text << std::hexfloat;
  for (const double one : numbers) text << "float.fromhex('" << one << "'), ";
  return "[" + text.str() + "]";
}

TEST_F(PythonModule, GivesTheNumbersOfCppToTheLastBit) {
  const Coefficients file = load_coefficients(path("c.yaml"));
  Airframe airframe = example_airframe();
  airframe.fastest_speed = RadPerSec(2000);
  Compensator compensator = *Compensator::build(Rotors<ThrustCurve>(4, file.curve), airframe).compensator;
  const Masses masses{0.42, {}, Rotors<double>(4, 0.045)};
  compensator.set_arms(shape_x());
  Mixer mixer = *Mixer::build(compensator.layout(masses, {1, -1, 1, -1}), {Metres(0.0133), 0});
  std::mt19937 random(3);
  std::uniform_real_distribution<double> arm(0.3, 3.1), thrust(0.01, 6), torque(-0.3, 0.3);
  std::string script =
      "compensator.set_arms(np.radians([45] * 4))\nmasses = kphi.Masses(0.42, [0.045] * 4)\n"
      "mixer = kphi.Mixer.build(compensator.layout(masses, [1, -1, 1, -1]), per_newton=0.0133)\n";
  std::vector<std::vector<double>> wanted;
  for (int i = 0; i < 50; ++i) {
    const std::vector<double> arms{arm(random), arm(random), arm(random), arm(random)};
    const std::vector<double> thrusts{thrust(random), thrust(random), thrust(random), thrust(random)};
    const std::vector<double> demand{4 * thrust(random), torque(random), torque(random), torque(random) / 5};
    script += "compensator.set_arms(" + list_of(arms) + ")\nspeeds, flags = compensator.speeds_for(" +
              list_of(thrusts) +
              ")\nshow(compensator.occlusion_angles)\nshow(compensator.scaling_factors)\nshow(compensator.thrust_max)\n"
              "show(speeds)\nshow(flags)\n"
              "mixer.set_layout(compensator.layout(masses, [1, -1, 1, -1]), compensator.drag_scale)\n"
              "thrusts, achieved, conceded = mixer.mix(" +
              list_of(demand) +
              ", compensator.thrust_max)\n"
              "show(thrusts)\nshow(achieved)\nshow(conceded)\n";
    compensator.set_arms({Radians(arms[0]), Radians(arms[1]), Radians(arms[2]), Radians(arms[3])});
    const SpeedCommand command = compensator.speeds_for(thrusts_of(thrusts[0], thrusts[1], thrusts[2], thrusts[3]));
    mixer.set_layout(compensator.layout(masses, {1, -1, 1, -1}), compensator.drag_scale());
    const MixedThrusts mixed =
        mixer.mix({Newtons(demand[0]), NewtonMetres(demand[1]), NewtonMetres(demand[2]), NewtonMetres(demand[3])},
                  {{}, compensator.thrust_max()});
    std::vector<double> flags;
    for (const Flags& one : command.flags) flags.push_back(one.bits());
    wanted.insert(wanted.end(), {values(compensator.occlusion_angles()),
                                 values(compensator.scaling_factors()),
                                 values(compensator.thrust_max()),
                                 values(command.speeds),
                                 flags,
                                 values(mixed.thrusts),
                                 {mixed.achieved.thrust.value(), mixed.achieved.roll.value(),
                                  mixed.achieved.pitch.value(), mixed.achieved.yaw.value()},
                                 {static_cast<double>(mixed.concessions.bits())}});
  }
  std::istringstream out(run(script));
  for (const auto& line : wanted) ASSERT_EQ(line_of(out), line);
}

TEST_F(PythonModule, TakesArraysOfAnyShapeAndRowsOfThrusts) {
  const Coefficients file = load_coefficients(path("c.yaml"));
  std::istringstream out(
      run("phi = np.radians(np.arange(0, 300, 20.0)).reshape(3, 5)\nk = file.curve.at(phi)\nassert k.shape == (3, 5)\n"
          "show(phi)\nshow(k)\nshow(file.curve.scaling_factor(phi, kphi.ScalingLaw.published))\n"
          "rows, flags = compensator.speeds_for(np.full((7, 4), 1.5))\n"
          "assert rows.shape == (7, 4) and flags.dtype == np.uint16\n"
          "assert (rows == compensator.speeds_for([1.5] * 4)[0]).all()\nprint(type(file.curve.at(1.0)).__name__)\n"));
  const auto phi = line_of(out), k = line_of(out), published = line_of(out);
  for (std::size_t i = 0; i < phi.size(); ++i) {
    EXPECT_EQ(k[i], file.curve.at(Radians(phi[i])).value());
    EXPECT_EQ(published[i], file.curve.scaling_factor(Radians(phi[i]), ScalingLaw::published));
  }
}

TEST_F(PythonModule, SaysWithTheWordsOfCppWhatItRefuses) {
  EXPECT_THAT(run("kphi.Compensator.build([file.curve] * 4, kphi.Airframe(half_side=0.045, arm_length=0.05, "
                  "propeller_radius=0.0635, fastest_speed=2000))\n",
                  1),
              HasSubstr("ValueError: " + std::string(describe(Refusal::arm_length))));
  EXPECT_THAT(run("kphi.load_coefficients('/nowhere.yaml')\n", 1), HasSubstr("CoefficientError"));
  EXPECT_THAT(run("compensator.speeds_for([1, 2, 3])\n", 1), HasSubstr("ValueError: thrusts"));
  EXPECT_THAT(run("print(int(compensator.speeds_for([np.nan, -1, 1, 1])[1][0]) == int(kphi.Flag.thrust_nan))\n"),
              HasSubstr("True"));
}

TEST_F(PythonModule, RunsTheExampleOfItsReadme) {
  std::ifstream readme(test::source_dir() + "/compensation/python/README.md");
  std::string line, example;
  for (bool inside = false; std::getline(readme, line);) {
    if (line.starts_with("```")) {
      inside = line == "```python";
    } else if (inside && !line.starts_with("import")) {
      example += line + "\n";
    }
  }
  ASSERT_THAT(example, HasSubstr("mixer.mix("));
  example.replace(example.find("\"coefficients.yaml\""), 19, "'" + path("c.yaml") + "'");
  EXPECT_EQ(run(example + "assert loss.shape == (55,) and loss[0] == 1 and given_up == 0\n"), "");
}

}  // namespace kphi::compensation::python_test
