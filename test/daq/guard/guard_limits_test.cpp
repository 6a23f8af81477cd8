#include "daq/guard/guard_limits.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <regex>

#include "daq/virtual/deterministic_bench.hpp"
#include "profiles/schema.hpp"
#include "test/daq/bench_fixture.hpp"

namespace kphi::daq {
namespace guard_limits_test {

using testing::HasSubstr;

class CombinedLimits : public testing::Test {
 protected:
  [[nodiscard]] std::optional<GuardLimit> row(Watched watched) const {
    for (const GuardLimit& limit : combine_limits(campaign_, config_, devices_ ? &*devices_ : nullptr)) {
      if (limit.watched == watched) return limit;
    }
    return std::nullopt;
  }
  void expect(Watched watched, double value, const std::string& source) const {
    const auto found = row(watched);
    ASSERT_TRUE(found);
    EXPECT_NEAR(found->value, value, 1e-9 * value);
    EXPECT_THAT(found->source, HasSubstr(source));
  }
  void told(const iq::Entry& entry, double value) {
    if (!devices_) devices_.emplace();
    devices_->motor.values[&entry] = value;
  }

  profiles::Campaign campaign_ = test::short_campaign();
  profiles::BenchConfig config_ = test::deterministic_config(1);
  std::optional<DeviceLimits> devices_;
};

TEST_F(CombinedLimits, NameEachLimitThatAFileMaySet) {
  using profiles::FileKind;
  const auto holds = [&](FileKind kind, const std::string& key, double value) {
    const bool of_campaign = kind == FileKind::campaign;
    std::string text = of_campaign ? campaign_.text : config_.text + "limits: {}\n";
    text = std::regex_replace(text, std::regex("(limits: .*?)" + key + ": \\d+,?"), "$1");
    text.insert(text.find("limits: {") + 9, fmt::format("{}: {}, ", key, value));
    try {
      const auto limits = of_campaign ? combine_limits(profiles::parse_campaign(text, "c.yaml"), config_)
                                      : combine_limits(campaign_, profiles::parse_bench(text, "b.yaml"));
      return std::ranges::any_of(limits, [&](const GuardLimit& limit) {
        return limit.source.starts_with(fmt::format("{} limits.{}", info(kind).word, key));
      });
    } catch (const ConfigurationError&) {
      return false;  // another value may be allowed
    }
  };
  for (const FileKind kind : {FileKind::campaign, FileKind::bench}) {
    for (const auto& limit : schema_of(kind)["properties"]["limits"]["properties"].items()) {
      if (limit.value()["type"] != "number") continue;
      const auto tight = {1.0, 20.0, 12.5, 18000.0};
      EXPECT_TRUE(std::ranges::any_of(tight, [&](double value) { return holds(kind, limit.key(), value); }))
          << limit.key();
    }
  }
}

TEST_F(CombinedLimits, AreThoseOfTheCampaignWhenNobodySaysLess) {
  expect(Watched::thrust, 20, "campaign limits.thrust_max_n");
  expect(Watched::speed, 1.05 * 19100, "campaign limits.speed_max_rpm");
  expect(Watched::supply_current, 35, "campaign limits.supply_current_max_a");
  expect(Watched::coil_temperature, 110, "campaign limits.coil_temperature_max_degc");
}

TEST_F(CombinedLimits, HaveNoRowForWhatNobodyLimits) {
  for (const Watched watched : {Watched::shaft_torque, Watched::force_z, Watched::supply_voltage_high,
                                Watched::supply_age, Watched::output_current})  // this bench has no supply
    EXPECT_FALSE(row(watched)) << static_cast<int>(watched);
}

TEST_F(CombinedLimits, TakeTheTighterOfCampaignAndBench) {
  config_.iq.speed_max = from_rpm(15000);
  expect(Watched::speed, 1.05 * 15000, "bench iq.speed_max_rpm");
  config_.supply = profiles::SupplyConfig{"x", Volts(12), Amperes(20), Volts(14), Amperes(22)};
  expect(Watched::supply_voltage_high, 14, "bench supply.over_voltage_v");
  expect(Watched::output_current, 1.02 * 22, "bench supply.over_current_a");
  campaign_.limits["supply_current_max_a"] = 18;
  campaign_.limits["supply_voltage_max_v"] = 13.2;
  expect(Watched::output_current, 18, "campaign");
  expect(Watched::supply_voltage_high, 13.2, "campaign limits.supply_voltage_max_v");
  EXPECT_EQ(limit_of_files(Watched::thrust, campaign_, config_), 20);
  config_.limits["thrust_max_n"] = 15;
  expect(Watched::thrust, 15, "bench limits.thrust_max_n");
  EXPECT_EQ(limit_of_files(Watched::thrust, campaign_, config_), 15);
}

TEST_F(CombinedLimits, TakeWhatTheDevicesBearWhenThatIsLess) {
  told(iq::entry<"brushless_drive.motor_redline_start">, 1500);
  told(iq::entry<"power_safety.current_input_high">, 30);
  told(iq::entry<"power_safety.temperature_coil_high">, 105);
  told(iq::entry<"coil_temperature_estimator.otw">, 95);
  devices_->load_cell_range = {20, 20, 60, 1, 1, 1};
  expect(Watched::speed, to_rpm(RadPerSec(1500)), "device motor brushless_drive.motor_redline_start");
  expect(Watched::supply_current, 30, "device motor power_safety.current_input_high");
  expect(Watched::coil_temperature, 95, "device motor coil_temperature_estimator.otw");
  expect(Watched::force_z, 66, "device load cell");
  expect(Watched::torque_x, 1.1, "device load cell");
}

TEST_F(CombinedLimits, OfAVoltageTheHigherOfTheLowerOnesIsTheTighter) {
  told(iq::entry<"power_safety.volt_input_low">, 5);
  expect(Watched::supply_voltage_low, 5, "device motor power_safety.volt_input_low");
  campaign_.limits["supply_voltage_min_v"] = 10.5;
  expect(Watched::supply_voltage_low, 10.5, "campaign limits.supply_voltage_min_v");
  EXPECT_TRUE(row(Watched::supply_voltage_low)->lower);
}

TEST_F(CombinedLimits, BelieveNoDeviceThatSaysNonsense) {
  for (const double nonsense : {0.0, -1.0, std::nan(""), 1.0 / 0.0}) {
    told(iq::entry<"power_safety.current_input_high">, nonsense);
    expect(Watched::supply_current, 35, "campaign");
  }
}

TEST_F(CombinedLimits, OfASlowSuppliesAgeAreAsLongAsItsReadingsTake) {
  config_.supply = profiles::SupplyConfig{"x", Volts(12), Amperes(20), Volts(14), Amperes(22)};
  expect(Watched::supply_age, 2, "kphi");
  devices_.emplace().supply_reading_s = 0.45;
  expect(Watched::supply_age, 2, "kphi");
  devices_->supply_reading_s = 3.6;
  expect(Watched::supply_age, 8.2, "kphi; a reading takes 3.6 s");
}

TEST_F(CombinedLimits, OfASpeedErrorCanOnlyBeTightened) {
  expect(Watched::speed_error, 15, "kphi");
  campaign_.limits["speed_error_max_percent"] = 5;
  expect(Watched::speed_error, 5, "campaign limits.speed_error_max_percent");
}

TEST_F(CombinedLimits, AreReadFromACampaignFile) {
  std::string text = test::short_campaign_text();
  text.replace(text.find("coil_temperature_max_degc: 110"), 30,
               "coil_temperature_max_degc: 110, torque_max_nm: 0.3, supply_voltage_min_v: 10, "
               "supply_voltage_max_v: 13.5, speed_error_max_percent: 4");
  campaign_ = profiles::parse_campaign(text, "c.yaml");
  expect(Watched::shaft_torque, 0.3, "campaign limits.torque_max_nm");
  expect(Watched::supply_voltage_low, 10, "campaign");
  expect(Watched::supply_voltage_high, 13.5, "campaign");
  expect(Watched::speed_error, 4, "campaign");
}

TEST_F(CombinedLimits, OfAConnectedBenchNameTheLoadCellAndTheMotor) {
  DeterministicBench bench(config_);
  devices_ = device_limits(bench);
  const auto limits = combine_limits(campaign_, config_, &*devices_);
  EXPECT_TRUE(
      std::is_sorted(limits.begin(), limits.end(), [](const auto& a, const auto& b) { return a.watched < b.watched; }));
  expect(Watched::force_z, 66, "110 % of its range");
  expect(Watched::supply_voltage_high, 30, "device motor power_safety.volt_input_high");
  EXPECT_THAT(to_lines(limits),
              testing::Contains(testing::ContainsRegex("^thrust +above 20 N +campaign limits.thrust_max_n$")));
}

TEST_F(CombinedLimits, OfARecordedRunAreThoseThatItsGuardHad) {
  DeterministicBench bench(config_);
  devices_ = device_limits(bench);
  results::RunHeader header;
  header.load_cell.range = devices_->load_cell_range;
  header.motor_parameters = bench.motor().parameters().text();
  const DeviceLimits recorded = device_limits(header);
  EXPECT_EQ(combine_limits(campaign_, config_, &recorded), combine_limits(campaign_, config_, &*devices_));
}

}  // namespace guard_limits_test
}  // namespace kphi::daq
