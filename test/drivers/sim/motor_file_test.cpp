#include <fmt/format.h>
#include <gmock/gmock.h>
#include <yaml-cpp/yaml.h>

#include <cmath>
#include <fstream>
#include <iterator>

#include "base/error.hpp"
#include "base/random.hpp"
#include "drivers/sim/input_files.hpp"
#include "test/source_dir.hpp"

namespace kphi::sim::motor_file_test {

using testing::HasSubstr;

const std::string kHead = "format: kphi-sim-motor/1\n";

std::string refusal(const std::string& text) {
  try {
    (void)parse_motor_profile(text, "m.yaml");
  } catch (const ConfigurationError& error) {
    return error.what();
  }
  return "accepted";
}

/// Of the bare motor at 5 V, the first-order time constant of its speed, s.
double time_constant(const MotorProfile& profile) {
  Motor motor(profile.motor);
  Random random(1);
  const auto volts_on = [&](double volts, double seconds) {
    for (int i = 0; i < seconds * kTicksPerSecond; ++i)
      motor.step({PowerStage::Mode::drive, volts / motor.state().supply_volts}, random);
  };
  volts_on(1, 2);
  const double from = motor.state().speed;
  Motor again(motor);
  volts_on(2, 2);
  const double to = motor.state().speed;
  motor = again;
  int ticks = 0;
  for (; motor.state().speed < from + (1 - std::exp(-1)) * (to - from); ++ticks)
    motor.step({PowerStage::Mode::drive, 2 / motor.state().supply_volts}, random);
  return ticks * kTick;
}

TEST(MotorFile, ThatIsShippedIsTheMotorThatIsBuiltIn) {
  std::ifstream file(kphi::test::source_dir() + "/profiles/motor_iq2306.yaml");
  const std::string text((std::istreambuf_iterator<char>(file)), {});
  const MotorProfile shipped = parse_motor_profile(text, "motor_iq2306.yaml");
  EXPECT_EQ(shipped.motor, MotorParameters{});
  EXPECT_EQ(shipped.sensors, IqSensorErrors{});
}

TEST(MotorFile, ThatIsShippedShowsEveryKeyAndEachCounts) {
  const std::string path = kphi::test::source_dir() + "/profiles/motor_iq2306.yaml";
  std::size_t keys = 0;
  for (const auto& section : YAML::LoadFile(path)) {
    if (!section.second.IsMap()) continue;
    for (const auto& key : section.second) {
      const double other = key.second.as<double>() == 0 ? 0.001 : 0.99 * key.second.as<double>();
      const MotorProfile profile = parse_motor_profile(
          fmt::format("{}{}: {{{}: {}}}\n", kHead, section.first.Scalar(), key.first.Scalar(), other), "m");
      EXPECT_FALSE(profile.motor == MotorParameters{} && profile.sensors == IqSensorErrors{}) << key.first;
      ++keys;
    }
  }
  constexpr std::size_t kSensorNumbers = 7;  // beside `perfect`
  EXPECT_EQ(keys, sizeof(MotorParameters) / sizeof(double) + kSensorNumbers);
}

TEST(MotorFile, ChangesWhatItNamesAndNothingElse) {
  const MotorProfile profile = parse_motor_profile(
      kHead + "motor: {rotor_inertia_kg_m2: 5e-6}\nsupply: {voltage_v: 14.8}\nsensors: {speed_noise_rad_s: 0}\n", "m");
  EXPECT_EQ(profile.motor.rotor_inertia, 5e-6);
  EXPECT_EQ(profile.motor.supply_volts, 14.8);
  EXPECT_EQ(profile.sensors.speed_noise, 0);
  EXPECT_EQ(profile.motor.resistance, MotorParameters{}.resistance);
  EXPECT_EQ(parse_motor_profile(kHead, "m").motor, MotorParameters{});
}

TEST(MotorFile, MakesAnotherMotor) {
  const double usual = time_constant({});
  // J R/Kt², the bus being stiff.
  EXPECT_NEAR(usual, 2.5e-6 * 0.045 / (0.0043 * 0.0043), 0.05 * usual);
  const double heavy = time_constant(parse_motor_profile(kHead + "motor: {rotor_inertia_kg_m2: 5e-6}\n", "m"));
  EXPECT_NEAR(heavy / usual, 2, 0.05);
}

TEST(MotorFile, IsStrictAndSaysWhere) {
  EXPECT_EQ(refusal(kHead + "motor: {resistance_ohm: -1}\n"),
            "m.yaml:2:25: resistance_ohm: -1 is outside 0.001 to 10; fix this entry");
  EXPECT_THAT(refusal(kHead + "motor: {resistance: 1}\n"), HasSubstr("m.yaml:2:21: motor has no key \"resistance\""));
  EXPECT_THAT(refusal(kHead + "supply: {resistance_ohm: 1}\n"), HasSubstr("supply has no key \"resistance_ohm\""));
  EXPECT_THAT(refusal(kHead + "rotor: {}\n"), HasSubstr("unknown key \"rotor\""));
  for (const char* bad : {"", "motor: {}\n", "format: kphi-bench/1\n"})
    EXPECT_THAT(refusal(bad), HasSubstr("m.yaml:")) << bad;
  for (const char* bad : {"motor: 1\n", "motor: {resistance_ohm: [1]}\n", "motor: {resistance_ohm: nan}\n",
                          "motor: {resistance_ohm: 1, resistance_ohm: 2}\n", "motor: {\n"})
    EXPECT_THAT(refusal(kHead + bad), HasSubstr("m.yaml:")) << bad;
}

}  // namespace kphi::sim::motor_file_test
