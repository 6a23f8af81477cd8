#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "drivers/netbox/stream/reorder_window.hpp"
#include "test/drivers/netbox/stream/feed.hpp"

namespace kphi::netbox::reorder_test {

using namespace std::chrono_literals;
using namespace test;

/// A window of 64 records and 20 ms.
class Reordered {
 public:
  void feed(const std::string& text) {
    for (const Step& step : steps_of(text)) {
      if (step.kind == Step::Kind::wait_ms) now += step.number * 1ms;
      if (step.kind == Step::Kind::drops) account.add_host_drops(step.number, 1);
      if (step.kind == Step::Kind::expire) window.expire(now, account, out);
      if (step.kind == Step::Kind::flush) window.flush(account, out);
      if (step.kind != Step::Kind::record) continue;
      EXPECT_EQ(window.receive(step.record(now), account, out), step.taken) << step.number << " at " << step.ft;
    }
  }
  /// ft of the records, less 1000.
  std::vector<std::int32_t> delivered() const {
    std::vector<std::int32_t> numbers;
    for (const LoadCellRecord& stamped : out) numbers.push_back(static_cast<std::int32_t>(stamped.ft_sequence - 1000));
    return numbers;
  }
  void expect(const std::string& what, const std::string& counts) const {
    std::vector<std::int32_t> numbers;
    for (const Step& step : steps_of(what)) numbers.push_back(static_cast<std::int32_t>(step.number));
    EXPECT_EQ(delivered(), numbers);
    const Counters& c = account.counters();
    EXPECT_EQ(words_of(c), counts);
    expect_closed(c);
    EXPECT_EQ(c.received, out.size());
    EXPECT_EQ(window.deadline() == kNever, window.empty());
  }

  Instant now = 1s;
  LossTracker account{1, 7000};
  ReorderWindow window{64, 20ms, 1};
  std::vector<LoadCellRecord> out;
};

struct Case {
  const char* name;
  const char* feed;
  const char* delivered;
  const char* counts;  ///< what is not zero
};

TEST(Reorder, DeliversInOrderWhatComesInTime) {
  for (const Case& c : std::vector<Case>{
           {"a gap waits", "1 3 +19 4", "1", ""},
           {"is given up after the patience, and stays lost", "1 3 +19 4 +1 expire 2!", "1 3 4", "lost 1, late 1"},
           {"the time also runs with the records themselves", "1 3 +20 4", "1 3 4", "lost 1"},
           {"a younger gap waits for its own time", "1 3 +10 5 +10 expire", "1 3", "lost 1"},
           {"and may be filled until then", "1 3 +10 5 +10 expire 4", "1 3 4 5", "lost 1, reordered 1"},
           {"a window not full waits", "1 3..65", "1", ""},
           {"a full window gives up its first gap", "1 3..66", "1 3..66", "lost 1"},
           {"a gap wider than the window waits like any other", "1 1000", "1", ""},
           {"and is given up like any other", "1 1000 +20 expire", "1 1000", "lost 998"},
           {"what is overtaken right behind a wide gap is delivered", "1 1002 1000 1001 1003 +20 expire",
            "1 1000..1003", "lost 998, reordered 2"},
           {"behind a wide gap the window waits", "1 1000..1062", "1", ""},
           {"and fills like behind any other", "1 1000..1063", "1 1000..1063", "lost 998"},
           {"the first records of a stream may be overtaken, too", "3 2 1 4", "1..4", "reordered 2"},
           {"a stream whose first records are lost waits", "41 42", "", ""},
           {"and begins after the patience: nothing is missing before the first", "41 42 +20 expire", "41 42", ""},
           {"drops before the first record explain nothing", "drop100 1 3 flush", "1 3", "lost 1"},
           {"drops behind a waiting first record explain what is missing there", "3 drop1 5 flush", "3 5", "host 1"},
           {"what is left of a former stream is delivered before the new one", "500 501 1@1502 2@1503 +20 expire",
            "500..503", "restarts 1"},
           {"repetitions of a waiting measurement are a stall and no duplicates",
            "1 5 6@1005 7@1005 7@1005! 8@1005 9 flush", "1 5 9", "lost 6, duplicates 1, stalled 3, irregular 1"},
           {"a duplicate of a waiting record is counted", "1 3 3! 2", "1..3", "duplicates 1, reordered 1"},
           {"a restart without a gap drops nothing", "1..2000 1..2998@3001", "1..4998", "restarts 1"},
           {"a reorder across a restart is sorted, too", "98 flush 100 1@1101 99 2@1102", "98..102",
            "reordered 1, restarts 1"},
           {"a flush gives up all gaps and closes the account", "1 3 5 8 flush", "1 3 5 8", "lost 4"},
           {"a rate that the box has changed delays nothing", "1@1001 2..4@1003/2", "1 3 5 7",
            "lost 3, irregular 3"}}) {
    SCOPED_TRACE(c.name);
    Reordered stream;
    stream.feed(c.feed);
    stream.expect(c.delivered, c.counts);
  }
}

TEST(Reorder, WhatComesInOrderIsNeverDelayed) {
  Reordered stream;
  for (std::uint32_t i = 1; i <= 1000; ++i) {
    stream.feed(std::to_string(i));
    EXPECT_EQ(stream.out.size(), i);
    EXPECT_TRUE(stream.window.empty());
  }
  stream.expect("1..1000", "");
}

TEST(Reorder, AGapIsDueAfterThePatience) {
  Reordered stream;
  stream.feed("1 3");
  EXPECT_EQ(stream.window.deadline(), stream.now + 20ms);
}

TEST(Reorder, AdjacentSwapsAndFiveDeepReorderLoseNothing) {
  std::string swaps, deep;
  for (int i = 1; i <= 1000; i += 100) swaps += fmt::format("{}..{} {} {} ", i, i + 97, i + 99, i + 98);
  for (int i = 1; i <= 600; i += 6) deep += fmt::format("{} {} {} {} {} {} ", i, i + 5, i + 4, i + 3, i + 2, i + 1);
  Reordered swapped, reversed;
  swapped.feed(swaps);
  swapped.expect("1..1000", "reordered 10");
  reversed.feed(deep);
  reversed.expect("1..600", "reordered 400");
}

TEST(Reorder, ARebootDeliversBothOfItsFirstRecordsAndWhatWaited) {
  Reordered stream;
  stream.feed("1..100@500001 102@500102 +10 1@70! 2@71 3@72");
  const std::vector<std::int32_t> delivered = stream.delivered();
  ASSERT_EQ(delivered.size(), 104u);
  EXPECT_EQ(std::vector(delivered.begin() + 100, delivered.end()),
            (std::vector<std::int32_t>{499'102, -930, -929, -928}));
  EXPECT_EQ(words_of(stream.account.counters()), "lost 1, reboots 1");
}

// The channel loses, doubles and delays by up to 30 records; the truth is known by construction.
TEST(ReorderProperty, EveryRecordThatCameInTimeIsDeliveredOnceAndInOrder) {
  for (unsigned seed = 0; seed < 300; ++seed) {
    std::mt19937 random(seed);
    const unsigned stride = 1 + random() % 50;
    LossTracker account(stride, 7000);
    ReorderWindow window(64, 1s, stride);
    std::vector<LoadCellRecord> out;
    std::uint32_t rdt = random(), ft = random();
    struct Sent {
      unsigned address;
      LoadCellRecord record;
    };
    std::vector<Sent> channel;
    std::uint64_t lost = 0, doubled = 0;
    for (unsigned i = 0; i < 1000; ++i, ++rdt, ft += stride) {
      const LoadCellRecord record{{}, rdt, ft, 0, 0};
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
    for (Sent& sent : channel) {
      sent.record.arrival_ns = (now += from_seconds(stride / 70'000.0)).count();
      window.receive(sent.record, account, out);
    }
    window.flush(account, out);
    const Counters& c = account.counters();
    SCOPED_TRACE(seed);
    EXPECT_EQ(c.lost_network, lost);
    EXPECT_EQ(c.received, 1000 - lost);
    EXPECT_EQ(c.received, out.size());
    EXPECT_EQ(c.expected, 1000u);
    EXPECT_EQ(c.duplicates, doubled);
    EXPECT_EQ(c.late + c.restarts + c.reboots + c.irregular, 0u);
    for (std::size_t i = 1; i < out.size(); ++i)
      ASSERT_GT(static_cast<std::int32_t>(out[i].ft_sequence - out[i - 1].ft_sequence), 0) << seed;
  }
}

}  // namespace kphi::netbox::reorder_test
