// The open questions of the box: each switch both ways.
#include <gtest/gtest.h>

#include "drivers/sim/netbox/device.hpp"
#include "test/drivers/sim/hex.hpp"

namespace kphi::sim {
namespace quirks_test {

using test::bytes;
using LastBlock = NetBoxQuirks::LastBlock;

const auto kBias = bytes("12 34 00 42 00 00 00 00");
const auto kRealTime = bytes("12 34 00 02 00 00 00 00");

NetBoxDevice box_that(void (*habit)(NetBoxSettings&)) {
  NetBoxSettings settings;
  habit(settings);
  return NetBoxDevice(settings);
}

std::vector<Datagram> after(NetBoxDevice& box, int ticks) {
  for (int i = 0; i < ticks; ++i) box.sample({Instant(i), {0, 0, 1, 0, 0, 0}});
  std::vector<Datagram> all;
  Datagram next;
  while (box.next_datagram(next)) all.push_back(next);
  return all;
}

std::uint32_t word(const Datagram& datagram, std::size_t offset) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < 4; ++i) value = value * 256 + datagram.bytes[offset + i];
  return value;
}

std::size_t records_of_fifty(LastBlock habit) {
  NetBoxSettings settings;
  settings.quirks.last_block = habit;
  NetBoxDevice box(settings);
  box.receive(bytes("12 34 00 03 00 00 00 32"), 1);
  std::size_t records = 0;
  for (const Datagram& d : after(box, 500)) records += d.size / 36;
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
  EXPECT_EQ(after(box, 40).size(), 40u);
  box.receive(kRealTime, 1);
  EXPECT_EQ(after(box, 40).size(), 1u) << "multi-block";
  box.sample({Instant{0}, {0, 0, 99, 0, 0, 0}});
  EXPECT_EQ(box.status(), 0xc0000000u);
  EXPECT_NE(box.http("GET /netftapi2.xml HTTP/1.0").find("<prodname>Ethernet Axia</prodname>"), std::string::npos);
}

TEST(NetBoxQuirks, XmlMaySpellTheTorqueOtherwise) {
  NetBoxDevice box = box_that([](NetBoxSettings& s) { s.quirks.torque_text_with_hyphen = true; });
  after(box, 1);
  box.receive(kBias, 1);
  const std::string xml = box.http("GET /netftapi2.xml HTTP/1.0");
  EXPECT_NE(xml.find("<scfgtu>N-m</scfgtu>"), std::string::npos);
  EXPECT_NE(xml.find("<prodname>Net F/T</prodname>"), std::string::npos);
  EXPECT_NE(xml.find("<setbias>0;0;0;0;0;0</setbias>"), std::string::npos) << "the bias by command does not show";
}

TEST(NetBoxQuirks, XmlMaySeparateAndFlagOtherwise) {
  NetBoxDevice box = box_that([](NetBoxSettings& s) {
    s.quirks.array_separator = ',';
    s.quirks.flags_as_digits = true;
  });
  const std::string xml = box.http("GET /netftapi2.xml HTTP/1.0");
  EXPECT_NE(xml.find("<cfgmr>20,20,60,1,1,1</cfgmr>"), std::string::npos);
  EXPECT_NE(xml.find("<mcc>1,1,1"), std::string::npos);
  EXPECT_NE(xml.find("<comrdte>1</comrdte>"), std::string::npos);
  EXPECT_NE(xml.find("<comeipe>0</comeipe>"), std::string::npos);
}

TEST(NetBoxPowerCycle, CountsAnewAndForgetsTheSoftwareBias) {
  NetBoxSettings settings;
  settings.bias_vector[2] = 100;
  NetBoxDevice box(settings);
  box.receive(kRealTime, 1);
  after(box, 100);
  box.receive(kBias, 1);
  box.power_cycle(false);
  EXPECT_FALSE(box.streaming());
  EXPECT_EQ(box.settings().bias_vector[2], 100);
  box.receive(kRealTime, 1);
  const auto datagrams = after(box, 2);
  ASSERT_EQ(datagrams.size(), 2u);
  EXPECT_EQ(word(datagrams[0], 0), 1u);
  EXPECT_EQ(word(datagrams[0], 4), 0u);
  EXPECT_GT(static_cast<std::int32_t>(word(datagrams[0], 20)), 500'000) << "the bias is gone";
  EXPECT_EQ(datagrams[0].boot, 1u);
}

TEST(NetBoxPowerCycle, MayStreamAgain) {
  NetBoxDevice box{NetBoxSettings{}};
  box.receive(kRealTime, 1);
  box.power_cycle(true);
  EXPECT_TRUE(box.streaming());
  EXPECT_EQ(word(after(box, 1).at(0), 0), 1u);
}

TEST(NetBoxStall, RepeatsTheSample) {
  NetBoxDevice box{NetBoxSettings{}};
  box.receive(kRealTime, 1);
  after(box, 3);
  box.stall(true);
  const auto stalled = after(box, 2);
  EXPECT_EQ(word(stalled[1], 0), 5u);
  EXPECT_EQ(word(stalled[1], 4), 2u);
  box.stall(false);
  EXPECT_EQ(word(after(box, 1)[0], 4), 3u);
}

}  // namespace quirks_test
}  // namespace kphi::sim
