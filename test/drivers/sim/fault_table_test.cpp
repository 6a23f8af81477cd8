#include "drivers/sim/fault_table.hpp"

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

using P = FaultParameter<Trouble>;
using E = FaultExtent;

const FaultTable<Trouble>& table() {
  static const FaultTable<Trouble> all(
      "a lamp", {{Trouble::Kind::blink, "blink", E::window_or_count, {}},
                 {Trouble::Kind::dark, "dark", E::window, {}},
                 {Trouble::Kind::dim,
                  "dim",
                  E::window_or_forever,
                  {{"level", P::into<&Trouble::level>, 0, 1, false, true}, {"fade_s", P::into<&Trouble::fade>, 0, 10}},
                  {.fade = 2s}},
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
  EXPECT_EQ(refusal({{"kind", "dark"}, {"at_s", "0"}, {"count", "2"}}), "count: dark has no 'count'");
  EXPECT_EQ(refusal({{"kind", "dark"}, {"at_s", "0"}}), ": dark needs for_s");
  EXPECT_EQ(refusal({{"kind", "off"}, {"at_s", "0"}, {"for_s", "2"}}), "for_s: off has no 'for_s'");
  EXPECT_EQ(refusal({{"kind", "dim"}, {"at_s", "0"}, {"level", "0"}}), "accepted");
}

TEST(FaultTable, NamesTheKeyThatIsWrong) {
  EXPECT_EQ(refusal({{"at_s", "0"}}), ": the kind is missing");
  EXPECT_EQ(refusal({{"kind", "burn"}, {"at_s", "0"}}),
            "kind: no fault of a lamp is called 'burn'; there are blink, dark, dim, off");
  EXPECT_EQ(refusal({{"kind", "off"}}), ": off needs at_s");
  EXPECT_EQ(refusal({{"kind", "dim"}, {"at_s", "0"}}), ": dim needs level");
  EXPECT_EQ(refusal({{"kind", "dim"}, {"at_s", "0"}, {"level", "2"}}), "level: 2 is outside 0 to 1");
  EXPECT_EQ(refusal({{"kind", "off"}, {"at_s", "0"}, {"level", "1"}}), "level: off has no 'level'");
  EXPECT_EQ(refusal({{"kind", "blink"}, {"at_s", "0"}, {"count", "1.5"}}), "count: 1.5 is not whole");
}

TEST(FaultTable, KnowsItsKindsAndTheirNames) {
  for (const Trouble::Kind kind : table().kinds()) EXPECT_NE(table().name_of(kind), "?");
  EXPECT_EQ(table().kinds().size(), 4u);
  EXPECT_EQ(table().name_of(Trouble::Kind::none), "?");
}

}  // namespace
}  // namespace kphi::sim
