#include "drivers/netbox/stream/record_ring.hpp"

#include <gtest/gtest.h>

#include <random>
#include <thread>

namespace kphi::netbox {
namespace {

/// Writes the next `count` numbers where there is room for them.
bool write(RecordRing& ring, std::uint32_t& next, std::size_t count) {
  const std::span<StampedRecord> room = ring.room(count);
  if (room.empty()) return false;
  for (StampedRecord& slot : room) slot.record.ft_sequence = next++;
  ring.fill(count);
  return true;
}

TEST(RecordRing, HoldsAtLeastWhatWasAskedFor) {
  EXPECT_GE(RecordRing(1).capacity(), kMaxRecords);
  EXPECT_GE(RecordRing(70'000).capacity(), 70'000u);
}

TEST(RecordRing, ShowsNothingBeforeItIsPublished) {
  RecordRing ring(100);
  std::uint32_t next = 7;
  std::vector<StampedRecord> out(100);
  ASSERT_TRUE(write(ring, next, 3));
  EXPECT_TRUE(ring.empty());
  EXPECT_EQ(ring.take(out), 0u);
  EXPECT_TRUE(ring.publish());
  EXPECT_FALSE(ring.publish()) << "nothing new";
  EXPECT_EQ(ring.waiting(), 3u);
  EXPECT_EQ(ring.take(out), 3u);
  EXPECT_EQ(out[0].record.ft_sequence, 7u);
  EXPECT_EQ(out[2].record.ft_sequence, 9u);
  EXPECT_TRUE(ring.empty());
}

TEST(RecordRing, RefusesWhatDoesNotFitAndTakesItLater) {
  RecordRing ring(128);
  std::uint32_t next = 0;
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(write(ring, next, 40));
  EXPECT_FALSE(write(ring, next, 9));
  EXPECT_TRUE(write(ring, next, 8));
  EXPECT_FALSE(write(ring, next, 1));
  ring.publish();
  std::vector<StampedRecord> out(9);
  EXPECT_EQ(ring.take(out), 9u);
  EXPECT_TRUE(write(ring, next, 9));
}

TEST(RecordRing, PushesAsManyAsFitOldestFirst) {
  RecordRing ring(64);
  std::vector<StampedRecord> records(100), out(100);
  for (std::uint32_t i = 0; i < 100; ++i) records[i].record.ft_sequence = i;
  EXPECT_EQ(ring.push(records), 64u);
  ring.publish();
  EXPECT_EQ(ring.take(out), 64u);
  EXPECT_EQ(out[63].record.ft_sequence, 63u);
}

TEST(RecordRing, KeepsTheOrderAcrossItsEnd) {
  RecordRing ring(128);
  std::mt19937 random(5);
  std::uint32_t next = 0, expected = 0;
  std::vector<StampedRecord> out(50);
  for (int i = 0; i < 10'000; ++i) {
    write(ring, next, 1 + random() % kMaxRecords);
    ring.publish();
    const std::size_t count = ring.take(std::span(out).first(random() % 50));
    for (std::size_t j = 0; j < count; ++j) ASSERT_EQ(out[j].record.ft_sequence, expected++);
  }
  EXPECT_GT(expected, 100'000u);
}

TEST(RecordRing, BetweenTwoThreadsNothingIsLostOrTorn) {
  RecordRing ring(1024);
  constexpr std::uint32_t kRecords = 400'000;
  std::thread writer([&] {
    for (std::uint32_t next = 0; next < kRecords;) {
      if (!write(ring, next, std::min<std::size_t>(1 + next % kMaxRecords, kRecords - next))) std::this_thread::yield();
      ring.publish();
    }
  });
  std::vector<StampedRecord> out(300);
  std::uint32_t expected = 0;
  bool in_order = true;
  while (expected < kRecords) {
    const std::size_t count = ring.take(out);
    if (count == 0) std::this_thread::yield();
    for (std::size_t i = 0; i < count; ++i) in_order &= out[i].record.ft_sequence == expected++;
  }
  writer.join();
  EXPECT_TRUE(in_order);
}

}  // namespace
}  // namespace kphi::netbox
