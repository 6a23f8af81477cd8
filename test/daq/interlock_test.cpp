#include "daq/interlock.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <optional>

namespace kphi::daq {
namespace {

using std::chrono::milliseconds;

constexpr Duration kPatience = milliseconds(500);

profiles::Limits limits() { return {from_rpm(19100), Newtons(20), Amperes(35), Celsius(110)}; }

Observation healthy() {
  return {from_rpm(19100), Newtons(6.2), Amperes(18), Celsius(60), milliseconds(6), milliseconds(20)};
}

std::optional<Trip> judge(const Observation& seen) {
  const auto trip = check(seen, limits());
  return trip ? trip : check_ages(seen, kPatience);
}

TEST(Interlock, LetsAHealthyBenchRun) { EXPECT_FALSE(judge(healthy())); }

TEST(Interlock, AllowsTheOvershootOfAStep) {
  Observation seen = healthy();
  seen.speed = from_rpm(19100 * 1.04);
  EXPECT_FALSE(judge(seen));
}

struct Case {
  const char* name;
  void (*spoil)(Observation&);
  const char* words;
};

class EachLimit : public testing::TestWithParam<Case> {};

TEST_P(EachLimit, TripsAndSaysWhich) {
  Observation seen = healthy();
  GetParam().spoil(seen);
  const auto trip = judge(seen);
  ASSERT_TRUE(trip);
  EXPECT_NE(trip->reason.find(GetParam().words), std::string::npos) << trip->reason;
}

INSTANTIATE_TEST_SUITE_P(
    Interlock, EachLimit,
    testing::Values(
        Case{"Speed", [](Observation& o) { o.speed = from_rpm(20500); }, "speed 2.05e+04 RPM is above"},
        Case{"Thrust", [](Observation& o) { o.thrust = Newtons(21.3); }, "thrust 21.3 N is above 20 N"},
        Case{"PushingThrust", [](Observation& o) { o.thrust = Newtons(-21.3); }, "thrust 21.3 N"},
        Case{"Current", [](Observation& o) { o.supply_current = Amperes(36); }, "supply current 36 A is above 35 A"},
        Case{"Temperature", [](Observation& o) { o.coil_temperature = Celsius(111); }, "coil temperature 111 °C"},
        Case{"Derate", [](Observation& o) { o.derate = 0.8; }, "derates to 80 %"},
        Case{"Fault", [](Observation& o) { o.fault_bits = 0x42; }, "reports a fault (bits 0x42)"},
        Case{"DerateNotANumber", [](Observation& o) { o.derate = std::numeric_limits<double>::quiet_NaN(); },
             "derates"},
        Case{"SilentLoadCell", [](Observation& o) { o.load_cell_age = milliseconds(501); }, "load-cell sample 0.501 s"},
        Case{"SilentMotor", [](Observation& o) { o.motor_age = milliseconds(700); }, "motor reading 0.7 s"},
        Case{"SpeedNotANumber", [](Observation& o) { o.speed = RadPerSec(std::numeric_limits<double>::quiet_NaN()); },
             "speed"},
        Case{"ThrustNotANumber", [](Observation& o) { o.thrust = Newtons(std::numeric_limits<double>::quiet_NaN()); },
             "thrust"}),
    [](const testing::TestParamInfo<Case>& tested) { return std::string(tested.param.name); });

}  // namespace
}  // namespace kphi::daq
