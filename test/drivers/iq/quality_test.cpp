#include "drivers/iq/quality.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace kphi::iq {
namespace {

constexpr Gate kAll[] = {Gate::derate, Gate::coil_derate, Gate::controller_derate, Gate::saturation,
                         Gate::fault,  Gate::speed,       Gate::supply_voltage,    Gate::coil_temperature};

QualityLimits limits() {
  QualityLimits l;
  l.commanded_speed_rad_s = -1000;  // clockwise
  l.supply_lowest_v = 11;
  l.supply_highest_v = 13;
  l.coil_temperature_max_degc = 100;
  return l;
}

StepReadings good_step() {
  StepReadings step;
  for (const double wobble : {-1.0, 0.0, 1.0}) {
    step.add(entry<"brushless_drive.derate">, 65536);
    step.add(entry<"coil_temperature_estimator.derate">, 1);
    step.add(entry<"temperature_monitor_uc.derate">, 1);
    step.add(entry<"brushless_drive.drive_pwm">, -0.6 + 0.01 * wobble);
    step.add(entry<"power_safety.fault_now">, 0);
    step.add(entry<"brushless_drive.obs_velocity">, -1000 + 4 * wobble);
    step.add(entry<"power_monitor.volts">, 12 + 0.3 * wobble);
    step.add(entry<"coil_temperature_estimator.t_coil">, 60 + wobble);
  }
  return step;
}

TEST(Quality, PassesAGoodStep) {
  const Verdict verdict = judge(good_step(), limits());
  EXPECT_TRUE(verdict.good()) << verdict.words();
  EXPECT_EQ(verdict.unknown, 0u);
}

TEST(Quality, TellsTheUnknownFromTheGood) {
  const Verdict verdict = judge(StepReadings{}, limits());
  EXPECT_TRUE(verdict.good());
  for (const Gate gate : kAll) EXPECT_TRUE(verdict.is_unknown(gate)) << name_of(gate);
}

struct Case {
  const char* name;
  const Entry* entry;
  double value;
  Gate shut;
};

class OneBadReading : public testing::TestWithParam<Case> {};

TEST_P(OneBadReading, ShutsItsGateAndNoOther) {
  StepReadings step = good_step();
  step.add(*GetParam().entry, GetParam().value);
  const Verdict verdict = judge(step, limits());
  for (const Gate gate : kAll) EXPECT_EQ(verdict.is_shut(gate), gate == GetParam().shut) << name_of(gate);
  EXPECT_EQ(verdict.words(), name_of(GetParam().shut));
}

INSTANTIATE_TEST_SUITE_P(
    Table, OneBadReading,
    testing::Values(Case{"ADerateOneBitBelow", &entry<"brushless_drive.derate">, 65535, Gate::derate},
                    Case{"ACoilDerate", &entry<"coil_temperature_estimator.derate">, 0.999, Gate::coil_derate},
                    Case{"AnOldCoilDerate", &entry<"temperature_estimator.derate">, 60000, Gate::coil_derate},
                    Case{"AControllerDerate", &entry<"temperature_monitor_uc.derate">, 0.5, Gate::controller_derate},
                    Case{"ADriveAtItsLimit", &entry<"brushless_drive.drive_pwm">, 0.98, Gate::saturation},
                    Case{"ADriveAtItsLimitBackwards", &entry<"brushless_drive.drive_pwm">, -1, Gate::saturation},
                    Case{"AFault", &entry<"power_safety.fault_now">, 16, Gate::fault},
                    Case{"ASlowSpeed", &entry<"brushless_drive.obs_velocity">, -989, Gate::speed},
                    Case{"AFastSpeed", &entry<"brushless_drive.obs_velocity">, -1011, Gate::speed},
                    Case{"AReversedSpeed", &entry<"brushless_drive.obs_velocity">, 1000, Gate::speed},
                    Case{"ASaggingSupply", &entry<"power_monitor.volts">, 10.9, Gate::supply_voltage},
                    Case{"APumpedSupply", &entry<"power_monitor.volts">, 13.1, Gate::supply_voltage},
                    Case{"AHotCoil", &entry<"coil_temperature_estimator.t_coil">, 100, Gate::coil_temperature},
                    Case{"AHotOldCoil", &entry<"temperature_estimator.temp">, 101, Gate::coil_temperature},
                    Case{"ATemperatureThatIsNoNumber", &entry<"coil_temperature_estimator.t_coil">, std::nan(""),
                         Gate::coil_temperature},
                    Case{"ASpeedThatIsNoNumber", &entry<"brushless_drive.obs_velocity">, std::nan(""), Gate::speed},
                    Case{"ADerateThatIsNoNumber", &entry<"temperature_monitor_uc.derate">, std::nan(""),
                         Gate::controller_derate}),
    [](const testing::TestParamInfo<Case>& one) { return one.param.name; });

TEST(Quality, ToleratesFiveRadiansPerSecondAtLowSpeed) {
  QualityLimits slow = limits();
  slow.commanded_speed_rad_s = 10.5;
  StepReadings step;
  step.add(entry<"brushless_drive.obs_velocity">, 15);
  EXPECT_TRUE(judge(step, slow).good());
  step.add(entry<"brushless_drive.obs_velocity">, 16);
  EXPECT_TRUE(judge(step, slow).is_shut(Gate::speed));
}

TEST(Quality, NamesAllThatIsShut) {
  StepReadings step = good_step();
  step.add(entry<"power_safety.fault_now">, 1);
  step.add(entry<"brushless_drive.derate">, 0);
  EXPECT_EQ(judge(step, limits()).words(), "derated, fault");
}

TEST(Cooling, PausesWithHysteresis) {
  const CoolingRule rule{80, 50};
  EXPECT_FALSE(rule.pauses(false, 79));
  EXPECT_TRUE(rule.pauses(false, 81));
  EXPECT_TRUE(rule.pauses(true, 60)) << "goes on pausing where none would begin";
  EXPECT_FALSE(rule.pauses(true, 49));
}

TEST(Cooling, WaitsWhileTheTemperatureIsNotANumber) {
  const CoolingRule rule{80, 50};
  EXPECT_TRUE(rule.pauses(false, std::nan("")));
  EXPECT_TRUE(rule.pauses(true, std::nan("")));
}

TEST(Cooling, NeverPausesWithoutARule) { EXPECT_FALSE(CoolingRule{}.pauses(false, 500)); }

}  // namespace
}  // namespace kphi::iq
