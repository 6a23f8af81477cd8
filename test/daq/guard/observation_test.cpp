#include "daq/guard/observation.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <set>
#include <string>

#include "test/daq/queue_bench.hpp"

namespace kphi::daq {
namespace observation_test {

using std::chrono::milliseconds;

TEST(GuardedQuantities, HaveAKeyOfTheirOwn) {
  std::set<std::string> keys;
  for (const GuardedQuantity& row : kQuantities) keys.insert(row.key);
  EXPECT_EQ(keys.size(), kWatchedCount);
}

class Observed : public testing::Test {
 protected:
  void samples(double fz_n, int n, double tz_nm = 0) {
    for (int i = 0; i < n; ++i) {
      LoadCellRecord record = load_of(fz_n, tz_nm);
      record.arrival_ns = now_.count();
      observer_.take(record);
    }
  }
  void reading(MotorChannel channel, double value) { observer_.take(MotorReading{channel, now_.count(), 0, value}); }
  [[nodiscard]] Observation seen(Instant at) {
    return observe(observer_.readings(), at, {milliseconds(60), milliseconds(160)}, clock_);
  }

  Instant now_ = milliseconds(100);
  ManualClock clock_;
  std::vector<std::pair<Watched, double>> judged_;
  /// The axis points against the thrust.
  Observer observer_{{2, -1, +1}, mini40(), SpeedWatch(+1, milliseconds(60)), [this](Watched watched, double value) {
                       judged_.emplace_back(watched, value);
                     }};
};

TEST_F(Observed, KnowsNoThrustBeforeItsZero) {
  samples(-2.5, 100, -0.1);
  EXPECT_TRUE(std::isnan(seen(now_).thrust_n));
  EXPECT_TRUE(std::isnan(seen(now_).torque_nm));
  EXPECT_TRUE(std::isnan(seen(now_).judged[Watched::thrust]));
  EXPECT_DOUBLE_EQ(seen(now_).judged[Watched::force_z], 2.5) << "the load on the cell counts from the start";
}

TEST_F(Observed, ShowsTheNewestOfEverythingWithItsAge) {
  observer_.take_zero({});
  samples(-2.5, 100, -0.1);
  reading(MotorChannel::speed, -1234.5);
  reading(MotorChannel::supply_voltage, 11.9);
  reading(MotorChannel::supply_current, 7.5);
  reading(MotorChannel::motor_current, -12);
  reading(MotorChannel::coil_temperature, 61.0);
  reading(MotorChannel::drive_pwm, 0.5);
  const Observation shown = seen(now_ + milliseconds(6));
  EXPECT_DOUBLE_EQ(shown.thrust().value(), 2.5);
  EXPECT_DOUBLE_EQ(shown.torque_nm, 0.1);
  EXPECT_DOUBLE_EQ(shown.speed().value(), 1234.5) << "unsigned";
  EXPECT_DOUBLE_EQ(shown.drive_pwm, 0.5);
  EXPECT_DOUBLE_EQ(shown.judged[Watched::force_z], 2.5);
  EXPECT_DOUBLE_EQ(shown.judged[Watched::supply_voltage_low], 11.9);
  EXPECT_DOUBLE_EQ(shown.judged[Watched::supply_voltage_high], 11.9);
  EXPECT_DOUBLE_EQ(shown.judged[Watched::supply_current], 7.5);
  EXPECT_DOUBLE_EQ(shown.judged[Watched::motor_current], 12);
  EXPECT_DOUBLE_EQ(shown.judged[Watched::coil_temperature], 61.0);
  EXPECT_DOUBLE_EQ(shown.judged[Watched::load_cell_age], 0.006);
  EXPECT_EQ(shown.motor_age, milliseconds(6));
  EXPECT_TRUE(std::isnan(shown.judged[Watched::supply_age])) << "no supply";
}

TEST_F(Observed, TakesTheZeroOffThrustAndTorque) {
  observer_.take_zero({0, 0, -0.2, 0, 0, 0.05});
  samples(-1.2, 100, 0.25);
  EXPECT_DOUBLE_EQ(seen(now_).thrust().value(), 1.0);
  EXPECT_DOUBLE_EQ(seen(now_).judged[Watched::thrust], 1.0);
  EXPECT_DOUBLE_EQ(seen(now_).torque_nm, -0.2);
  EXPECT_DOUBLE_EQ(seen(now_).judged[Watched::shaft_torque], 0.2) << "either sign";
}

TEST_F(Observed, MakesWhatIsTooOldUnknownAndLetsItsAgeGrow) {
  observer_.take_zero({});
  samples(-1, 100);
  reading(MotorChannel::speed, 100);
  Observation shown = seen(now_ + milliseconds(100));
  EXPECT_FALSE(shown.load_cell_is_fresh());
  EXPECT_TRUE(shown.motor_is_fresh());
  EXPECT_TRUE(std::isnan(shown.judged[Watched::thrust]));
  EXPECT_TRUE(std::isnan(shown.judged[Watched::force_z]));
  EXPECT_DOUBLE_EQ(shown.judged[Watched::load_cell_age], 0.1);
  EXPECT_NEAR(shown.judged[Watched::speed], to_rpm(RadPerSec(100)), 1e-9);
  shown = seen(now_ + milliseconds(200));
  EXPECT_TRUE(std::isnan(shown.judged[Watched::speed]));
}

TEST_F(Observed, ShowsThePeakSinceTheLastLookAndNoSingleOutlier) {
  samples(-6, 10);
  samples(-9, 2);
  samples(-7, 1);
  samples(2000, 1);
  samples(-7, 10);
  EXPECT_DOUBLE_EQ(seen(now_).judged[Watched::force_z], 9) << "two samples in a row carry it";
  samples(-7, 1);
  EXPECT_DOUBLE_EQ(seen(now_).judged[Watched::force_z], 7);
}

TEST_F(Observed, ShowsTheLowestOfALowerLimit) {
  reading(MotorChannel::supply_voltage, 11.9);
  reading(MotorChannel::supply_voltage, 9.5);
  reading(MotorChannel::supply_voltage, 11.8);
  EXPECT_DOUBLE_EQ(seen(now_).judged[Watched::supply_voltage_low], 9.5);
}

TEST_F(Observed, ShowsTheErrorOfSpeedBesideItsBandWhileASpeedIsCommanded) {
  reading(MotorChannel::speed, 0);
  EXPECT_TRUE(std::isnan(seen(now_).judged[Watched::speed_error]));
  observer_.take(results::PhaseMark{results::Phase::step, 0, now_.count(), 500});
  reading(MotorChannel::speed, 100);
  EXPECT_DOUBLE_EQ(seen(now_).judged[Watched::speed_error], 0) << "except while accelerating";
  now_ += std::chrono::seconds(2);
  reading(MotorChannel::speed, 400);
  EXPECT_DOUBLE_EQ(seen(now_).judged[Watched::speed_error], 100 * (100 - SpeedWatch::kFloor) / 500);
  observer_.take(results::PhaseMark{results::Phase::spin_down, -1, now_.count(), 0});
  EXPECT_TRUE(std::isnan(seen(now_).judged[Watched::speed_error]));
}

TEST_F(Observed, ShowsTheHigherVoltageOfModuleAndSupply) {
  reading(MotorChannel::supply_voltage, 11.8);
  SupplyReading supply;
  supply.time_ns = now_.count();
  supply.voltage_v = 12.1;
  supply.current_a = 3;
  observer_.take(supply);
  const Observation shown = seen(now_ + milliseconds(50));
  EXPECT_DOUBLE_EQ(shown.judged[Watched::supply_voltage_low], 11.8);
  EXPECT_DOUBLE_EQ(shown.judged[Watched::supply_voltage_high], 12.1);
  EXPECT_DOUBLE_EQ(shown.judged[Watched::output_current], 3);
  EXPECT_DOUBLE_EQ(shown.judged[Watched::supply_age], 0.05);
}

TEST_F(Observed, PassesEveryValueOnToTheJudgeAlsoNoNumbers) {
  reading(MotorChannel::speed, std::nan(""));
  ASSERT_EQ(judged_.size(), 1u);
  EXPECT_EQ(judged_[0].first, Watched::speed);
  EXPECT_TRUE(std::isnan(judged_[0].second));
  samples(1, 3);
  EXPECT_EQ(judged_.size(), 1u + 3 * 6);
}

}  // namespace observation_test
}  // namespace kphi::daq
