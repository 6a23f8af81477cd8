#include "daq/guard/interlock.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <string>
#include <thread>
#include <vector>

namespace kphi::daq {
namespace interlock_test {

TEST(Trip, SaysValueLimitAndSource) {
  const GuardLimit thrust{Watched::thrust, "thrust", 20, "N", "campaign limits.thrust_max_n"};
  EXPECT_EQ(passed(thrust, 21.3).reason, "thrust 21.3 N is above 20 N (campaign limits.thrust_max_n)");
  EXPECT_EQ(passed(thrust, 21.3).watched, Watched::thrust);
  const GuardLimit speed{Watched::speed, "speed", 20055, "RPM", "campaign"};
  EXPECT_EQ(passed(speed, 20500.4).reason, "speed 20500 RPM is above 20055 RPM (campaign)") << "as people read them";
  const GuardLimit low{Watched::supply_voltage_low, "supply voltage", 5, "V", "device", true};
  EXPECT_EQ(passed(low, 4.2).reason, "supply voltage 4.2 V is below 5 V (device)");
  const GuardLimit range{Watched::torque_y, "Ty", kRangeBorne * 1.0, "N m", "device"};
  EXPECT_EQ(passed(range, 1.15).reason, "load cell: Ty carries 115 % of its range of 1 N m");
}

TEST(Latch, HoldsTheFirstTrip) {
  Latch latch;
  EXPECT_EQ(latch.trip(), nullptr);
  EXPECT_NO_THROW(latch.check());
  EXPECT_TRUE(latch.set({"first"}));
  EXPECT_FALSE(latch.set({"second"}));
  ASSERT_NE(latch.trip(), nullptr);
  EXPECT_EQ(latch.trip()->reason, "first");
  EXPECT_THROW(latch.check(), SafetyStop);
}

TEST(Latch, HoldsOneOfThoseThatMeet) {
  for (int round = 0; round < 200; ++round) {
    Latch latch;
    std::atomic<int> firsts{0};
    std::vector<std::thread> threads;
    for (const char* reason : {"one", "two", "three"})
      threads.emplace_back([&latch, &firsts, reason] { firsts += latch.set({reason}); });
    for (auto& thread : threads) thread.join();
    EXPECT_EQ(firsts, 1);
    EXPECT_NE(latch.trip(), nullptr);
  }
}

const profiles::SupplyConfig kWanted{"modbus-rtu:/dev/x", Volts(12), Amperes(20), Volts(14), Amperes(22)};

SupplyReading healthy() {
  return {1, 0, 11.9, 18, 12, 20, SupplyRegulation::constant_voltage, SupplyProtection::none, 1};
}

TEST(SupplyInterlock, LetsAHealthySupplyBeWithASagOfFivePercentAndARiseOfThree) {
  SupplyReading seen = healthy();
  for (const double volts : {seen.voltage_v, 11.41, 12.35}) {
    seen.voltage_v = volts;
    EXPECT_FALSE(check(seen, kWanted, true)) << volts;
  }
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

}  // namespace interlock_test
}  // namespace kphi::daq
