// Each record comes out once and in order, whichever way it went in, and however writer and reader take turns.
#include "drivers/netbox/stream/record_queue.hpp"

#include <gtest/gtest.h>

#include <numeric>
#include <random>
#include <thread>

namespace kphi::netbox::record_queue_test {

/// Writes up to `count` records in place or by copying, numbered from `next` on; returns how many.
std::size_t write(RecordQueue& queue, std::size_t count, std::uint32_t next, bool in_place) {
  std::vector<LoadCellRecord> copied(count);
  const std::span<LoadCellRecord> slots = in_place ? queue.slots(count) : std::span<LoadCellRecord>();
  for (LoadCellRecord& record : slots.empty() ? std::span(copied) : slots) record.rdt_sequence = next++;
  if (slots.empty()) return queue.push(copied);
  queue.fill(count);
  return count;
}

TEST(RecordQueue, GivesEachRecordOnceAndInOrder) {
  for (unsigned seed = 0; seed < 100; ++seed) {
    std::mt19937 random(seed);
    RecordQueue queue(1 + random() % 100);
    std::vector<LoadCellRecord> out(64);
    std::uint32_t written = 0, published = 0, taken = 0;
    for (int i = 0; i < 2000; ++i) {
      written += static_cast<std::uint32_t>(write(queue, 1 + random() % 40, written, random() % 4 != 0));
      EXPECT_EQ(queue.waiting(), written - taken);
      if (random() % 2 == 0) continue;
      EXPECT_EQ(queue.publish(), written > published);
      published = written;
      const std::size_t count = queue.take(std::span(out).first(random() % 65));
      for (std::size_t k = 0; k < count; ++k) ASSERT_EQ(out[k].rdt_sequence, taken++) << seed;
      EXPECT_EQ(queue.empty(), taken == published);
    }
    EXPECT_GT(taken, 1000u);
  }
}

TEST(RecordQueue, KeepsTheOldestWhenItIsFull) {
  RecordQueue queue(4);
  EXPECT_EQ(write(queue, 3, 1, true), 3u);
  EXPECT_TRUE(queue.slots(2).empty());
  EXPECT_EQ(write(queue, 3, 4, false), 1u);
  EXPECT_EQ(write(queue, 1, 9, true), 0u);
  std::vector<LoadCellRecord> out(9);
  EXPECT_EQ(queue.take(out), 0u) << "not published";
  EXPECT_TRUE(queue.publish());
  EXPECT_FALSE(queue.publish());
  ASSERT_EQ(queue.take(out), 4u);
  for (std::uint32_t i = 0; i < 4; ++i) EXPECT_EQ(out[i].rdt_sequence, i + 1);
}

TEST(RecordQueue, LosesNothingBetweenTwoThreads) {
  constexpr std::uint32_t kRecords = 200'000;
  RecordQueue queue(512);
  std::thread writer([&] {
    std::mt19937 random(1);
    for (std::uint32_t next = 0; next < kRecords;) {
      const std::size_t count = std::min<std::size_t>(1 + random() % 40, kRecords - next);
      next += static_cast<std::uint32_t>(write(queue, count, next, random() % 4 != 0));
      queue.publish();
    }
  });
  std::vector<LoadCellRecord> out(100);
  std::uint32_t taken = 0, wrong = 0;
  while (taken < kRecords) {
    const std::size_t count = queue.take(out);
    for (std::size_t k = 0; k < count; ++k) wrong += out[k].rdt_sequence == taken++ ? 0 : 1;
  }
  writer.join();
  EXPECT_EQ(wrong, 0u);
  EXPECT_TRUE(queue.empty());
}

}  // namespace kphi::netbox::record_queue_test
