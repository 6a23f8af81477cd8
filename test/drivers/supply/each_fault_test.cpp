// Every fault of the wire against the whole driver: the reading is right or there is none, and the fault is counted.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <ostream>

#include "base/error.hpp"
#include "drivers/supply/modbus_supply.hpp"
#include "test/drivers/supply/simulated_supply.hpp"

namespace kphi::supply {
namespace {

using namespace std::chrono_literals;
using sim::SupplyFaultKind;
using test::kShort;
using test::lasting;
using test::Over;
using test::SimulatedSupply;
using testing::HasSubstr;

struct Row {
  const char* name;
  Over wire;
  SupplyFaultKind kind;
  Duration delay;
  std::uint64_t Counters::*counted;  ///< nullptr: no fault for the driver
  const char* words;                 ///< in the failure when the fault stays
};

void PrintTo(const Row& row, std::ostream* out) { *out << row.name; }

sim::SupplyFault fault_of(const Row& row) {
  sim::SupplyFault fault;
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
  sim::SupplyFault fault = fault_of(GetParam());
  fault.count = 1;
  simulated.spoil(fault);
  EXPECT_EQ(supply.read().set_voltage_v, 12);
  const Counters counters = supply.counters();
  EXPECT_EQ(simulated.truth().faults, 1u);
  if (GetParam().counted == nullptr) {
    EXPECT_EQ(counters.retries, 0u);
  } else {
    EXPECT_GE(counters.*GetParam().counted, 1u);
    EXPECT_GE(counters.retries, 1u);
    EXPECT_LE(counters.retries, 2u);
    EXPECT_GE(counters.flushes, 2u) << "one when it was opened, one after the failure";
  }
}

TEST_P(SupplyMeets, ForEverAndSaysSo) {
  sim::SupplyFault fault = fault_of(GetParam());
  fault.lasts = 1h;
  simulated.spoil(fault);
  if (GetParam().counted == nullptr) {
    EXPECT_EQ(supply.read().set_voltage_v, 12);
    return;
  }
  try {
    (void)supply.read();
    ADD_FAILURE() << "it has read something";
  } catch (const DeviceError& error) {
    EXPECT_THAT(error.what(), HasSubstr(GetParam().words));
    EXPECT_THAT(error.what(), HasSubstr("supply RD6006 on "));
  }
}

constexpr Duration kNone{0};
INSTANTIATE_TEST_SUITE_P(
    Faults, SupplyMeets,
    testing::Values(Row{"BadCrc", Over::rtu, SupplyFaultKind::bad_crc, kNone, &Counters::damaged, "Invalid CRC"},
                    Row{"NoReply", Over::rtu, SupplyFaultKind::no_reply, kNone, &Counters::timeouts, "no answer"},
                    Row{"Deaf", Over::rtu, SupplyFaultKind::deaf, kNone, &Counters::timeouts, "no answer"},
                    Row{"Truncated", Over::rtu, SupplyFaultKind::truncated, kNone, &Counters::timeouts, "no answer"},
                    Row{"Dribble", Over::rtu, SupplyFaultKind::dribble, 300us, nullptr, ""},
                    Row{"Garbage", Over::rtu, SupplyFaultKind::garbage, kNone, &Counters::damaged, "damaged answer"},
                    Row{"WrongSlave", Over::rtu, SupplyFaultKind::wrong_slave, kNone, &Counters::damaged,
                        "damaged answer"},
                    Row{"Echo", Over::rtu, SupplyFaultKind::echo, kNone, &Counters::damaged, "damaged answer"},
                    Row{"Late", Over::rtu, SupplyFaultKind::late, 200ms, &Counters::timeouts, "no answer"},
                    Row{"NoReplyTcp", Over::tcp, SupplyFaultKind::no_reply, kNone, &Counters::timeouts, "no answer"},
                    Row{"TruncatedTcp", Over::tcp, SupplyFaultKind::truncated, kNone, &Counters::timeouts, "no answer"},
                    Row{"DribbleTcp", Over::tcp, SupplyFaultKind::dribble, 300us, nullptr, ""},
                    Row{"GarbageTcp", Over::tcp, SupplyFaultKind::garbage, kNone, &Counters::damaged, ""},
                    Row{"WrongTransactionTcp", Over::tcp, SupplyFaultKind::wrong_transaction, kNone, &Counters::damaged,
                        "damaged answer"},
                    Row{"LateTcp", Over::tcp, SupplyFaultKind::late, 200ms, &Counters::timeouts, "no answer"}),
    [](const auto& row) { return row.param.name; });

TEST(SupplyMeetsAnException, AndDoesNotAskAgain) {
  SteadyClock clock;
  SimulatedSupply simulated;
  ModbusSupply supply(simulated.address(), clock, kShort);
  simulated.spoil(lasting(SupplyFaultKind::exception));
  const std::uint64_t before = simulated.truth().requests;
  EXPECT_THROW((void)supply.read(), DeviceError);
  EXPECT_EQ(simulated.truth().requests - before, 1u);
  EXPECT_EQ(supply.counters().refused, 1u);
}

TEST(SupplyMeetsABusyDevice, AndAsksAgain) {
  SteadyClock clock;
  SimulatedSupply simulated;
  ModbusSupply supply(simulated.address(), clock, kShort);
  sim::SupplyFault busy;
  busy.kind = SupplyFaultKind::exception;
  busy.code = 6;
  busy.count = 2;
  simulated.spoil(busy);
  EXPECT_FALSE(supply.read().output);
  EXPECT_EQ(supply.counters().retries, 2u);
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
  sim::SupplyFault late;
  late.kind = SupplyFaultKind::late;
  late.count = 1;
  late.delay = kShort.answer + GetParam().after_the_deadline;
  simulated.spoil(late);
  sim::SupplyFault turned;
  turned.kind = SupplyFaultKind::panel;
  turned.at = kShort.answer / 2;
  turned.address = 8;
  turned.value = 1100;
  simulated.spoil(turned);
  EXPECT_EQ(supply.read().set_voltage_v, 11);
  EXPECT_EQ(supply.read().set_voltage_v, 11);
  EXPECT_GE(supply.counters().timeouts, 1u);
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
  for (const SupplyFaultKind kind :
       {SupplyFaultKind::bad_crc, SupplyFaultKind::no_reply, SupplyFaultKind::truncated, SupplyFaultKind::garbage,
        SupplyFaultKind::wrong_slave, SupplyFaultKind::echo, SupplyFaultKind::late}) {
    sim::SupplyFault fault;
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

}  // namespace
}  // namespace kphi::supply
