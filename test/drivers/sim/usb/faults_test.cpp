#include "drivers/sim/usb/faults.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include "base/random.hpp"

namespace kphi::sim {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

FaultEntry entry(const std::string& yaml) { return YAML::Load(yaml).as<FaultEntry>(); }

std::string refusal(const std::string& yaml) {
  try {
    (void)ambient_faults().read(entry(yaml));
  } catch (const FaultEntryError& error) {
    return error.key + ": " + error.what();
  }
  return "";
}

TEST(UsbFaults, AreWrittenAsThoseOfOtherDevices) {
  const UsbFault late = ambient_faults().read(entry("{at_s: 2, count: 3, kind: ambient_late, delay_s: 0.55}"));
  EXPECT_EQ(late.kind, UsbFaultKind::late);
  EXPECT_EQ(late.at, 2s);
  EXPECT_EQ(late.count, 3u);
  EXPECT_EQ(late.delay, 550ms);
  const UsbFault byte =
      ambient_faults().read(entry("{at_s: 0, for_s: 1, kind: ambient_reads_as, register: 137, value: 106}"));
  EXPECT_EQ(byte.address, 137);
  EXPECT_EQ(byte.value, 106);
  EXPECT_EQ(byte.end(), 1s);
}

TEST(UsbFaults, RefuseWhatTheyDoNotKnow) {
  EXPECT_THAT(refusal("{at_s: 0, kind: ambient_nak}"), HasSubstr("known: ambient_unplug, ambient_no_reply"));
  EXPECT_THAT(refusal("{at_s: 0, kind: ambient_unplug}"), HasSubstr("ambient_unplug needs for_s"));
  EXPECT_THAT(refusal("{at_s: 0, kind: ambient_nack}"), HasSubstr("needs for_s or count"));
  EXPECT_THAT(refusal("{count: 1, kind: ambient_nack}"), HasSubstr("ambient_nack needs at_s"));
  EXPECT_THAT(refusal("{at_s: 0, count: 1, kind: ambient_nack, delay_s: 1}"),
              HasSubstr("ambient_nack has no key \"delay_s\""));
  EXPECT_THAT(refusal("{at_s: 0, count: 1, kind: ambient_reads_as, register: 256, value: 0}"),
              HasSubstr("outside 0 to 255"));
  EXPECT_THAT(refusal("{at_s: 0, count: 1.5, kind: ambient_nack}"), HasSubstr("not a whole number"));
  EXPECT_THAT(refusal("{at_s: now, count: 1, kind: ambient_nack}"), HasSubstr("\"now\" is not a number"));
}

TEST(UsbFaults, StrikeInTheirWindowAndSoManyTimes) {
  ManualClock clock;
  UsbFaults faults(clock, {UsbFault{{UsbFaultKind::nack, 1s, 1s, 0}}, UsbFault{{UsbFaultKind::busy, 0s, 0s, 2}}});
  EXPECT_FALSE(faults.strikes(UsbFaultKind::nack));
  EXPECT_TRUE(faults.strikes(UsbFaultKind::busy));
  EXPECT_TRUE(faults.active(UsbFaultKind::busy)) << "looking does not count";
  EXPECT_TRUE(faults.strikes(UsbFaultKind::busy));
  EXPECT_FALSE(faults.strikes(UsbFaultKind::busy));
  clock.set(1s);
  EXPECT_TRUE(faults.strikes(UsbFaultKind::nack));
  clock.set(2s);
  EXPECT_FALSE(faults.strikes(UsbFaultKind::nack));
}

TEST(UsbFaults, AreReadOrRefusedWhateverIsWritten) {
  Random random(1);
  const std::vector<std::string> keys{"kind", "at_s", "for_s", "count", "delay_s", "size", "register", "value", "p"};
  const std::vector<std::string> values{"ambient_nack",
                                        "ambient_late",
                                        "ambient_unplug",
                                        "ambient_reads_as",
                                        "ambient_busy",
                                        "0",
                                        "1",
                                        "-1",
                                        "1e9",
                                        "1e999",
                                        "nan",
                                        "",
                                        "0x10",
                                        "3.5"};
  int read = 0;
  for (int i = 0; i < 100'000; ++i) {
    FaultEntry fault{{"at_s", "1"}, {"kind", values[random.bits() % 5]}};
    for (std::uint64_t n = random.bits() % 6; n > 0; --n)
      fault[keys[random.bits() % keys.size()]] = values[random.bits() % values.size()];
    try {
      const UsbFault got = ambient_faults().read(fault);
      ++read;
      ASSERT_GE(got.at, 0s);
      ASSERT_EQ(ambient_faults().name_of(got.kind), fault["kind"]);
    } catch (const FaultEntryError&) {
    }
  }
  EXPECT_GT(read, 100);
}

}  // namespace
}  // namespace kphi::sim
