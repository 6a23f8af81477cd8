#include <gtest/gtest.h>

#include <string>

#include "drivers/sim/netbox/device.hpp"
#include "test/drivers/sim/hex.hpp"

namespace kphi::sim {
namespace {

using test::bytes;

std::string get(NetBoxDevice& box, const std::string& target) {
  return box.http("GET /" + target + " HTTP/1.0\r\nHost: box");
}

std::string element(NetBoxDevice& box, const std::string& name, const std::string& page = "netftapi2.xml") {
  const std::string text = get(box, page);
  const auto begin = text.find("<" + name + ">") + name.size() + 2;
  return text.substr(begin, text.find("</" + name + ">") - begin);
}

struct NetBoxWrites : ::testing::Test {
  void write(const std::string& target) { EXPECT_EQ(get(box, target).substr(0, 18), "HTTP/1.0 302 Found") << target; }
  NetBoxDevice box{NetBoxSettings{}};
};

TEST_F(NetBoxWrites, AreAnsweredByARedirectionAndShowInTheXml) {
  write("setting.cgi?setuserfilter=5&setpke=0&setbias3=-42");
  EXPECT_EQ(element(box, "setuserfilter"), "5");
  EXPECT_EQ(element(box, "setpke"), "0");
  EXPECT_EQ(element(box, "setbias"), "0;0;0;-42;0;0");
}

TEST_F(NetBoxWrites, AreQuantisedAndClampedInSilence) {
  write("comm.cgi?comrdtrate=150&comrdtbsiz=99");
  EXPECT_EQ(element(box, "comrdtrate"), "152");
  EXPECT_EQ(element(box, "comrdtbsiz"), "40");
  write("comm.cgi?comrdtrate=99999");
  EXPECT_EQ(element(box, "comrdtrate"), "7000");
  write("setting.cgi?setuserfilter=77&setcfgsel=-3");
  EXPECT_EQ(element(box, "setuserfilter"), "12");
  EXPECT_EQ(element(box, "setcfgsel"), "0");
}

TEST_F(NetBoxWrites, IgnoreNonsenseInSilence) {
  const std::string before = get(box, "netftapi2.xml");
  write("comm.cgi?comrdtrate=fast&comrdtbsiz=&&=&novalue&comrdtrate");
  write("comm.cgi?comrdtrate=100.00000000000000000");  // 21 characters
  write("setting.cgi?setbias6=1&setbias=1&setbiasx=1");
  write("setting.cgi");
  EXPECT_EQ(get(box, "netftapi2.xml"), before);
}

TEST_F(NetBoxWrites, BelongToTheirPage) {
  const std::string before = get(box, "netftapi2.xml");
  write("setting.cgi?comrdtrate=100&setmce=1");
  write("comm.cgi?setuserfilter=3&cfgnam=x");
  write("config.cgi?cfgnam=without_a_slot");
  EXPECT_EQ(get(box, "netftapi2.xml"), before);
}

TEST_F(NetBoxWrites, DoNotReachTheNetwork) {
  write("comm.cgi?comnetip=10.0.0.1&comnetdhcp=1&comnetgw=1.1.1.1&comnetmsk=0.0.0.0");
  EXPECT_EQ(element(box, "comnetip"), "127.0.0.1");
  EXPECT_EQ(element(box, "comnetdhcp"), "Disabled");
}

TEST_F(NetBoxWrites, GoToTheSlotThatIsNamed) {
  write(
      "config.cgi?cfgid=15&cfgnam=a%26b%20c&cfgcalsel=0&cfgfu=1&cfgtu=2&cfgtfx2=132.71&cfgtdu=1&cfgusra="
      "1234567890123456789");
  const std::string slot = "netftapi2.xml?index=15";
  EXPECT_EQ(element(box, "cfgnam", slot), "a&amp;b c");
  EXPECT_EQ(element(box, "scfgfu", slot), "lbf");
  EXPECT_EQ(element(box, "scfgtu", slot), "lbf-ft");
  EXPECT_EQ(element(box, "cfgcpf", slot), "1") << "as seen on a real box: 1 000 000 for N, 1 for lbf";
  EXPECT_EQ(element(box, "cfgtfx", slot), "0;0;132.71;0;0;0");
  EXPECT_EQ(element(box, "scfgtdu", slot), "in");
  EXPECT_EQ(element(box, "cfgusra", slot), "1234567890123456");
  EXPECT_EQ(element(box, "cfgcpf"), "1000000") << "the active slot is another";
  write("setting.cgi?setcfgsel=15");
  EXPECT_EQ(element(box, "scfgfu"), "lbf");
}

TEST_F(NetBoxWrites, AnEmptyCalibrationMeasuresNothing) {
  write("setting.cgi?setcfgsel=3");
  EXPECT_EQ(element(box, "cfgcalsn"), "FT0000");
  EXPECT_EQ(element(box, "cfgmr"), "0;0;0;0;0;0");
  box.sample({Instant{0}, {1, 2, 3, 0, 0, 0}});
  EXPECT_EQ(box.signal().counts()[2], 0);
}

TEST_F(NetBoxWrites, OfTheRateStopARunningStream) {
  box.receive(bytes("12 34 00 02 00 00 00 00"), 1);
  ASSERT_TRUE(box.streaming());
  write("comm.cgi?comrdtrate=7000");
  EXPECT_TRUE(box.streaming()) << "nothing changed";
  write("comm.cgi?comrdtrate=1000");
  EXPECT_FALSE(box.streaming());
}

TEST_F(NetBoxWrites, OfTheRateMayAlsoGoOnAtTheNewStride) {
  NetBoxSettings settings;
  settings.quirks.rate_write = NetBoxQuirks::RateWrite::continues;
  NetBoxDevice other(settings);
  other.receive(bytes("12 34 00 02 00 00 00 00"), 1);
  (void)get(other, "comm.cgi?comrdtrate=1000");
  for (int i = 0; i < 70; ++i) other.sample({Instant(i), {}});
  EXPECT_EQ(other.records_sent(), 10u);
}

TEST_F(NetBoxWrites, OfRdtDisabledEndAllStreams) {
  box.receive(bytes("12 34 00 02 00 00 00 00"), 1);
  write("comm.cgi?comrdte=0");
  EXPECT_EQ(element(box, "comrdte"), "Disabled");
  EXPECT_FALSE(box.streaming());
  box.receive(bytes("12 34 00 02 00 00 00 00"), 1);
  EXPECT_FALSE(box.streaming());
}

TEST_F(NetBoxWrites, BeyondThreeInASecondAreLostOnSomeBoxes) {
  NetBoxSettings settings;
  settings.quirks.only_three_writes = true;
  NetBoxDevice strict(settings);
  for (int i = 0; i < 6; ++i) (void)get(strict, "setting.cgi?setbias" + std::to_string(i) + "=7");
  EXPECT_EQ(element(strict, "setbias"), "7;7;7;0;0;0");
  for (int i = 0; i < 7000; ++i) strict.sample({Instant(i), {}});
  (void)get(strict, "setting.cgi?setbias5=7");
  EXPECT_EQ(element(strict, "setbias"), "7;7;7;0;0;7");
}

TEST_F(NetBoxWrites, ProgramMonitorConditions) {
  write("moncon.cgi?setmce=1&mce2=1&mcx2=2&mcc2=1&mcv2=1000000&mco2=0x12");
  EXPECT_EQ(element(box, "mcx"), "-1;-1;2;-1;-1;-1;-1;-1;-1;-1;-1;-1;-1;-1;-1;-1");
  box.sample({Instant{0}, {0, 0, 1, 0, 0, 0}});
  EXPECT_EQ(box.status(), 0u);
  box.sample({Instant{1}, {0, 0, 1.000001, 0, 0, 0}});
  EXPECT_EQ(box.status(), 0x80010000u);
  box.sample({Instant{2}, {}});
  EXPECT_EQ(box.status(), 0x80010000u) << "latched";
  EXPECT_EQ(element(box, "runmcb"), "0x00000004");
  EXPECT_EQ(element(box, "runmco"), "0x12");
  EXPECT_EQ(element(box, "runmcl"), "1");
  box.receive(bytes("12 34 00 41 00 00 00 00"), 1);
  box.sample({Instant{3}, {}});
  EXPECT_EQ(box.status(), 0u);
}

}  // namespace
}  // namespace kphi::sim
