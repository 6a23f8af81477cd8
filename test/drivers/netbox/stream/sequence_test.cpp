#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "drivers/netbox/stream/reorder_window.hpp"
#include "test/drivers/netbox/stream/feed.hpp"

namespace kphi::netbox::sequence_test {

using namespace std::chrono_literals;
using namespace test;

/// Feeds records at the time at which a box would send them.
class Stream {
 public:
  explicit Stream(unsigned stride = 1) : stride_(stride), account_(stride, 7000) {}

  bool accept(std::uint32_t rdt, std::uint32_t ft) {
    now_ += from_seconds(stride_ / 7000.0);
    return account_.accept({{}, rdt, ft, 0, now_.count()});
  }
  /// Returns the number of records accepted. Each must be taken or refused as its step says.
  std::uint64_t feed(const char* text) {
    std::uint64_t accepted = 0;
    for (const Step& step : steps_of(text, stride_)) {
      if (step.kind == Step::Kind::wait_ms) now_ += step.number * 1ms;
      if (step.kind == Step::Kind::drops) account_.add_host_drops(step.number, 40);
      if (step.kind == Step::Kind::segment) account_.begin_segment();
      if (step.kind != Step::Kind::record) continue;
      EXPECT_EQ(accept(step.number, step.ft), step.taken) << step.number << " at " << step.ft;
      accepted += step.taken;
      if (const auto other = account_.take_confirmed()) {
        ++accepted;
        confirmed_ft = other->ft_sequence;
      }
    }
    return accepted;
  }
  LossTracker& account() { return account_; }
  const Counters& counters() const { return account_.counters(); }
  std::uint32_t confirmed_ft = 0;  ///< of the record delivered with the one that proved a reboot

 private:
  unsigned stride_;
  Instant now_{1s};
  LossTracker account_;
};

struct Case {
  const char* name;
  unsigned stride;
  const char* feed;
  const char* counts;  ///< what is not zero
};

TEST(Sequence, CountsWhatTheNumbersAndTheTimeSay) {
  for (const Case& c : std::vector<Case>{
           {"a record behind the other is received and expected", 1, "1..1000@500", ""},
           {"both numbers wrap unnoticed", 7, "0xffffff00..0x2e7@0xfffffc00", ""},
           {"a gap across the wrap is counted exactly", 7, "0xfffffffe@0xfffffff2 9@0x3f", "lost 10"},
           {"a gap is the host's as far as the socket explains it", 1, "1@100 drop2 102@201", "lost 20, host 80"},
           {"and not what is missing later", 1, "1@100 drop2 102@201 104@203", "lost 21, host 80"},
           {"1006 samples take longer: a boot shortly before the wrap is not taken for a step forward", 1,
            "500@0xfffffc18 +20 1@6! 2@7", "reboots 1"},
           {"1000 samples take less: a boot shortly behind the wrap is none either", 1,
            "30000@2600 +520 1@3600! 2@3601", "reboots 1"},
           {"a restart held up for 0.38 s is not taken for a boot if the box has counted further", 1,
            "30000@26000 +520 1@27000", "lost 999, restarts 1"},
           {"a restart across the wrap is no boot", 1, "500@0xfffffc18 +150 1@6", "lost 1005, restarts 1"},
           {"a duplicate is discarded", 1, "1..3@100 3@102! 1@100! 4@103", "duplicates 2"},
           {"a late record is discarded and stays lost", 1, "100..102 104 103! 105", "lost 1, late 1"},
           {"a stream that begins anew continues without loss", 1, "1..2000@5001 1..2998@7001", "restarts 1"},
           {"what is missing across a restart is counted by ft", 7, "2000@70000 1@70350", "lost 49, restarts 1"},
           {"a late record of the epoch before is no reboot", 1, "1..98@5001 100@5100 1..10@5101 99@5099! 11@5111",
            "lost 1, late 1, restarts 1"},
           {"nor is a burst of them", 1, "1..49@5001 60..100@5060 1..10@5101 50..59@5050!",
            "lost 10, late 10, restarts 1"},
           {"nor a delayed copy of the stream of a session before", 2,
            "1..50@102711 25000..25009@102400! 61..100@102831", "lost 10, duplicates 10"},
           {"nor a single stray record", 1, "1..10@10000001 1@1! 11..20@10000011 2@2! 21..30@10000021 3@3! 31@10000031",
            "duplicates 3"},
           {"nor a stream of whole duplicates", 1,
            "1..400@9001 1..400@9001! 401..800@9401 401..800@9401! 801..9000@9801 801..9000@9801!", "duplicates 9000"},
           {"a far drop of ft is a reboot once a second record confirms it", 1,
            "1..100@10000001 +3000 1@20000! 2..3@20001", "reboots 1"},
           {"so is what looks like a forward jump: by the time it would have taken", 1,
            "1..100@0x90000001 +3000 1@20000! 2@20001", "reboots 1"},
           {"a reboot whose first two records overtake each other loses neither", 1,
            "1..100@10000001 +3000 2@20001! 1@20000 3@20002", "reordered 1, reboots 1"},
           {"a reboot into another rate is a reboot, too", 7, "1..100@10000007 +3000 1@20000! 2..50@20002/2",
            "irregular 49, reboots 1"},
           {"a reboot is confirmed by a record on the line of a stream before", 1,
            "1@1001 1@2001 999004@1000000! 999005@1000005", "lost 1003, irregular 1, restarts 1, reboots 1"},
           {"a boot within seconds of the first one is recognised, too", 1, "1..1000@10001 1@1! 2..11000@2",
            "reboots 1"},
           {"a measurement that stands still is not delivered", 1, "1@100 2..49@100/0! 50@101", "stalled 48"},
           {"a stream that begins anew meanwhile has begun anew", 1, "1..10@101 11..15@110/0! 1..20@110/0! 21..22@111",
            "stalled 25, restarts 1"},
           {"a lost hour is counted when an hour has passed", 1, "1@100 +3600000 25200001@25200100", "lost 25199999"},
           {"drops before a boot explain nothing behind it", 1, "1..100@10000001 +3000 drop2 1@20000! 2@20001 5@20004",
            "lost 2, reboots 1"},
           {"a gap before a boot is forgotten", 1, "1..500@10001 502..1000@10502 1@1! 2..10999@2 10501@10501!",
            "lost 1, duplicates 1, reboots 1"},
           {"a gap of half a stride is rounded up", 2, "1@100 2@103", "lost 1, irregular 1"},
           {"an unexpected stride is marked", 1, "1@100 2@107", "lost 6, irregular 1"},
           {"a new segment owes nothing to the one before", 1, "1@100 segment 1@90000", ""}}) {
    SCOPED_TRACE(c.name);
    Stream stream(c.stride);
    EXPECT_EQ(stream.feed(c.feed), stream.counters().received);
    EXPECT_EQ(words_of(stream.counters()), c.counts);
    expect_closed(stream.counters());
  }
}

struct Named {
  const char* feed;
  std::vector<EventKind> kinds;
  const char* words;  ///< of the last one
};

TEST(Sequence, NamesRestartRebootAndStallWithTheirNumbers) {
  for (const Named& c : std::vector<Named>{
           {"2000@70000 1@70050",
            {EventKind::restarted},
            ": the stream restarted (rdt 1 after 2000, ft 70050 after 70000), 49 records missing"},
           {"1..100@10000001 +3000 1@20000! 2@20001",
            {EventKind::rebooted},
            ": the box has booted (rdt 1 after 100, ft 20000 after 10000100): its bias and scale may have changed"},
           {"1@100 2..30@100/0!",
            {EventKind::stalled},
            ": the box repeats one measurement (rdt 2 after 1, ft 100 after 100)"},
           {"1@100 2..30@100/0! 31..32@101",
            {EventKind::stalled, EventKind::stall_ended},
            ": the box measures again after 29 repeated records"}}) {
    Stream stream;
    stream.feed(c.feed);
    const std::vector<Event> events = stream.account().events();
    ASSERT_EQ(events.size(), c.kinds.size()) << c.feed;
    for (std::size_t i = 0; i < events.size(); ++i) EXPECT_EQ(events[i].kind, c.kinds[i]) << c.feed;
    EXPECT_TRUE(to_string(events.back()).ends_with(c.words)) << to_string(events.back());
  }
}

TEST(Sequence, ADropIsCountedWhetherOrNotItExplainsAGap) {
  Stream stream;
  stream.feed("1@100 drop2 102@201");
  EXPECT_EQ(stream.counters().host_drops, 2u);
}

TEST(Sequence, TheFirstRecordOfARebootIsATrueMeasurementToo) {
  for (const auto& [feed, other_ft] : {std::pair("1@20000! 2@20001", 20'000u), {"2@20001! 1@20000", 20'001u}}) {
    Stream stream;
    stream.feed("1..100@10000001 +3000");
    stream.feed(feed);
    EXPECT_EQ(stream.confirmed_ft, other_ft);
  }
}

// The channel loses, repeats, swaps, and the stream begins anew; the truth is known here by construction.
TEST(Sequence, TheAccountClosesAndEqualsTheTruthWhateverTheChannelDoes) {
  for (unsigned seed = 0; seed < 300; ++seed) {
    std::mt19937 random(seed);
    const auto chance = [&](int in) { return random() % in == 0; };
    const unsigned stride = 1 + random() % 70;
    Stream stream(stride);
    std::uint32_t rdt = random(), ft = random();
    std::vector<std::pair<std::uint32_t, std::uint32_t>> sent;
    std::uint64_t restarts = 0;
    for (int i = 0; i < 2000; ++i, ++rdt, ft += stride) {
      if (chance(500) && rdt > 1 && rdt < 0x80000000u) {
        rdt = 1;
        ++restarts;
      }
      sent.emplace_back(rdt, ft);
    }
    std::uint64_t accepted = 0, host_lost = 0, offered = 0;
    std::uint32_t first_ft = 0, newest_ft = 0;
    const auto offer = [&](std::size_t i) {
      const bool ahead = offered == 0 || static_cast<std::int32_t>(sent[i].second - newest_ft) > 0;
      if (offered++ == 0) first_ft = sent[i].second;
      if (ahead) newest_ft = sent[i].second;
      accepted += ahead;
      EXPECT_EQ(stream.accept(sent[i].first, sent[i].second), ahead) << "seed " << seed << " record " << i;
    };
    for (std::size_t i = 0; i < sent.size(); ++i) {
      if (chance(50)) {
        if (offered > 0 && chance(2)) stream.account().add_host_drops(1, 1), ++host_lost;
        continue;
      }
      if (chance(60) && i + 1 < sent.size()) {
        offer(i + 1);
        offer(i);
        ++i;
        continue;
      }
      offer(i);
      if (chance(70)) offer(i);
    }
    const Counters& c = stream.counters();
    EXPECT_EQ(c.received, accepted);
    EXPECT_EQ(c.expected, 1 + (newest_ft - first_ft) / stride);
    expect_closed(stream.counters());
    EXPECT_LE(c.lost_host, host_lost);
    EXPECT_GE(c.lost_host + 1, host_lost);  // the last may have had no record behind it
    EXPECT_EQ(c.late + c.duplicates, offered - accepted);
    EXPECT_EQ(c.reboots + c.irregular, 0u);
    EXPECT_LE(c.restarts, restarts);
  }
}

}  // namespace kphi::netbox::sequence_test
