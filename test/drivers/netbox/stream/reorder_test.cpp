#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "drivers/netbox/stream/sequence.hpp"

namespace kphi::netbox {
namespace {

using namespace std::chrono_literals;

class ReorderTest : public testing::Test {
 protected:
  bool receive(std::uint32_t rdt, std::uint32_t ft) {
    Record record;
    record.rdt_sequence = rdt;
    record.ft_sequence = ft;
    return window.receive(record, now, account, out);
  }
  /// Record `i` of an undisturbed stream.
  bool receive(std::uint32_t i) { return receive(i, 1000 + i); }
  std::vector<std::uint32_t> delivered() const {
    std::vector<std::uint32_t> numbers;
    for (const StampedRecord& stamped : out) numbers.push_back(stamped.record.ft_sequence - 1000);
    return numbers;
  }
  void expect_delivered_from_one_to(std::uint32_t last) const {
    ASSERT_EQ(out.size(), last);
    for (std::uint32_t i = 0; i < last; ++i) EXPECT_EQ(delivered()[i], i + 1);
  }
  const Counters& counters() const { return account.counters(); }
  void expect_closed() const {
    EXPECT_EQ(counters().expected, counters().received + counters().lost_network + counters().lost_host);
    EXPECT_EQ(counters().received, out.size());
  }

  Instant now = 1s;
  LossTracker account{1, 7000};
  ReorderWindow window{64, 20ms, 1};
  std::vector<StampedRecord> out;
};

TEST_F(ReorderTest, WhatComesInOrderIsNeverDelayed) {
  for (std::uint32_t i = 1; i <= 1000; ++i) {
    EXPECT_TRUE(receive(i));
    EXPECT_EQ(out.size(), i);
    EXPECT_TRUE(window.empty());
  }
  EXPECT_EQ(counters().reordered, 0u);
}

TEST_F(ReorderTest, AdjacentSwapsLoseNothing) {
  for (std::uint32_t i = 1; i <= 1000; i += 100) {
    for (std::uint32_t j = i; j < i + 98; ++j) receive(j);
    receive(i + 99);
    receive(i + 98);
    EXPECT_EQ(counters().lost_network, 0u);
  }
  expect_delivered_from_one_to(1000);
  EXPECT_EQ(counters().reordered, 10u);
  EXPECT_EQ(counters().late + counters().duplicates, 0u);
  expect_closed();
}

TEST_F(ReorderTest, FiveDeepReorderLosesNothing) {
  for (std::uint32_t i = 1; i <= 600; i += 6) {
    receive(i);
    for (std::uint32_t j = i + 5; j > i; --j) receive(j);
  }
  expect_delivered_from_one_to(600);
  EXPECT_EQ(counters().lost_network + counters().late, 0u);
  EXPECT_EQ(counters().reordered, 400u);
  expect_closed();
}

TEST_F(ReorderTest, AGapIsGivenUpAfterThePatience) {
  receive(1);
  receive(3);
  EXPECT_EQ(window.deadline(), now + 20ms);
  now += 19ms;
  receive(4);
  EXPECT_EQ(out.size(), 1u);
  expect_closed();
  now += 1ms;
  window.expire(now, account, out);
  EXPECT_EQ(delivered(), (std::vector<std::uint32_t>{1, 3, 4}));
  EXPECT_EQ(counters().lost_network, 1u);
  EXPECT_FALSE(receive(2));
  EXPECT_EQ(counters().late, 1u);
  EXPECT_EQ(counters().lost_network, 1u) << "it stays undelivered";
  expect_closed();
}

TEST_F(ReorderTest, TheTimeAlsoRunsWithTheRecordsThemselves) {
  receive(1);
  receive(3);
  now += 20ms;
  receive(4);
  EXPECT_EQ(delivered(), (std::vector<std::uint32_t>{1, 3, 4}));
}

TEST_F(ReorderTest, AYoungerGapWaitsForItsOwnTime) {
  receive(1);
  receive(3);
  now += 10ms;
  receive(5);
  now += 10ms;
  window.expire(now, account, out);
  EXPECT_EQ(delivered(), (std::vector<std::uint32_t>{1, 3}));
  receive(4);
  EXPECT_EQ(delivered(), (std::vector<std::uint32_t>{1, 3, 4, 5}));
  EXPECT_EQ(counters().lost_network, 1u);
}

TEST_F(ReorderTest, AFullWindowGivesUpItsFirstGap) {
  receive(1);
  for (std::uint32_t i = 3; i < 3 + 63; ++i) receive(i);
  EXPECT_EQ(out.size(), 1u);
  receive(66);
  EXPECT_EQ(out.size(), 65u);
  EXPECT_TRUE(window.empty());
  EXPECT_EQ(counters().lost_network, 1u);
  expect_closed();
}

TEST_F(ReorderTest, AGapWiderThanTheWindowWaitsLikeAnyOther) {
  receive(1);
  receive(1000);
  EXPECT_EQ(out.size(), 1u);
  now += 20ms;
  window.expire(now, account, out);
  EXPECT_EQ(delivered(), (std::vector<std::uint32_t>{1, 1000}));
  EXPECT_EQ(counters().lost_network, 998u);
  expect_closed();
}

TEST_F(ReorderTest, WhatIsOvertakenRightBehindAWideGapIsDelivered) {
  receive(1);
  for (const std::uint32_t i : {1002u, 1000u, 1001u, 1003u}) receive(i);
  now += 20ms;
  window.expire(now, account, out);
  EXPECT_EQ(delivered(), (std::vector<std::uint32_t>{1, 1000, 1001, 1002, 1003}));
  EXPECT_EQ(counters().lost_network, 998u);
  EXPECT_EQ(counters().late, 0u);
  expect_closed();
}

TEST_F(ReorderTest, BehindAWideGapTheWindowFillsLikeBehindAnyOther) {
  receive(1);
  for (std::uint32_t i = 1000; i < 1063; ++i) receive(i);
  EXPECT_EQ(out.size(), 1u);
  receive(1063);
  EXPECT_EQ(out.size(), 65u);
  EXPECT_TRUE(window.empty());
  EXPECT_EQ(counters().lost_network, 998u);
}

TEST_F(ReorderTest, TheFirstRecordsOfAStreamMayBeOvertakenToo) {
  for (const std::uint32_t i : {3u, 2u, 1u, 4u}) EXPECT_TRUE(receive(i));
  expect_delivered_from_one_to(4);
  EXPECT_EQ(counters().duplicates + counters().late, 0u);
  expect_closed();
}

TEST_F(ReorderTest, AStreamWhoseFirstRecordsAreLostBeginsAfterThePatience) {
  for (const std::uint32_t i : {41u, 42u}) receive(i);
  EXPECT_TRUE(out.empty());
  now += 20ms;
  window.expire(now, account, out);
  EXPECT_EQ(delivered(), (std::vector<std::uint32_t>{41, 42}));
  EXPECT_EQ(counters().expected, 2u) << "nothing is missing before the first";
}

TEST_F(ReorderTest, DropsBeforeTheFirstRecordExplainNothing) {
  account.add_host_drops(100, 1);
  for (const std::uint32_t i : {1u, 3u}) receive(i);
  window.flush(account, out);
  EXPECT_EQ(counters().lost_host, 0u);
  EXPECT_EQ(counters().lost_network, 1u);
}

TEST_F(ReorderTest, DropsBehindAWaitingFirstRecordExplainWhatIsMissingThere) {
  receive(3);
  account.add_host_drops(1, 1);
  receive(5);
  window.flush(account, out);
  EXPECT_EQ(counters().lost_host, 1u);
  EXPECT_EQ(counters().lost_network, 0u);
}

TEST_F(ReorderTest, WhatIsLeftOfAFormerStreamIsDeliveredBeforeTheNewOne) {
  for (const std::uint32_t i : {500u, 501u}) receive(i, 1000 + i);
  for (const std::uint32_t i : {1u, 2u}) receive(i, 1501 + i);
  now += 20ms;
  window.expire(now, account, out);
  EXPECT_EQ(delivered(), (std::vector<std::uint32_t>{500, 501, 502, 503}));
  EXPECT_EQ(counters().restarts, 1u);
  EXPECT_EQ(counters().reboots, 0u);
  expect_closed();
}

TEST_F(ReorderTest, RepetitionsOfAWaitingMeasurementAreAStallAndNoDuplicates) {
  receive(1);
  receive(5);
  for (const std::uint32_t rdt : {6u, 7u, 7u, 8u}) receive(rdt, 1005);
  receive(9, 1009);
  window.flush(account, out);
  EXPECT_EQ(delivered(), (std::vector<std::uint32_t>{1, 5, 9}));
  EXPECT_EQ(counters().stalled, 3u);
  EXPECT_EQ(counters().duplicates, 1u);
}

TEST_F(ReorderTest, ADuplicateOfAWaitingRecordIsCounted) {
  receive(1);
  EXPECT_TRUE(receive(3));
  EXPECT_FALSE(receive(3));
  receive(2);
  expect_delivered_from_one_to(3);
  EXPECT_EQ(counters().duplicates, 1u);
}

TEST_F(ReorderTest, ARateThatTheBoxHasChangedDelaysNothing) {
  receive(1, 1001);
  for (std::uint32_t i = 2; i < 200; ++i) receive(i, 999 + 2 * i);
  EXPECT_EQ(out.size(), 199u);
  EXPECT_EQ(counters().irregular, 198u);
}

TEST_F(ReorderTest, ARestartWithoutAGapDropsNothing) {
  for (std::uint32_t i = 1; i <= 2000; ++i) receive(i, 1000 + i);
  for (std::uint32_t i = 1; i <= 2998; ++i) EXPECT_TRUE(receive(i, 3000 + i));
  EXPECT_EQ(out.size(), 4998u);
  EXPECT_EQ(counters().restarts, 1u);
}

TEST_F(ReorderTest, AReorderAcrossARestartIsSortedToo) {
  receive(98, 1098);
  window.flush(account, out);
  receive(100, 1100);
  receive(1, 1101);
  receive(99, 1099);
  receive(2, 1102);
  EXPECT_EQ(delivered(), (std::vector<std::uint32_t>{98, 99, 100, 101, 102}));
  EXPECT_EQ(counters().lost_network + counters().late, 0u);
  EXPECT_EQ(counters().restarts, 1u);
  expect_closed();
}

TEST_F(ReorderTest, ARebootDeliversBothOfItsFirstRecordsAndWhatWaited) {
  for (std::uint32_t i = 1; i <= 100; ++i) receive(i, 500'000 + i);
  receive(102, 500'102);
  now += 10ms;
  receive(1, 70);
  receive(2, 71);
  receive(3, 72);
  ASSERT_EQ(out.size(), 104u);
  EXPECT_EQ(out[100].record.ft_sequence, 500'102u);
  EXPECT_EQ(out[101].record.ft_sequence, 70u);
  EXPECT_EQ(out[102].record.ft_sequence, 71u);
  EXPECT_EQ(counters().reboots, 1u);
  EXPECT_EQ(counters().lost_network, 1u);
  expect_closed();
}

TEST_F(ReorderTest, FlushGivesUpAllGapsAndClosesTheAccount) {
  for (const std::uint32_t i : {1u, 3u, 5u, 8u}) receive(i);
  window.flush(account, out);
  EXPECT_EQ(delivered(), (std::vector<std::uint32_t>{1, 3, 5, 8}));
  EXPECT_EQ(counters().lost_network, 4u);
  EXPECT_EQ(window.deadline(), kNever);
  expect_closed();
}

// The channel loses, doubles and delays by up to 30 records; the truth is known by construction.
TEST(ReorderProperty, EveryRecordThatCameInTimeIsDeliveredOnceAndInOrder) {
  for (unsigned seed = 0; seed < 300; ++seed) {
    std::mt19937 random(seed);
    const unsigned stride = 1 + random() % 50;
    LossTracker account(stride, 7000);
    ReorderWindow window(64, 1s, stride);
    std::vector<StampedRecord> out;
    std::uint32_t rdt = random(), ft = random();
    struct Sent {
      unsigned address;
      Record record;
    };
    std::vector<Sent> channel;
    std::uint64_t lost = 0, doubled = 0;
    for (unsigned i = 0; i < 1000; ++i, ++rdt, ft += stride) {
      Record record;
      record.rdt_sequence = rdt;
      record.ft_sequence = ft;
      const bool edge = i == 0 || i == 999;
      if (!edge && random() % 30 == 0) {
        ++lost;
        continue;
      }
      const bool delayed = !edge && random() % 10 == 0;
      channel.push_back({i + (delayed ? static_cast<unsigned>(random() % 30) : 0), record});
      if (!edge && random() % 40 == 0) {
        channel.push_back(channel.back());
        ++doubled;
      }
    }
    std::stable_sort(channel.begin(), channel.end() - 1,
                     [](const Sent& a, const Sent& b) { return a.address < b.address; });
    Instant now = 1s;
    for (const Sent& sent : channel) window.receive(sent.record, now += from_seconds(stride / 70'000.0), account, out);
    window.flush(account, out);
    const Counters& c = account.counters();
    EXPECT_EQ(c.lost_network, lost) << seed;
    EXPECT_EQ(c.received, 1000 - lost) << seed;
    EXPECT_EQ(c.received, out.size()) << seed;
    EXPECT_EQ(c.expected, 1000u) << seed;
    EXPECT_EQ(c.duplicates, doubled) << seed;
    EXPECT_EQ(c.late + c.restarts + c.reboots + c.irregular, 0u) << seed;
    for (std::size_t i = 1; i < out.size(); ++i)
      ASSERT_GT(static_cast<std::int32_t>(out[i].record.ft_sequence - out[i - 1].record.ft_sequence), 0) << seed;
  }
}

}  // namespace
}  // namespace kphi::netbox
