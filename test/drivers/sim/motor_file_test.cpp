#include "drivers/sim/motor_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <iterator>

#include "drivers/sim/random.hpp"
#include "test/source_dir.hpp"

namespace kphi::sim {
namespace {

using testing::HasSubstr;

const std::string kHead = "format: kphi-sim-motor/1\n";

std::string refusal(const std::string& text) {
  try {
    (void)parse_motor_profile(text, "m.yaml");
  } catch (const FileError& error) {
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
  EXPECT_EQ(motor_profile_yaml(parse_motor_profile(text, "motor_iq2306.yaml")), motor_profile_yaml({}));
  for (std::size_t at = 0, end = 0; (end = motor_profile_yaml({}).find('\n', at)) != std::string::npos; at = end + 1) {
    const std::string line = motor_profile_yaml({}).substr(at, end - at);
    EXPECT_THAT(text, HasSubstr(line.substr(0, line.find(':') + 1))) << "every key is shown";
  }
}

TEST(MotorFile, ChangesWhatItNamesAndNothingElse) {
  const MotorProfile profile = parse_motor_profile(
      kHead + "motor: {rotor_inertia_kg_m2: 5e-6}\nsupply: {voltage_v: 14.8}\nsensors: {speed_noise_rad_s: 0}\n", "m");
  EXPECT_EQ(profile.motor.rotor_inertia, 5e-6);
  EXPECT_EQ(profile.motor.supply_volts, 14.8);
  EXPECT_EQ(profile.sensors.speed_noise, 0);
  EXPECT_EQ(profile.motor.resistance, MotorParameters{}.resistance);
  EXPECT_EQ(motor_profile_yaml(parse_motor_profile(kHead, "m")), motor_profile_yaml({}));
}

TEST(MotorFile, IsReadAsItIsWritten) {
  MotorProfile profile;
  profile.motor.torque_constant = 0.0051;
  profile.motor.ambient_celsius = -12.5;
  profile.sensors.amps_bias = -3;
  EXPECT_EQ(motor_profile_yaml(parse_motor_profile(motor_profile_yaml(profile), "m")), motor_profile_yaml(profile));
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
            "m.yaml:2:25: resistance_ohm: -1 is outside 0.001 to 10; mend it");
  EXPECT_THAT(refusal(kHead + "motor: {resistance: 1}\n"), HasSubstr("m.yaml:2:21: motor has no 'resistance'"));
  EXPECT_THAT(refusal(kHead + "supply: {resistance_ohm: 1}\n"), HasSubstr("supply has no 'resistance_ohm'"));
  EXPECT_THAT(refusal(kHead + "rotor: {}\n"), HasSubstr("unknown key 'rotor'"));
  for (const char* bad : {"", "motor: {}\n", "format: kphi-bench/1\n"})
    EXPECT_THAT(refusal(bad), HasSubstr("m.yaml:")) << bad;
  for (const char* bad : {"motor: 1\n", "motor: {resistance_ohm: [1]}\n", "motor: {resistance_ohm: nan}\n",
                          "motor: {resistance_ohm: 1, resistance_ohm: 2}\n", "motor: {\n"})
    EXPECT_THAT(refusal(kHead + bad), HasSubstr("m.yaml:")) << bad;
}

}  // namespace
}  // namespace kphi::sim
