// Every fault of the wire against the whole driver: the reading is right or there is none, and the fault is counted.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <ostream>
#include <tuple>

#include "base/error.hpp"
#include "drivers/supply/modbus_supply.hpp"
#include "test/drivers/supply/simulated_supply.hpp"

namespace kphi::supply {
namespace each_fault_test {

using namespace std::chrono_literals;
using sim::FaultKind;
using test::kShort;
using test::lasting;
using test::once;
using test::Over;
using test::SimulatedSupply;
using testing::HasSubstr;
using testing::ThrowsMessage;

struct Row {
  const char* name;
  Over wire;
  FaultKind kind;
  Duration delay;
  const char* words;  ///< in the failure when the fault stays; nullptr: no fault for the driver
};

void PrintTo(const Row& row, std::ostream* out) { *out << row.name; }

class SupplyMeets : public testing::TestWithParam<Row> {
 protected:
  SupplyMeets() : supply(simulated.address(GetParam().wire), clock, kShort) {
    simulated.inspect([](sim::SupplySlave& slave) { slave.registers().write(8, 1200); });
  }
  SteadyClock clock;
  SimulatedSupply simulated;
  ModbusSupply supply;
};

TEST_P(SupplyMeets, OnceAndReadsOn) {
  simulated.spoil(once(GetParam().kind, GetParam().delay));
  const std::uint64_t before = simulated.truth().requests;
  EXPECT_EQ(supply.read().set_voltage_v, 12);
  EXPECT_EQ(simulated.truth().faults, 1u);
  const std::uint64_t asked = simulated.truth().requests - before;
  if (GetParam().words == nullptr) {
    EXPECT_EQ(asked, 1u);
  } else {
    EXPECT_GE(asked, 3u) << "it asks who answers, and once more";
    EXPECT_LE(asked, 5u);
  }
}

TEST_P(SupplyMeets, ForEverAndSaysSo) {
  simulated.spoil({.kind = GetParam().kind, .lasts = 1h, .delay = GetParam().delay});
  if (GetParam().words == nullptr) {
    EXPECT_EQ(supply.read().set_voltage_v, 12);
    return;
  }
  EXPECT_THAT([&] { (void)supply.read(); },
              ThrowsMessage<DeviceError>(testing::AllOf(HasSubstr(GetParam().words), HasSubstr("supply RD6006 on "))));
}

constexpr Duration kNone{0};
const Row kRows[] = {
    Row{"BadCrc", Over::rtu, FaultKind::supply_bad_crc, kNone, "Invalid CRC"},
    Row{"NoReply", Over::rtu, FaultKind::supply_no_reply, kNone, "no answer"},
    Row{"Deaf", Over::rtu, FaultKind::supply_deaf, kNone, "no answer"},
    Row{"Truncated", Over::rtu, FaultKind::supply_truncated, kNone, "no answer"},
    Row{"Dribble", Over::rtu, FaultKind::supply_dribble, 300us, nullptr},
    Row{"Garbage", Over::rtu, FaultKind::supply_garbage, kNone, "damaged answer"},
    Row{"WrongSlave", Over::rtu, FaultKind::supply_wrong_slave, kNone, "damaged answer"},
    Row{"Echo", Over::rtu, FaultKind::supply_echo, kNone, "damaged answer"},
    Row{"Late", Over::rtu, FaultKind::supply_late, 200ms, "no answer"},
    Row{"NoReplyTcp", Over::tcp, FaultKind::supply_no_reply, kNone, "no answer"},
    Row{"TruncatedTcp", Over::tcp, FaultKind::supply_truncated, kNone, "no answer"},
    Row{"DribbleTcp", Over::tcp, FaultKind::supply_dribble, 300us, nullptr},
    Row{"GarbageTcp", Over::tcp, FaultKind::supply_garbage, kNone, ""},
    Row{"WrongTransactionTcp", Over::tcp, FaultKind::supply_wrong_transaction, kNone, "damaged answer"},
    Row{"LateTcp", Over::tcp, FaultKind::supply_late, 200ms, "no answer"}};
INSTANTIATE_TEST_SUITE_P(Faults, SupplyMeets, testing::ValuesIn(kRows), [](const auto& row) { return row.param.name; });

class OneSupply : public testing::Test {
 protected:
  SteadyClock clock;
  SimulatedSupply simulated;
  ModbusSupply supply{simulated.address(), clock, kShort};
};

TEST_F(OneSupply, MeetsOneExceptionAndAsksAgain) {
  simulated.spoil({.kind = FaultKind::supply_exception, .count = 1, .code = 2});
  EXPECT_FALSE(supply.read().output);
}

TEST_F(OneSupply, MeetsTwoExceptionsAndAsksNoMore) {
  simulated.spoil(lasting(FaultKind::supply_exception));
  const std::uint64_t before = simulated.truth().requests;
  EXPECT_THROW((void)supply.read(), DeviceError);
  EXPECT_EQ(simulated.truth().requests - before, 2u);
}

TEST_F(OneSupply, MeetsABusyDeviceAndAsksAgain) {
  simulated.spoil({.kind = FaultKind::supply_exception, .count = 2, .code = 6});
  EXPECT_FALSE(supply.read().output);
}

TEST(SupplyMeetsOneFaultAfterAnother, AndNamesTheFirstFirst) {
  SteadyClock clock;
  SimulatedSupply simulated;
  ModbusSupply supply(simulated.address(Over::tcp), clock, kShort);
  simulated.spoil(once(FaultKind::supply_no_reply));
  simulated.spoil(lasting(FaultKind::supply_wrong_transaction));
  EXPECT_THAT(
      [&] { (void)supply.read(); },
      ThrowsMessage<DeviceError>(HasSubstr("read: no answer, then damaged answer (Invalid data); check its power")));
}

/// The stale answer. The voltage is turned from 12 to 11 V while an answer with 12 is under way: whatever the driver
/// returns after its deadline must be 11.
class AStaleAnswer : public testing::TestWithParam<std::tuple<Over, std::chrono::milliseconds>> {};

TEST_P(AStaleAnswer, NeverBecomesAValue) {
  const auto [wire, late] = GetParam();
  SteadyClock clock;
  SimulatedSupply simulated;
  simulated.inspect([](sim::SupplySlave& slave) { slave.registers().write(8, 1200); });
  ModbusSupply supply(simulated.address(wire), clock, kShort);
  ASSERT_EQ(supply.read().set_voltage_v, 12);
  simulated.spoil(once(FaultKind::supply_late, kShort.answer + late));
  simulated.spoil({.kind = FaultKind::supply_panel, .at = kShort.answer / 2, .address = 8, .value = 1100});
  EXPECT_EQ(supply.read().set_voltage_v, 11);
  EXPECT_EQ(supply.read().set_voltage_v, 11);
}

INSTANTIATE_TEST_SUITE_P(AfterTheDeadline, AStaleAnswer,
                         testing::Combine(testing::Values(Over::rtu, Over::tcp),
                                          testing::Values(10ms, 50ms, 90ms, 140ms)));

/// A line on which everything happens now and then, from a seed: each reading is true or an error, never a wrong value.
TEST(SupplyOnABadLine, ReadsTheTruthOrNothing) {
  SteadyClock clock;
  SimulatedSupply simulated("RD6006", 0, [](sim::SupplySettings& s) { s.seed = 7; });
  ModbusSupply supply(simulated.address(), clock, Timing{40ms, 20ms, 20ms});
  supply.apply({Volts(12), Amperes(2), Volts(13), Amperes(3)});
  for (const FaultKind kind :
       {FaultKind::supply_bad_crc, FaultKind::supply_no_reply, FaultKind::supply_truncated, FaultKind::supply_garbage,
        FaultKind::supply_wrong_slave, FaultKind::supply_echo, FaultKind::supply_late}) {
    simulated.spoil({.kind = kind, .lasts = 1h, .delay = 50ms, .p = 0.04});
  }
  int read = 0, failed = 0;
  for (int i = 0; i < 100; ++i) {
    const double volts = i % 2 == 0 ? 11 : 12;
    simulated.inspect(
        [&](sim::SupplySlave& slave) { slave.registers().write(8, static_cast<std::uint16_t>(volts * 100)); });
    try {
      ASSERT_EQ(supply.read().set_voltage_v, volts) << i;
      ++read;
    } catch (const DeviceError&) {
      ++failed;
    }
  }
  EXPECT_GT(read, 50);
  EXPECT_GT(simulated.truth().faults, 10u);
  EXPECT_EQ(simulated.harm(), 0u);
}

}  // namespace each_fault_test
}  // namespace kphi::supply
