#include "drivers/sim/script/fault_table.hpp"

#include <gtest/gtest.h>

namespace kphi::sim {
namespace {

using namespace std::chrono_literals;

struct Trouble {
  enum class Kind { none, blink, dark, dim, off } kind = Kind::none;
  Instant at{0};
  Duration lasts{0};
  std::uint64_t count = 0;
  double level = 1;
  Duration fade{0};
};

using E = FaultExtent;

const FaultTable<Trouble>& table() {
  static const FaultTable<Trouble> all(
      "a lamp", {{Trouble::Kind::blink, "blink", E::window_or_count, {}},
                 {Trouble::Kind::dark, "dark", E::window, {}},
                 {Trouble::Kind::dim,
                  "dim",
                  E::window_or_forever,
                  {required<&Trouble::level>("level"), key<&Trouble::fade>("fade_s", 0, 10, "2")}},
                 {Trouble::Kind::off, "off", E::instant, {}}});
  return all;
}

std::string refusal(const FaultEntry& entry) {
  try {
    (void)table().read(entry);
  } catch (const FaultEntryError& error) {
    return error.key + ": " + error.what();
  }
  return "accepted";
}

TEST(FaultTable, ReadsNumbersTimesAndWhatIsUsualWhereTheScriptIsSilent) {
  const Trouble usual = table().read({{"kind", "dim"}, {"at_s", "1.5"}, {"level", "0.25"}});
  EXPECT_EQ(usual.kind, Trouble::Kind::dim);
  EXPECT_EQ(usual.at, 1500ms);
  EXPECT_EQ(usual.level, 0.25);
  EXPECT_EQ(usual.fade, 2s);
  EXPECT_EQ(table().read({{"kind", "dim"}, {"at_s", "0"}, {"level", "1"}, {"fade_s", "0.5"}}).fade, 500ms);
}

TEST(FaultTable, KnowsHowLongEachKindMayGoOn) {
  EXPECT_EQ(refusal({{"kind", "blink"}, {"at_s", "0"}}), ": blink needs for_s or count");
  EXPECT_EQ(refusal({{"kind", "blink"}, {"at_s", "0"}, {"count", "2"}}), "accepted");
  EXPECT_EQ(refusal({{"kind", "dark"}, {"at_s", "0"}, {"count", "2"}}), "count: dark has no key \"count\"");
  EXPECT_EQ(refusal({{"kind", "dark"}, {"at_s", "0"}}), ": dark needs for_s");
  EXPECT_EQ(refusal({{"kind", "off"}, {"at_s", "0"}, {"for_s", "2"}}), "for_s: off has no key \"for_s\"");
  EXPECT_EQ(refusal({{"kind", "dim"}, {"at_s", "0"}, {"level", "0"}}), "accepted");
}

TEST(FaultTable, NamesTheKeyThatIsWrong) {
  EXPECT_EQ(refusal({{"at_s", "0"}}), ": no kind given");
  EXPECT_EQ(refusal({{"kind", "burn"}, {"at_s", "0"}}),
            "kind: unknown fault \"burn\" of a lamp; known: blink, dark, dim, off");
  EXPECT_EQ(refusal({{"kind", "off"}}), ": off needs at_s");
  EXPECT_EQ(refusal({{"kind", "dim"}, {"at_s", "0"}}), ": dim needs level");
  EXPECT_EQ(refusal({{"kind", "dim"}, {"at_s", "0"}, {"level", "2"}}), "level: 2 is outside 0 to 1");
  EXPECT_EQ(refusal({{"kind", "off"}, {"at_s", "0"}, {"level", "1"}}), "level: off has no key \"level\"");
  EXPECT_EQ(refusal({{"kind", "blink"}, {"at_s", "0"}, {"count", "1.5"}}), "count: 1.5 is not a whole number");
}

TEST(FaultTable, KnowsTheNamesOfItsKinds) {
  for (const auto& row : table().rows()) EXPECT_EQ(table().name_of(row.kind), row.name);
  EXPECT_EQ(table().rows().size(), 4u);
  EXPECT_EQ(table().name_of(Trouble::Kind::none), "?");
}

TEST(FaultNumbers, AreDecimalHexadecimalOrTruthValues) {
  EXPECT_EQ(fault_number("p", "0.25"), 0.25);
  EXPECT_EQ(fault_number("p", "-1e3"), -1000);
  EXPECT_EQ(fault_number("p", "0x1F"), 31);
  EXPECT_EQ(fault_number("p", "true"), 1);
  EXPECT_EQ(fault_number("p", "false"), 0);
}

TEST(FaultNumbers, NameTheKeyOfWhatIsNotOne) {
  for (const char* text : {"", "x", "1 s", "0x", "0xG", "nan", "inf", "1,5", "+1"}) {
    try {
      (void)fault_number("delay_s", text);
      ADD_FAILURE() << text;
    } catch (const FaultEntryError& error) {
      EXPECT_EQ(error.key, "delay_s") << text;
    }
  }
}

TEST(FaultNumbers, HaveClosedRangesAndMayBeWhole) {
  EXPECT_EQ(fault_number("n", "1", {1, 5, true}), 1);
  EXPECT_EQ(fault_number("n", "5", {1, 5, true}), 5);
  EXPECT_EQ(fault_number("n", "1.5", {1, 5, false}), 1.5);
  EXPECT_THROW((void)fault_number("n", "1.5", {1, 5, true}), FaultEntryError);
  EXPECT_THROW((void)fault_number("n", "0", {1, 5, false}), FaultEntryError);
  EXPECT_THROW((void)fault_number("n", "6", {1, 5, false}), FaultEntryError);
}

TEST(ScriptedFaults, ActInTheirWindowAndThatManyTimes) {
  ScriptedFault<int> fault{0, 1s, 2s, 3};
  EXPECT_FALSE(fault.active(999ms));
  EXPECT_TRUE(fault.active(1s, 2));
  EXPECT_FALSE(fault.active(1s, 3));
  EXPECT_FALSE(fault.active(3s)) << "the end is open";
  fault.lasts = 0s;
  EXPECT_TRUE(fault.active(1000s));
  EXPECT_EQ(fault.end(), kNever);
}

}  // namespace
}  // namespace kphi::sim
