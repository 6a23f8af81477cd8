#include "daq/guard/supply_interlock.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace kphi::daq {
namespace {

using results::SupplyProtection;
using results::SupplyReading;
using results::SupplyRegulation;

const profiles::SupplyConfig kWanted{"modbus-rtu:/dev/x", Volts(12), Amperes(20), Volts(14), Amperes(22)};

SupplyReading healthy() {
  return {1, 0, 11.9, 18, 12, 20, SupplyRegulation::constant_voltage, SupplyProtection::none, 1};
}

TEST(SupplyInterlock, LetsAHealthySupplyBe) { EXPECT_FALSE(check(healthy(), kWanted, true)); }

TEST(SupplyInterlock, AllowsASagOfFivePercentAndARiseOfThree) {
  SupplyReading seen = healthy();
  seen.voltage_v = 11.41;
  EXPECT_FALSE(check(seen, kWanted, true));
  seen.voltage_v = 12.35;
  EXPECT_FALSE(check(seen, kWanted, true));
}

TEST(SupplyInterlock, ExcusesWhatAChangeOfSpeedBringsAndNothingElse) {
  SupplyReading seen = healthy();
  seen.regulation = SupplyRegulation::constant_current;
  seen.voltage_v = 10;
  EXPECT_FALSE(check(seen, kWanted, false));
  seen.voltage_v = 13;
  EXPECT_FALSE(check(seen, kWanted, false));
  seen.current_limit_a = 10;
  EXPECT_TRUE(check(seen, kWanted, false));
  seen = healthy();
  seen.output = 0;
  EXPECT_TRUE(check(seen, kWanted, false));
}

struct Case {
  const char* name;
  void (*spoil)(SupplyReading&);
  const char* words;
};

class EachSupplyTrip : public testing::TestWithParam<Case> {};

TEST_P(EachSupplyTrip, SaysWhatIsWrong) {
  SupplyReading seen = healthy();
  GetParam().spoil(seen);
  const auto trip = check(seen, kWanted, true);
  ASSERT_TRUE(trip);
  EXPECT_NE(trip->reason.find(GetParam().words), std::string::npos) << trip->reason;
  EXPECT_EQ(trip->source, Source::supply);
  EXPECT_EQ(trip->watched, Watched::state);
  EXPECT_EQ(trip->protection, seen.protection);
}

INSTANTIATE_TEST_SUITE_P(
    SupplyInterlock, EachSupplyTrip,
    testing::Values(
        Case{"OverVoltage", [](SupplyReading& s) { s.protection = SupplyProtection::over_voltage; },
             "supply: over-voltage protection switched the output off"},
        Case{"OverCurrent", [](SupplyReading& s) { s.protection = SupplyProtection::over_current; }, "over-current"},
        Case{"Off", [](SupplyReading& s) { s.output = 0; }, "output is off"},
        Case{"Limiting", [](SupplyReading& s) { s.regulation = SupplyRegulation::constant_current; },
             "current limit reached: 18 A at 11.9 V"},
        Case{"Sag", [](SupplyReading& s) { s.voltage_v = 11.39; }, "11.39 V at the terminals, more than 5 % below"},
        Case{"Rise", [](SupplyReading& s) { s.voltage_v = 12.37; }, "more than 3 % above the 12 V set"},
        Case{"NotANumber", [](SupplyReading& s) { s.voltage_v = std::numeric_limits<double>::quiet_NaN(); }, "below"},
        Case{"VoltageTurned", [](SupplyReading& s) { s.set_voltage_v = 11.9; }, "changed on the front panel"},
        Case{"LimitTurned", [](SupplyReading& s) { s.current_limit_a = 21; }, "current limit is 21 A, kphi set 20 A"}),
    [](const testing::TestParamInfo<Case>& tested) { return std::string(tested.param.name); });

}  // namespace
}  // namespace kphi::daq
