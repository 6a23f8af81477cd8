#include <gtest/gtest.h>

#include <cmath>

#include "test/drivers/sim/netbox/box.hpp"

namespace kphi::sim::device_test {

using namespace test;

constexpr Peer kClient = 7;

NetBoxDevice box_with(double rate_hz, int records, std::uint32_t first_ft = 0) {
  NetBoxSettings settings;
  settings.rate_hz = rate_hz;
  settings.records_per_datagram = records;
  settings.first_ft_sequence = first_ft;
  return NetBoxDevice(settings);
}

TEST(NetBoxDevice, WritesTheRecordsOfTheManual) {
  NetBoxDevice box = box_with(1000, 1, 1234567);
  box.receive(kRealTime, kClient);
  const auto first = after(box, 7, {-0.123456, 0.25, 5.4321, -0.0015, 0, 0.098765});
  ASSERT_EQ(first.size(), 1u);
  EXPECT_EQ(hex(first[0].payload()), hex("00 00 00 01 00 12 d6 87 00 00 00 00 ff fe 1d c0 00 03 d0 90 00 52 e3 24 ff "
                                         "ff fa 24 00 00 00 00 00 01 81 cd"));
  const auto second = after(box, 1, {-0.123456, 0.25, 5.432101, -0.0015, 0, 0.098765});
  ASSERT_EQ(second.size(), 1u);
  EXPECT_EQ(hex(second[0].payload()), hex("00 00 00 02 00 12 d6 8e 00 00 00 00 ff fe 1d c0 00 03 d0 90 00 52 e3 25 ff "
                                          "ff fa 24 00 00 00 00 00 01 81 cd"));
}

TEST(NetBoxDevice, IsSilentUntilAskedAndAnswersTheAsker) {
  NetBoxDevice box = box_with(7000, 1);
  EXPECT_TRUE(after(box, 100).empty());
  box.receive(kRealTime, kClient);
  const auto datagrams = after(box, 3);
  ASSERT_EQ(datagrams.size(), 3u);
  EXPECT_EQ(datagrams[0].peer, kClient);
  EXPECT_EQ(rdt(datagrams[0]), 1u);
  EXPECT_EQ(ft(datagrams[0]), 100u) << "counts from power-up, not from the request";
  EXPECT_EQ(rdt(datagrams[2]), 3u);
}

TEST(NetBoxDevice, BuffersForCommandThreeOnly) {
  NetBoxDevice box = box_with(7000, 40);
  box.receive(bytes("12 34 00 03 00 00 00 00"), kClient);
  const auto buffered = after(box, 85);
  ASSERT_EQ(buffered.size(), 2u);
  EXPECT_EQ(buffered[1].size, 1440u);
  EXPECT_EQ(rdt(buffered[1], 39), 80u);
  EXPECT_EQ(ft(buffered[1], 39) - ft(buffered[1], 0), 39u);
  EXPECT_EQ(buffered[1].at, Instant(79));
  box.receive(kRealTime, kClient);
  const auto single = after(box, 5);
  ASSERT_EQ(single.size(), 5u);
  EXPECT_EQ(single[0].size, 36u);
  EXPECT_EQ(rdt(single[0]), 1u) << "a start drops the unfinished datagram and restarts at 1";
}

TEST(NetBoxDevice, HonoursTheSampleCountWithAPartialLastDatagram) {
  NetBoxDevice box = box_with(7000, 40);
  box.receive(bytes("12 34 00 03 00 00 00 32"), kClient);  // 50
  const auto datagrams = after(box, 500);
  ASSERT_EQ(datagrams.size(), 2u);
  EXPECT_EQ(datagrams[0].size, 40 * 36u);
  EXPECT_EQ(datagrams[1].size, 10 * 36u);
  EXPECT_FALSE(box.streaming());
  box.receive(bytes("12 34 00 02 00 00 00 01"), kClient);
  EXPECT_EQ(after(box, 10).size(), 1u);
}

TEST(NetBoxDevice, NewestCommandWinsAlsoFromAnotherPeer) {
  NetBoxDevice box = box_with(7000, 1);
  box.receive(kRealTime, kClient);
  after(box, 5);
  box.receive(kRealTime, 8);
  const auto datagrams = after(box, 2);
  ASSERT_EQ(datagrams.size(), 2u);
  EXPECT_EQ(datagrams[0].peer, 8u);
  EXPECT_EQ(rdt(datagrams[0]), 1u);
  EXPECT_EQ(ft(datagrams[0]), 5u);
  box.receive(bytes("12 34 00 00 00 00 00 00"), kClient);
  EXPECT_TRUE(after(box, 5).empty());
}

TEST(NetBoxDevice, IgnoresWhatIsNoRequest) {
  NetBoxDevice box = box_with(7000, 1);
  for (const char* nonsense : {"", "12 34 00 02 00 00 00", "12 34 00 02 00 00 00 00 00", "34 12 00 02 00 00 00 00",
                               "12 34 00 01 00 00 00 00", "12 34 00 99 00 00 00 00"}) {
    box.receive(bytes(nonsense), kClient);
  }
  EXPECT_TRUE(after(box, 10).empty());
  box.receive(bytes("12 34 00 04 00 00 00 00"), kClient);
  EXPECT_EQ(after(box, 2).size(), 2u) << "multi-unit streams the same record";
  box.receive(bytes("12 34 00 41 00 00 00 00"), kClient);
  EXPECT_EQ(after(box, 2).size(), 2u);
}

TEST(NetBoxDevice, RoundsTheRateUpAndStridesByTheDivisor) {
  const struct {
    double asked;
    int divisor;
  } cases[] = {{7000, 1}, {3501, 1}, {3500, 2}, {1000, 7}, {150, 46}, {99, 70}, {1, 7000}};
  for (const auto& rate : cases) EXPECT_EQ(box_with(rate.asked, 1).divisor(), rate.divisor) << rate.asked;
  NetBoxDevice box = box_with(1000, 1);
  box.receive(kRealTime, kClient);
  const auto datagrams = after(box, 7000);
  ASSERT_EQ(datagrams.size(), 1000u);
  EXPECT_EQ(ft(datagrams[999]) - ft(datagrams[998]), 7u);
}

TEST(NetBoxDevice, InternalSequenceWraps) {
  NetBoxDevice box = box_with(7000, 1, 0xffffffff);
  box.receive(kRealTime, kClient);
  const auto datagrams = after(box, 2);
  EXPECT_EQ(ft(datagrams[0]), 0xffffffffu);
  EXPECT_EQ(ft(datagrams[1]), 0u);
}

TEST(NetBoxDevice, SoftwareBiasTakesThePresentLoadAndTheStreamGoesOn) {
  NetBoxDevice box = box_with(7000, 1);
  box.receive(kRealTime, kClient);
  after(box, 3, {0.5, 0, 2, 0, 0.01, 0});
  box.receive(kBias, 99);
  const auto datagrams = after(box, 1, {0.5, 0, 3, 0, 0.01, 0});
  ASSERT_EQ(datagrams.size(), 1u);
  EXPECT_EQ(datagrams[0].peer, kClient);
  EXPECT_EQ(rdt(datagrams[0]), 4u);
  EXPECT_EQ(counts(datagrams[0], 0), 0);
  EXPECT_EQ(counts(datagrams[0], 2), 1'000'000);
  box.receive(kBias, kClient);
  EXPECT_EQ(counts(after(box, 1, {0.5, 0, 4, 0, 0.01, 0})[0], 2), 1'000'000) << "a second bias replaces the first";
}

TEST(NetBoxDevice, SaturationClampsAndFlags) {
  NetBoxDevice box = box_with(7000, 1);
  box.receive(kRealTime, kClient);
  for (const auto& [wrench, axis, clamped] :
       {std::tuple{Wrench{0, 0, 75, 0, 0, 0}, 2u, 60'000'000}, {Wrench{-21, 0, 0, 0, 0, 0}, 0u, -20'000'000}}) {
    const auto beyond = after(box, 1, wrench);
    EXPECT_EQ(counts(beyond[0], axis), clamped);
    EXPECT_EQ(word(beyond[0], 0, 8), 0x80020000u);
  }
  EXPECT_EQ(word(after(box, 1)[0], 0, 8), 0u) << "not latched";
}

}  // namespace kphi::sim::device_test
