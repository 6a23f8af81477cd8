// The open questions of the box: each switch both ways.
#include <gmock/gmock.h>

#include "test/drivers/sim/netbox/box.hpp"

namespace kphi::sim::quirks_test {

using namespace test;
using testing::AllOf;
using testing::HasSubstr;
using LastBlock = NetBoxQuirks::LastBlock;

std::string page_of(NetBoxDevice& box) { return box.http("GET /netftapi2.xml HTTP/1.0"); }

constexpr Wrench kOneNewton{0, 0, 1, 0, 0, 0};

std::size_t records_of_fifty(LastBlock habit) {
  NetBoxSettings settings;
  settings.quirks.last_block = habit;
  NetBoxDevice box(settings);
  box.receive(bytes("12 34 00 03 00 00 00 32"), 1);
  std::size_t records = 0;
  for (const Datagram& d : after(box, 500, kOneNewton)) records += d.size / 36;
  EXPECT_FALSE(box.streaming());
  return records;
}

TEST(NetBoxQuirks, BiasMayStopTheStream) {
  NetBoxDevice box = box_that([](NetBoxSettings& s) { s.quirks.bias_stops_stream = true; });
  box.receive(kRealTime, 1);
  box.receive(kBias, 1);
  EXPECT_FALSE(box.streaming());
}

TEST(NetBoxQuirks, LastBlockIsPartialPaddedOrDropped) {
  EXPECT_EQ(records_of_fifty(LastBlock::partial), 50u);
  EXPECT_EQ(records_of_fifty(LastBlock::padded), 80u);
  EXPECT_EQ(records_of_fifty(LastBlock::dropped), 40u);
}

TEST(NetBoxQuirks, AnAxiaHasOtherCommandsAndBits) {
  NetBoxDevice box = box_that([](NetBoxSettings& s) { s.quirks.axia = true; });
  box.receive(bytes("12 34 00 03 00 00 00 00"), 1);
  EXPECT_FALSE(box.streaming());
  box.receive(bytes("12 34 00 01 00 00 00 00"), 1);
  EXPECT_EQ(after(box, 40, kOneNewton).size(), 40u);
  box.receive(kRealTime, 1);
  EXPECT_EQ(after(box, 40, kOneNewton).size(), 1u) << "multi-block";
  box.sample({Instant{0}, {0, 0, 99, 0, 0, 0}});
  EXPECT_EQ(box.status(), 0xc0000000u);
  EXPECT_THAT(page_of(box), HasSubstr("<prodname>Ethernet Axia</prodname>"));
}

TEST(NetBoxQuirks, XmlMaySpellTheTorqueOtherwise) {
  NetBoxDevice box = box_that([](NetBoxSettings& s) { s.quirks.torque_text_with_hyphen = true; });
  after(box, 1, kOneNewton);
  box.receive(kBias, 1);
  EXPECT_THAT(page_of(box), AllOf(HasSubstr("<scfgtu>N-m</scfgtu>"), HasSubstr("<prodname>Net F/T</prodname>")));
  EXPECT_THAT(page_of(box), HasSubstr("<setbias>0;0;0;0;0;0</setbias>")) << "the bias by command does not show";
}

TEST(NetBoxQuirks, XmlMaySeparateAndFlagOtherwise) {
  NetBoxDevice box = box_that([](NetBoxSettings& s) {
    s.quirks.array_separator = ',';
    s.quirks.flags_as_digits = true;
  });
  EXPECT_THAT(page_of(box), AllOf(HasSubstr("<cfgmr>20,20,60,1,1,1</cfgmr>"), HasSubstr("<mcc>1,1,1"),
                                  HasSubstr("<comrdte>1</comrdte>"), HasSubstr("<comeipe>0</comeipe>")));
}

TEST(NetBoxPowerCycle, CountsAnewAndForgetsTheSoftwareBias) {
  NetBoxSettings settings;
  settings.bias_vector[2] = 100;
  NetBoxDevice box(settings);
  box.receive(kRealTime, 1);
  after(box, 100, kOneNewton);
  box.receive(kBias, 1);
  box.power_cycle(false);
  EXPECT_FALSE(box.streaming());
  EXPECT_EQ(box.settings().bias_vector[2], 100);
  box.receive(kRealTime, 1);
  const auto datagrams = after(box, 2, kOneNewton);
  ASSERT_EQ(datagrams.size(), 2u);
  EXPECT_EQ(rdt(datagrams[0]), 1u);
  EXPECT_EQ(ft(datagrams[0]), 0u);
  EXPECT_GT(counts(datagrams[0], 2), 500'000) << "the bias is gone";
  EXPECT_EQ(datagrams[0].boot, 1u);
}

TEST(NetBoxPowerCycle, MayStreamAgain) {
  NetBoxDevice box{NetBoxSettings{}};
  box.receive(kRealTime, 1);
  box.power_cycle(true);
  EXPECT_TRUE(box.streaming());
  EXPECT_EQ(rdt(after(box, 1, kOneNewton).at(0)), 1u);
}

TEST(NetBoxStall, RepeatsTheSample) {
  NetBoxDevice box{NetBoxSettings{}};
  box.receive(kRealTime, 1);
  after(box, 3, kOneNewton);
  box.stall(true);
  const auto stalled = after(box, 2, kOneNewton);
  EXPECT_EQ(rdt(stalled[1]), 5u);
  EXPECT_EQ(ft(stalled[1]), 2u);
  box.stall(false);
  EXPECT_EQ(ft(after(box, 1, kOneNewton)[0]), 3u);
}

}  // namespace kphi::sim::quirks_test
