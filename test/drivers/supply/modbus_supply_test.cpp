#include "drivers/supply/modbus_supply.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>
#include <stdexcept>

#include "base/error.hpp"
#include "test/drivers/serial/pseudo_terminal.hpp"
#include "test/drivers/supply/simulated_supply.hpp"

namespace kphi::supply {
namespace modbus_supply_test {

using namespace std::chrono_literals;
using sim::FaultKind;
using test::kShort;
using test::lasting;
using test::once;
using test::Over;
using test::SimulatedSupply;
using test::soon;
using test::what_of;
using testing::AllOf;
using testing::HasSubstr;

const Limits kTwelveVolts{Volts(12), Amperes(2.5), Volts(13), Amperes(3)};

void expect_held(SimulatedSupply& supply, const Limits& limits) {
  supply.inspect([&](sim::SupplySlave& slave) {
    const sim::SupplyControls& controls = slave.circuit().controls();
    EXPECT_NEAR(controls.volts, limits.voltage.value(), 1e-9);
    EXPECT_NEAR(controls.amps, limits.current.value(), 1e-9);
    EXPECT_NEAR(controls.over_volts, limits.over_voltage.value(), 1e-9);
    EXPECT_NEAR(controls.over_amps, limits.over_current.value(), 1e-9);
  });
}

/// Every model, on both wires.
class EverySupply : public testing::TestWithParam<std::string> {
 protected:
  SteadyClock clock;
  SimulatedSupply simulated{GetParam()};
};

TEST_P(EverySupply, TellsWhoItIs) {
  for (const Over wire : {Over::rtu, Over::tcp}) {
    const ModbusSupply supply(simulated.address(wire), clock, kShort);
    EXPECT_EQ(supply.identity().model, GetParam());
    EXPECT_THAT(supply.identity().device, HasSubstr("supply " + GetParam() + " on "));
    EXPECT_EQ(supply.identity().voltage_max_v, find_model(GetParam())->max_v);
  }
  EXPECT_TRUE(simulated.truth().writes.empty()) << "to ask who it is writes nothing";
}

TEST_P(EverySupply, SaysWhatBecomesOfItsKeys) {
  const bool riden = GetParam().starts_with("RD");
  const auto keypad = [&] { return ModbusSupply(simulated.address(), clock, kShort).identity().keypad; };
  EXPECT_EQ(keypad(), riden ? SupplyKeypad::locked : SupplyKeypad::free);
  simulated.spoil(once(FaultKind::supply_key));
  EXPECT_TRUE(soon([&] { return simulated.output() || simulated.truth().dead_keys == 1; }));
  EXPECT_EQ(simulated.output(), !riden) << "a key that is locked switches nothing";
  simulated.spoil(lasting(FaultKind::supply_keys_free));
  EXPECT_EQ(keypad(), riden ? SupplyKeypad::said_free : SupplyKeypad::free);
}

TEST_P(EverySupply, IsSetInItsOwnScale) {
  ModbusSupply supply(simulated.address(), clock, kShort);
  const Limits applied = supply.apply(kTwelveVolts);
  EXPECT_DOUBLE_EQ(applied.voltage.value(), 12);
  EXPECT_DOUBLE_EQ(applied.over_current.value(), 3);
  expect_held(simulated, kTwelveVolts);
}

TEST_P(EverySupply, ReadsWhatIsAtItsTerminals) {
  ModbusSupply supply(simulated.address(), clock, kShort);
  supply.apply(kTwelveVolts);
  EXPECT_FALSE(supply.read().output);
  {
    PoweredOutput on(supply);
    ASSERT_TRUE(soon([&] { return supply.read().voltage_v > 11.969; }));
    const Instant before = clock.now();
    const SupplyReading reading = supply.read();
    EXPECT_TRUE(reading.output);
    EXPECT_EQ(reading.regulation, SupplyRegulation::constant_voltage);
    EXPECT_EQ(reading.protection, SupplyProtection::none);
    EXPECT_NEAR(reading.voltage_v, 12 - 0.020 * 1.2, 0.02);
    EXPECT_NEAR(reading.current_a, 0.1 * reading.voltage_v, 0.02);
    EXPECT_NEAR(reading.power_w(), reading.voltage_v * reading.current_a, 1e-12);
    EXPECT_DOUBLE_EQ(reading.set_voltage_v, 12);
    EXPECT_DOUBLE_EQ(reading.current_limit_a, 2.5);
    EXPECT_GE(Instant(reading.time_ns - reading.uncertainty_ns), before - 1ns);
    EXPECT_LE(Instant(reading.time_ns + reading.uncertainty_ns), clock.now() + 1ns);
    EXPECT_GT(reading.uncertainty_ns, 0);
  }
  EXPECT_FALSE(simulated.output());
  EXPECT_EQ(simulated.harm(), 0u);
}

TEST_P(EverySupply, TellsConstantCurrent) {
  ModbusSupply supply(simulated.address(), clock, kShort);
  supply.apply({Volts(12), Amperes(1), Volts(13), Amperes(3)});
  simulated.hang({0, 0.5});
  PoweredOutput on(supply);
  EXPECT_TRUE(soon([&] { return supply.read().regulation == SupplyRegulation::constant_current; }));
  EXPECT_TRUE(soon([&] { return std::abs(supply.read().current_a - 1) < 0.015; }));
  EXPECT_NEAR(supply.read().voltage_v, 2, 0.2);
}

TEST_P(EverySupply, TellsWhyItHasTripped) {
  ModbusSupply supply(simulated.address(), clock, kShort);
  supply.apply({Volts(12), Amperes(3), Volts(13), Amperes(1)});
  simulated.hang({0, 0.2});
  const std::string refusal = what_of([&] {
    PoweredOutput on(supply);
    EXPECT_TRUE(soon([&] { return supply.read().protection != SupplyProtection::none; }));
    EXPECT_EQ(supply.read().protection, SupplyProtection::over_current);
    EXPECT_FALSE(supply.read().output);
    throw std::runtime_error("seen");
  });
  // A fast trip is reported by the switch itself.
  EXPECT_THAT(refusal, testing::AnyOf(HasSubstr("seen"), HasSubstr("over-current")));
}

INSTANTIATE_TEST_SUITE_P(Models, EverySupply,
                         testing::Values("RD6006", "RD6006P", "RD6012", "RD6012P", "RD6018", "RD6024", "DPS3005",
                                         "DPS5005", "DPH5005", "DPS5015", "DPS5020", "DPS8005", "HM305P", "HM310P"),
                         [](const auto& model) { return model.param; });

class Riden : public testing::Test {
 protected:
  SteadyClock clock;
  SimulatedSupply simulated;
};

class OpenRiden : public Riden {
 protected:
  ModbusSupply supply{simulated.address(), clock, kShort};
};

TEST_F(OpenRiden, WritesThresholdsFirstAndSwitchesWithFunctionSix) {
  supply.apply(kTwelveVolts);
  { PoweredOutput on(supply); }
  using Write = std::pair<std::uint16_t, std::uint16_t>;
  EXPECT_THAT(simulated.truth().writes, testing::ElementsAre(Write{82, 1300}, Write{83, 3000}, Write{9, 2500},
                                                             Write{8, 1200}, Write{18, 1}, Write{18, 0}));
}

TEST_F(OpenRiden, AsksWhoItIsBeforeAnythingElse) {
  const auto truth = simulated.truth();
  ASSERT_GE(truth.frames.size(), 2u);
  EXPECT_EQ(truth.frames[0], (std::vector<std::uint8_t>{1, 3, 0, 0, 0, 4, 0x44, 0x09}));
  EXPECT_EQ(truth.frames[1], (std::vector<std::uint8_t>{1, 3, 0, 8, 0, 13, 0x05, 0xCD}));
  EXPECT_EQ(supply.identity().serial, "00004711");
  EXPECT_EQ(supply.identity().firmware, "1.28");
}

TEST_F(OpenRiden, RefusesToBeSwitchedOnWithoutLimits) {
  EXPECT_THAT(what_of([&] { PoweredOutput on(supply); }), HasSubstr("its limits are not set"));
  for (const auto& [at, value] : simulated.truth().writes) EXPECT_EQ(value, 0) << at;
}

TEST_F(OpenRiden, RefusesSettingsBeyondItsRange) {
  for (const Limits& limits :
       {Limits{Volts(60.1), Amperes(1), Volts(60), Amperes(1)}, Limits{Volts(12), Amperes(6.1), Volts(13), Amperes(1)},
        Limits{Volts(12), Amperes(1), Volts(-1), Amperes(1)}, Limits{Volts(12), Amperes(1), Volts(13), Amperes(NAN)}}) {
    EXPECT_THROW(supply.apply(limits), std::invalid_argument);
  }
  EXPECT_THAT(what_of([&] {
                supply.apply({Volts(61), Amperes(1), Volts(13), Amperes(1)});
              }),
              HasSubstr(": voltage of 61 V is outside 0 to 60 V"));
  EXPECT_TRUE(simulated.truth().writes.empty());
}

TEST_F(OpenRiden, SetsZeroAsAnyOtherValue) {
  const Limits applied = supply.apply({Volts(0), Amperes(0), Volts(13), Amperes(3)});
  EXPECT_EQ(applied.voltage.value(), 0);
  EXPECT_EQ(supply.read().set_voltage_v, 0);
}

TEST_F(OpenRiden, NoticesWhenItDoesNotDoWhatItAcknowledges) {
  supply.apply(kTwelveVolts);
  simulated.spoil(lasting(FaultKind::supply_ignored_writes));
  EXPECT_THAT(what_of([&] {
                supply.apply({Volts(11), Amperes(2.5), Volts(13), Amperes(3)});
              }),
              HasSubstr("set to 11, reads back 12"));
  EXPECT_THAT(what_of([&] { PoweredOutput on(supply); }), HasSubstr("acknowledged, but the output stays off"));
}

TEST_F(OpenRiden, SaysWhenItCannotBeSwitchedOff) {
  supply.apply(kTwelveVolts);
  PoweredOutput on(supply);
  simulated.spoil(lasting(FaultKind::supply_ignored_writes));
  EXPECT_THAT(on.off(), HasSubstr("the output is still ON; switch it off by hand"));
}

/// The order leaves even when nothing comes back: the device may hear though it is not heard.
TEST_F(OpenRiden, IsSwitchedOffThoughItIsNotHeard) {
  supply.apply(kTwelveVolts);
  PoweredOutput on(supply);
  simulated.spoil(lasting(FaultKind::supply_no_reply));
  EXPECT_THROW((void)supply.read(), DeviceError);
  EXPECT_TRUE(simulated.output());
  EXPECT_THAT(on.off(), HasSubstr("no answer"));
  EXPECT_FALSE(simulated.output());
}

TEST_F(OpenRiden, IsTriedAtMostThreeTimes) {
  simulated.spoil(lasting(FaultKind::supply_deaf));
  const std::uint64_t before = simulated.truth().requests;
  EXPECT_THAT(what_of([&] { (void)supply.read(); }),
              AllOf(HasSubstr("read: no answer"), HasSubstr("its baud rate (115200 here")));
  EXPECT_EQ(simulated.truth().requests - before, 3u);
}

TEST_F(Riden, SilentAbsentOrOfAnotherModelIsNamed) {
  const auto refusal = [&](const Address& address) { return what_of([&] { ModbusSupply(address, clock, kShort); }); };
  serial::fake::PseudoTerminal line;
  EXPECT_THAT(refusal(parse_address("modbus-rtu:" + line.name())),
              AllOf(HasSubstr("supply on " + line.name()), HasSubstr("no answer"), HasSubstr("its baud rate")));
  EXPECT_THAT(refusal(parse_address("modbus-rtu:/dev/no-such-port")),
              AllOf(HasSubstr("No such file or directory"), HasSubstr("plug")));
  EXPECT_THAT(refusal(parse_address("modbus-tcp:127.0.0.1:1")),
              AllOf(HasSubstr("127.0.0.1:1"), HasSubstr("check host, port and network")));
  EXPECT_THAT(refusal(simulated.address(Over::rtu, "?model=RD6012")), HasSubstr("found a RD6006, not a RD6012"));
}

TEST_F(Riden, OfUnknownModelIsRefusedAndLeftAlone) {
  simulated.spoil(lasting(FaultKind::supply_reads_as, 0, 60991));
  EXPECT_THAT(what_of([&] { ModbusSupply(simulated.address(), clock, kShort); }),
              AllOf(HasSubstr("unknown model: RD60xx register 0 is 60991"), HasSubstr("known are RD6006")));
  EXPECT_TRUE(simulated.truth().writes.empty());
}

TEST_F(OpenRiden, ReplacedByAnotherIsNoticed) {
  simulated.spoil(lasting(FaultKind::supply_reads_as, 2, 4712));
  EXPECT_TRUE(supply.read().time_ns > 0) << "nothing has given rise to the question";
  simulated.spoil(once(FaultKind::supply_no_reply));
  EXPECT_THAT(what_of([&] { (void)supply.read(); }), HasSubstr("another device answers"));
}

TEST_F(OpenRiden, ReportingWhatCannotBeIsNotBelieved) {
  const std::map<std::uint16_t, std::uint16_t> impossible{{8, 6700},  {9, 6700}, {10, 6601},
                                                          {11, 6601}, {17, 2},   {18, 7}};
  for (const auto& [at, value] : impossible) {
    SimulatedSupply another;
    ModbusSupply doubted(another.address(), clock, kShort);
    another.spoil(lasting(FaultKind::supply_reads_as, at, value));
    EXPECT_THAT(what_of([&] { (void)doubted.read(); }), HasSubstr("implausible reply")) << at;
  }
}

TEST_F(OpenRiden, WithAnUnknownProtectionCodeHasTripped) {
  simulated.spoil(lasting(FaultKind::supply_reads_as, 16, 9));
  EXPECT_EQ(supply.read().protection, SupplyProtection::unknown);
}

/// After a preset was recalled on the panel the thresholds are not the ones that are read: they are always written.
TEST_F(OpenRiden, HasItsOwnThresholdsAfterAPresetWasRecalled) {
  supply.apply(kTwelveVolts);
  simulated.inspect([](sim::SupplySlave& slave) { slave.registers().write(19, 3); });
  supply.apply(kTwelveVolts);
  expect_held(simulated, kTwelveVolts);
}

TEST_F(Riden, ComesBackAfterItWasUnpluggedAndPluggedInAgain) {
  for (const Over wire : {Over::rtu, Over::tcp}) {
    ModbusSupply supply(simulated.address(wire), clock, kShort);
    simulated.spoil({.kind = FaultKind::supply_closed, .lasts = 100ms});
    EXPECT_TRUE(soon([&] { return what_of([&] { (void)supply.read(); }) != "nothing was thrown"; }));
    EXPECT_TRUE(soon([&] { return what_of([&] { (void)supply.read(); }) == "nothing was thrown"; }));
  }
}

TEST(RidenWithTwoRanges, CountsByItsRangeRegister) {
  SteadyClock clock;
  SimulatedSupply simulated("RD6012P");
  ModbusSupply narrow(simulated.address(), clock, kShort);
  EXPECT_EQ(narrow.identity().current_max_a, 6);
  EXPECT_THROW(narrow.apply({Volts(12), Amperes(9), Volts(13), Amperes(10)}), std::invalid_argument);
  simulated.inspect([](sim::SupplySlave& slave) { slave.registers().write(20, 1); });
  const Limits applied = narrow.apply({Volts(12), Amperes(9), Volts(13), Amperes(10)});
  EXPECT_DOUBLE_EQ(applied.current.value(), 9);
  EXPECT_DOUBLE_EQ(narrow.read().current_limit_a, 9);
  simulated.inspect([](sim::SupplySlave& slave) { EXPECT_NEAR(slave.circuit().controls().amps, 9, 1e-9); });
}

TEST(HanmatekThresholds, InThreeDecimalsTripTooEarlyNeverTooLate) {
  SteadyClock clock;
  SimulatedSupply simulated("HM310P", 0, [](sim::SupplySettings& s) { s.over_current_in_milliamps = true; });
  ModbusSupply supply(simulated.address(), clock, kShort);
  supply.apply(kTwelveVolts);
  simulated.inspect([](sim::SupplySlave& slave) { EXPECT_LE(slave.circuit().controls().over_amps, 3); });
}

/// Power, its high word or mAh, and the preset: sources disagree on what these registers show.
TEST(RidenDisputes, DoNotTouchAReading) {
  SteadyClock clock;
  for (const auto value : std::array<std::uint16_t, 3>{0, 1, 0xFFFF}) {
    SimulatedSupply simulated("RD6006P");
    for (const auto at : std::array<std::uint16_t, 3>{12, 13, 19})
      simulated.spoil(lasting(FaultKind::supply_reads_as, at, value));
    ModbusSupply supply(simulated.address(), clock, kShort);
    supply.apply(kTwelveVolts);
    PoweredOutput on(supply);
    EXPECT_TRUE(soon([&] { return std::abs(supply.read().power_w() - 14.3) < 0.2; }));
  }
}

/// Random settings of every model: what is applied is the nearest step, and what the device holds.
TEST(RandomSettings, ArriveAsTheNearestStep) {
  SteadyClock clock;
  std::mt19937_64 random(20210530);
  for (const Model& model : models()) {
    SimulatedSupply simulated{std::string(model.name)};
    ModbusSupply supply(simulated.address(), clock, kShort);
    const auto any = [&](double max) { return std::uniform_real_distribution<double>(0, max)(random); };
    for (int i = 0; i < 5; ++i) {
      const double max_a = model.ranges[0].max_a;
      const Limits wanted{Volts(any(model.max_v)), Amperes(any(max_a)), Volts(any(model.max_v)), Amperes(any(max_a))};
      const Limits applied = supply.apply(wanted);
      EXPECT_NEAR(applied.voltage.value(), wanted.voltage.value(), 0.5001 / model.counts_per_v);
      EXPECT_NEAR(applied.current.value(), wanted.current.value(), 0.5001 / model.ranges[0].counts_per_a);
      expect_held(simulated, applied);
    }
  }
}

}  // namespace modbus_supply_test
}  // namespace kphi::supply
