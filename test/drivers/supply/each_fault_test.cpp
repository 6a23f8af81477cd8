// Every fault of the wire against the whole driver: the reading is right or there is none, and the fault is counted.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <ostream>

#include "base/error.hpp"
#include "drivers/supply/modbus_supply.hpp"
#include "test/drivers/supply/simulated_supply.hpp"

namespace kphi::supply {
namespace each_fault_test {

using namespace std::chrono_literals;
using sim::FaultKind;
using test::kShort;
using test::lasting;
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

sim::Fault fault_of(const Row& row) {
  sim::Fault fault;
  fault.kind = row.kind;
  fault.delay = row.delay;
  return fault;
}

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
  sim::Fault fault = fault_of(GetParam());
  fault.count = 1;
  simulated.spoil(fault);
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
  sim::Fault fault = fault_of(GetParam());
  fault.lasts = 1h;
  simulated.spoil(fault);
  if (GetParam().words == nullptr) {
    EXPECT_EQ(supply.read().set_voltage_v, 12);
    return;
  }
  EXPECT_THAT([&] { (void)supply.read(); },
              ThrowsMessage<DeviceError>(testing::AllOf(HasSubstr(GetParam().words), HasSubstr("supply RD6006 on "))));
}

constexpr Duration kNone{0};
INSTANTIATE_TEST_SUITE_P(
    Faults, SupplyMeets,
    testing::Values(Row{"BadCrc", Over::rtu, FaultKind::supply_bad_crc, kNone, "Invalid CRC"},
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
                    Row{"LateTcp", Over::tcp, FaultKind::supply_late, 200ms, "no answer"}),
    [](const auto& row) { return row.param.name; });

TEST(SupplyMeetsAnException, AndDoesNotAskAgain) {
  SteadyClock clock;
  SimulatedSupply simulated;
  ModbusSupply supply(simulated.address(), clock, kShort);
  simulated.spoil(lasting(FaultKind::supply_exception));
  const std::uint64_t before = simulated.truth().requests;
  EXPECT_THROW((void)supply.read(), DeviceError);
  EXPECT_EQ(simulated.truth().requests - before, 1u);
}

TEST(SupplyMeetsABusyDevice, AndAsksAgain) {
  SteadyClock clock;
  SimulatedSupply simulated;
  ModbusSupply supply(simulated.address(), clock, kShort);
  sim::Fault busy;
  busy.kind = FaultKind::supply_exception;
  busy.code = 6;
  busy.count = 2;
  simulated.spoil(busy);
  EXPECT_FALSE(supply.read().output);
}

TEST(SupplyMeetsOneFaultAfterAnother, AndNamesTheFirstFirst) {
  SteadyClock clock;
  SimulatedSupply simulated;
  ModbusSupply supply(simulated.address(Over::tcp), clock, kShort);
  sim::Fault silent;
  silent.kind = FaultKind::supply_no_reply;
  silent.count = 1;
  simulated.spoil(silent);
  simulated.spoil(lasting(FaultKind::supply_wrong_transaction));
  EXPECT_THAT(
      [&] { (void)supply.read(); },
      ThrowsMessage<DeviceError>(HasSubstr("read: no answer, then damaged answer (Invalid data); check its power")));
}

struct Lateness {
  Over wire;
  Duration after_the_deadline;
};

void PrintTo(const Lateness& late, std::ostream* out) { *out << late.after_the_deadline.count() / 1'000'000 << "ms"; }

/// The stale answer. The voltage is turned from 12 to 11 V while an answer with 12 is under way: whatever the driver
/// returns after its deadline must be 11.
class AStaleAnswer : public testing::TestWithParam<Lateness> {};

TEST_P(AStaleAnswer, NeverBecomesAValue) {
  SteadyClock clock;
  SimulatedSupply simulated;
  simulated.inspect([](sim::SupplySlave& slave) { slave.registers().write(8, 1200); });
  ModbusSupply supply(simulated.address(GetParam().wire), clock, kShort);
  ASSERT_EQ(supply.read().set_voltage_v, 12);
  sim::Fault late;
  late.kind = FaultKind::supply_late;
  late.count = 1;
  late.delay = kShort.answer + GetParam().after_the_deadline;
  simulated.spoil(late);
  sim::Fault turned;
  turned.kind = FaultKind::supply_panel;
  turned.at = kShort.answer / 2;
  turned.address = 8;
  turned.value = 1100;
  simulated.spoil(turned);
  EXPECT_EQ(supply.read().set_voltage_v, 11);
  EXPECT_EQ(supply.read().set_voltage_v, 11);
}

INSTANTIATE_TEST_SUITE_P(Lateness, AStaleAnswer,
                         testing::Values(Lateness{Over::rtu, 10ms}, Lateness{Over::rtu, 50ms},
                                         Lateness{Over::rtu, 90ms}, Lateness{Over::rtu, 140ms},
                                         Lateness{Over::tcp, 10ms}, Lateness{Over::tcp, 50ms},
                                         Lateness{Over::tcp, 90ms}, Lateness{Over::tcp, 140ms}));

/// A line on which everything happens now and then, from a seed: each reading is true or an error, never a wrong value.
TEST(SupplyOnABadLine, ReadsTheTruthOrNothing) {
  SteadyClock clock;
  sim::SupplySettings settings;
  settings.replies_per_s = 0;
  settings.seed = 7;
  SimulatedSupply simulated(settings);
  ModbusSupply supply(simulated.address(), clock, Timing{40ms, 20ms, 20ms});
  supply.apply({Volts(12), Amperes(2), Volts(13), Amperes(3)});
  for (const FaultKind kind :
       {FaultKind::supply_bad_crc, FaultKind::supply_no_reply, FaultKind::supply_truncated, FaultKind::supply_garbage,
        FaultKind::supply_wrong_slave, FaultKind::supply_echo, FaultKind::supply_late}) {
    sim::Fault fault;
    fault.kind = kind;
    fault.lasts = 1h;
    fault.p = 0.04;
    fault.delay = 50ms;
    simulated.spoil(fault);
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
