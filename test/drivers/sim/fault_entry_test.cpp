#include "drivers/sim/fault_entry.hpp"

#include <gtest/gtest.h>

namespace kphi::sim {
namespace {

TEST(FaultEntries, NumbersAreDecimalHexadecimalOrTruthValues) {
  EXPECT_EQ(fault_number("p", "0.25"), 0.25);
  EXPECT_EQ(fault_number("p", "-1e3"), -1000);
  EXPECT_EQ(fault_number("p", "0x1F"), 31);
  EXPECT_EQ(fault_number("p", "true"), 1);
  EXPECT_EQ(fault_number("p", "false"), 0);
}

TEST(FaultEntries, WhatIsNoNumberNamesItsKey) {
  for (const char* text : {"", "x", "1 s", "0x", "0xG", "nan", "inf", "1,5", "+1"}) {
    try {
      (void)fault_number("delay_s", text);
      ADD_FAILURE() << text;
    } catch (const FaultEntryError& error) {
      EXPECT_EQ(error.key, "delay_s") << text;
    }
  }
}

TEST(FaultEntries, RangesAreClosedAndMayBeWhole) {
  EXPECT_EQ(fault_number("n", "1", {1, 5, true}), 1);
  EXPECT_EQ(fault_number("n", "5", {1, 5, true}), 5);
  EXPECT_EQ(fault_number("n", "1.5", {1, 5, false}), 1.5);
  EXPECT_THROW((void)fault_number("n", "1.5", {1, 5, true}), FaultEntryError);
  EXPECT_THROW((void)fault_number("n", "0", {1, 5, false}), FaultEntryError);
  EXPECT_THROW((void)fault_number("n", "6", {1, 5, false}), FaultEntryError);
}

TEST(FaultEntries, HaveAKind) {
  EXPECT_EQ(kind_of({{"kind", "loss"}}), "loss");
  EXPECT_THROW((void)kind_of({{"p", "1"}}), FaultEntryError);
}

}  // namespace
}  // namespace kphi::sim
