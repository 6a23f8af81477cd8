#include <gtest/gtest.h>

#include <string>

#include "test/drivers/sim/netbox/box.hpp"

namespace kphi::sim::cgi_test {

using test::box_that;

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
  write("setting.cgi?setuserfilter=5&setcfgsel=3");
  EXPECT_EQ(element(box, "setuserfilter"), "5");
  EXPECT_EQ(element(box, "setcfgsel"), "3");
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
  write("setting.cgi");
  EXPECT_EQ(get(box, "netftapi2.xml"), before);
}

TEST_F(NetBoxWrites, BelongToTheirPage) {
  const std::string before = get(box, "netftapi2.xml");
  write("setting.cgi?comrdtrate=100");
  write("comm.cgi?setuserfilter=3&setcfgsel=3");
  EXPECT_EQ(get(box, "netftapi2.xml"), before);
}

TEST_F(NetBoxWrites, DoNotReachTheNetwork) {
  write("comm.cgi?comnetip=10.0.0.1&comnetdhcp=1&comnetgw=1.1.1.1&comnetmsk=0.0.0.0");
  EXPECT_EQ(element(box, "comnetip"), "127.0.0.1");
  EXPECT_EQ(element(box, "comnetdhcp"), "Disabled");
}

TEST_F(NetBoxWrites, AnEmptyCalibrationMeasuresNothing) {
  write("setting.cgi?setcfgsel=3");
  EXPECT_EQ(element(box, "cfgcalsn"), "FT0000");
  EXPECT_EQ(element(box, "cfgmr"), "0;0;0;0;0;0");
  box.sample({Instant{0}, {1, 2, 3, 0, 0, 0}});
  EXPECT_EQ(box.signal().counts()[2], 0);
}

TEST_F(NetBoxWrites, OfTheRateStopARunningStream) {
  box.receive(test::kRealTime, 1);
  ASSERT_TRUE(box.streaming());
  write("comm.cgi?comrdtrate=7000");
  EXPECT_TRUE(box.streaming()) << "nothing changed";
  write("comm.cgi?comrdtrate=1000");
  EXPECT_FALSE(box.streaming());
}

TEST_F(NetBoxWrites, OfTheRateMayAlsoGoOnAtTheNewStride) {
  box = box_that([](NetBoxSettings& s) { s.quirks.rate_write = NetBoxQuirks::RateWrite::continues; });
  box.receive(test::kRealTime, 1);
  write("comm.cgi?comrdtrate=1000");
  test::after(box, 70);
  EXPECT_EQ(box.records_sent(), 10u);
}

TEST_F(NetBoxWrites, BeyondThreeInASecondAreLostOnSomeBoxes) {
  box = box_that([](NetBoxSettings& s) { s.quirks.only_three_writes = true; });
  for (const int rate : {1000, 500, 100, 70}) (void)get(box, "comm.cgi?comrdtrate=" + std::to_string(rate));
  EXPECT_EQ(element(box, "comrdtrate"), "100");
  test::after(box, 7000);
  (void)get(box, "comm.cgi?comrdtrate=70");
  EXPECT_EQ(element(box, "comrdtrate"), "70");
}

TEST_F(NetBoxWrites, AndPagesBeyondThreeInASecondAreRefusedOnOthers) {
  using Served = NetBoxQuirks::Served;
  const auto serves_three_then = [&](const char* beyond) {
    const auto ask = [&] { return box.http("GET /netftapi2.xml HTTP/1.0"); };
    for (int i = 0; i < 3; ++i) EXPECT_TRUE(ask().starts_with("HTTP/1.0 200"));
    EXPECT_EQ(ask().substr(0, 12), beyond);
    test::after(box, 7000);
    EXPECT_TRUE(ask().starts_with("HTTP/1.0 200"));
  };
  box = box_that([](NetBoxSettings& s) { s.quirks.served = Served::three_then_closed; });
  serves_three_then("");
  box = box_that([](NetBoxSettings& s) { s.quirks.served = Served::three_then_503; });
  serves_three_then("HTTP/1.0 503");
}

}  // namespace kphi::sim::cgi_test
