#include "drivers/sim/supply_faults.hpp"

#include <gtest/gtest.h>

namespace kphi::sim {
namespace {

using namespace std::chrono_literals;

std::string refusal(const FaultEntry& entry) {
  try {
    (void)supply_fault_of(entry);
  } catch (const FaultEntryError& error) {
    return error.key + ": " + error.what();
  }
  return "accepted";
}

TEST(SupplyFaults, AreReadFromAnEntry) {
  const SupplyFault late = supply_fault_of({{"kind", "late"}, {"at_s", "1.5"}, {"for_s", "2"}, {"delay_s", "0.55"}});
  EXPECT_EQ(late.kind, SupplyFaultKind::late);
  EXPECT_EQ(late.at, 1500ms);
  EXPECT_EQ(late.end(), 3500ms);
  EXPECT_EQ(late.delay, 550ms);
  const SupplyFault panel = supply_fault_of({{"kind", "panel"}, {"at_s", "1"}, {"register", "8"}, {"value", "1100"}});
  EXPECT_EQ(panel.address, 8);
  EXPECT_EQ(panel.value, 1100);
  const SupplyFault crc = supply_fault_of({{"kind", "bad_crc"}, {"at_s", "0"}, {"count", "3"}, {"p", "0.5"}});
  EXPECT_EQ(crc.count, 3u);
  EXPECT_EQ(crc.p, 0.5);
  EXPECT_EQ(crc.end(), kNever);
}

TEST(SupplyFaults, OfEveryKindHaveAName) {
  for (const char* name : {"bad_crc", "no_reply", "deaf", "truncated", "garbage", "wrong_slave", "wrong_transaction",
                           "echo", "exception", "ignored_writes"}) {
    const SupplyFault fault = supply_fault_of({{"kind", name}, {"at_s", "0"}, {"count", "1"}});
    EXPECT_EQ(name_of(fault.kind), name);
  }
}

TEST(SupplyFaults, AreStrict) {
  EXPECT_EQ(refusal({{"at_s", "0"}}), ": the kind is missing");
  EXPECT_EQ(refusal({{"kind", "bad_crc"}, {"at_s", "0"}}), ": bad_crc needs for_s or count");
  EXPECT_EQ(refusal({{"kind", "bad_crc"}, {"count", "1"}}), ": bad_crc needs at_s");
  EXPECT_EQ(refusal({{"kind", "closed"}, {"at_s", "0"}, {"count", "1"}}), "count: closed has no 'count'");
  EXPECT_EQ(refusal({{"kind", "late"}, {"at_s", "0"}, {"count", "1"}}), ": late needs delay_s");
  EXPECT_EQ(refusal({{"kind", "trip"}, {"at_s", "0"}, {"code", "6"}}), "code: 6 is outside 1 to 5");
  EXPECT_EQ(refusal({{"kind", "trip"}, {"at_s", "0"}, {"code", "1.5"}}), "code: 1.5 is not whole");
  EXPECT_EQ(refusal({{"kind", "trip"}, {"at_s", "x"}, {"code", "1"}}), "at_s: 'x' is no number");
  EXPECT_EQ(refusal({{"kind", "trip"}, {"at_s", "nan"}, {"code", "1"}}), "at_s: nan is outside 0 to 1000000");
  EXPECT_NE(refusal({{"kind", "loss"}, {"at_s", "0"}, {"count", "1"}}).find("no fault of the supply is called 'loss'"),
            std::string::npos);
}

}  // namespace
}  // namespace kphi::sim
