#include "drivers/sim/supply/faults.hpp"

#include <gtest/gtest.h>

#include "drivers/sim/input_files.hpp"

namespace kphi::sim {
namespace {

using namespace std::chrono_literals;

std::string refusal(const FaultEntry& entry) {
  try {
    (void)supply_faults().read(entry);
  } catch (const FaultEntryError& error) {
    return error.key + ": " + error.what();
  }
  return "accepted";
}

TEST(SupplyFaults, AreReadFromAnEntry) {
  const SupplyFault late =
      supply_faults().read({{"kind", "supply_late"}, {"at_s", "1.5"}, {"for_s", "2"}, {"delay_s", "0.55"}});
  EXPECT_EQ(late.kind, SupplyFaultKind::late);
  EXPECT_EQ(late.at, 1500ms);
  EXPECT_EQ(late.end(), 3500ms);
  EXPECT_EQ(late.delay, 550ms);
  const SupplyFault panel =
      supply_faults().read({{"kind", "supply_panel"}, {"at_s", "1"}, {"register", "8"}, {"value", "1100"}});
  EXPECT_EQ(panel.address, 8);
  EXPECT_EQ(panel.value, 1100);
  const SupplyFault crc =
      supply_faults().read({{"kind", "supply_bad_crc"}, {"at_s", "0"}, {"count", "3"}, {"p", "0.5"}});
  EXPECT_EQ(crc.count, 3u);
  EXPECT_EQ(crc.p, 0.5);
  EXPECT_EQ(crc.end(), kNever);
  EXPECT_EQ(supply_faults().read({{"kind", "supply_sag"}, {"at_s", "1"}, {"for_s", "1"}, {"volts", "4.5"}}).volts, 4.5);
}

TEST(SupplyFaults, OfEveryKindHaveAName) {
  for (const char* name :
       {"supply_bad_crc", "supply_no_reply", "supply_deaf", "supply_truncated", "supply_garbage", "supply_wrong_slave",
        "supply_wrong_transaction", "supply_echo", "supply_exception", "supply_ignored_writes"}) {
    const SupplyFault fault = supply_faults().read({{"kind", name}, {"at_s", "0"}, {"count", "1"}});
    EXPECT_EQ(supply_faults().name_of(fault.kind), name);
  }
}

TEST(SupplyFaults, AreStrict) {
  EXPECT_EQ(refusal({{"at_s", "0"}}), ": no kind given");
  EXPECT_EQ(refusal({{"kind", "supply_bad_crc"}, {"at_s", "0"}}), ": supply_bad_crc needs for_s or count");
  EXPECT_EQ(refusal({{"kind", "supply_bad_crc"}, {"count", "1"}}), ": supply_bad_crc needs at_s");
  EXPECT_EQ(refusal({{"kind", "supply_closed"}, {"at_s", "0"}, {"count", "1"}}),
            "count: supply_closed has no key \"count\"");
  EXPECT_EQ(refusal({{"kind", "supply_late"}, {"at_s", "0"}, {"count", "1"}}), ": supply_late needs delay_s");
  EXPECT_EQ(refusal({{"kind", "supply_trip"}, {"at_s", "0"}, {"code", "6"}}), "code: 6 is outside 1 to 5");
  EXPECT_EQ(refusal({{"kind", "supply_trip"}, {"at_s", "0"}, {"code", "1.5"}}), "code: 1.5 is not a whole number");
  EXPECT_EQ(refusal({{"kind", "supply_trip"}, {"at_s", "x"}, {"code", "1"}}), "at_s: \"x\" is not a number");
  EXPECT_EQ(refusal({{"kind", "supply_trip"}, {"at_s", "nan"}, {"code", "1"}}), "at_s: \"nan\" is not a number");
  EXPECT_NE(refusal({{"kind", "loss"}, {"at_s", "0"}, {"count", "1"}}).find("unknown fault \"loss\" of the supply"),
            std::string::npos);
}

TEST(SupplyFaults, StandInOneScriptWithThoseOfTheOtherDevices) {
  const std::string text =
      "format: kphi-faults/1\nfaults:\n"
      "  - {at_s: 1, kind: reboot, down_s: 1}\n"
      "  - {at_s: 2, kind: supply_trip, code: 2}\n"
      "  - {at_s: 3, kind: motor_locked, for_s: 1}\n"
      "  - {at_s: 4, kind: ambient_nack, count: 2}\n";
  const FaultFile file = parse_faults(text, "f.yaml");
  EXPECT_EQ(file.load_cell.size(), 1u);
  EXPECT_EQ(file.motor.size(), 1u);
  ASSERT_EQ(file.air.size(), 1u);
  EXPECT_EQ(file.air[0].kind, UsbFaultKind::nack);
  const SupplyFaultScript& script = file.supply;
  ASSERT_EQ(script.size(), 1u);
  EXPECT_EQ(script[0].kind, SupplyFaultKind::trip);
  EXPECT_EQ(script[0].code, 2);
}

}  // namespace
}  // namespace kphi::sim
