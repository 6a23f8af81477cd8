#include "drivers/netbox/stream/sequence.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace kphi::netbox {
namespace {

using namespace std::chrono_literals;

/// Feeds records at the time at which a box would send them.
class Stream {
 public:
  explicit Stream(unsigned stride = 1) : stride_(stride), account_(stride, 7000) {}

  bool accept(std::uint32_t rdt, std::uint32_t ft) {
    now_ += from_seconds(stride_ / 7000.0);
    Record record;
    record.rdt_sequence = rdt;
    record.ft_sequence = ft;
    return account_.accept(record, now_);
  }
  void wait(Duration pause) { now_ += pause; }
  LossTracker& account() { return account_; }
  const Counters& counters() const { return account_.counters(); }
  void expect_closed() const {
    const Counters& c = counters();
    EXPECT_EQ(c.expected, c.received + c.lost_network + c.lost_host);
  }

 private:
  unsigned stride_;
  Instant now_{1s};
  LossTracker account_;
};

TEST(Sequence, ARecordBehindTheOtherIsReceivedAndExpected) {
  Stream stream;
  for (std::uint32_t i = 0; i < 1000; ++i) EXPECT_TRUE(stream.accept(1 + i, 500 + i));
  EXPECT_EQ(stream.counters().received, 1000u);
  EXPECT_EQ(stream.counters().expected, 1000u);
  EXPECT_EQ(stream.counters().irregular, 0u);
}

TEST(Sequence, BothNumbersWrapUnnoticed) {
  Stream stream(7);
  for (std::uint32_t i = 0; i < 1000; ++i) EXPECT_TRUE(stream.accept(0xffffff00u + i, 0xfffffc00u + 7 * i));
  EXPECT_EQ(stream.counters().expected, 1000u);
  EXPECT_EQ(stream.counters().restarts + stream.counters().reboots + stream.counters().irregular, 0u);
}

TEST(Sequence, AGapAcrossTheWrapIsCountedExactly) {
  Stream stream(7);
  stream.accept(0xfffffffe, 0xfffffff9 - 7);
  stream.accept(0xfffffffe + 11, 0xfffffff9 - 7 + 77);
  EXPECT_EQ(stream.counters().lost_network, 10u);
  EXPECT_EQ(stream.counters().irregular, 0u);
  stream.expect_closed();
}

TEST(Sequence, AGapIsTheHostsAsFarAsTheSocketExplainsIt) {
  Stream stream;
  stream.accept(1, 100);
  stream.account().add_host_drops(2, 40);
  stream.accept(102, 201);  // 100 missing, 80 of them explained
  EXPECT_EQ(stream.counters().lost_host, 80u);
  EXPECT_EQ(stream.counters().lost_network, 20u);
  stream.accept(104, 203);
  EXPECT_EQ(stream.counters().lost_host, 80u);
  EXPECT_EQ(stream.counters().lost_network, 21u);
  EXPECT_EQ(stream.counters().host_drops, 2u);
  stream.expect_closed();
}

TEST(Sequence, ABootShortlyBeforeTheWrapIsNoStepForward) {
  LossTracker account(1, 7000);
  Record record;
  const auto accept = [&](std::uint32_t rdt, std::uint32_t ft, Instant arrival) {
    record.rdt_sequence = rdt;
    record.ft_sequence = ft;
    return account.accept(record, arrival);
  };
  EXPECT_TRUE(accept(500, 0xffffffff - 999, 10s));
  EXPECT_FALSE(accept(1, 6, 10s + 20ms)) << "1006 samples take longer";
  EXPECT_TRUE(accept(2, 7, 10s + 20ms));
  EXPECT_EQ(account.counters().reboots, 1u);
  EXPECT_EQ(account.counters().lost_network, 0u);
}

TEST(Sequence, ABootShortlyBehindTheWrapIsNoStepForward) {
  LossTracker account(1, 7000);
  Record record;
  const auto accept = [&](std::uint32_t rdt, std::uint32_t ft, Instant arrival) {
    record.rdt_sequence = rdt;
    record.ft_sequence = ft;
    return account.accept(record, arrival);
  };
  EXPECT_TRUE(accept(30'000, 2600, 10s));
  EXPECT_FALSE(accept(1, 3600, 10s + 520ms)) << "1000 samples take less";
  EXPECT_TRUE(accept(2, 3601, 10s + 520ms));
  EXPECT_EQ(account.counters().reboots, 1u);
  EXPECT_EQ(account.counters().lost_network, 0u);
}

TEST(Sequence, ARestartThatComesLateIsNoBootWhereTheBoxHasCountedFurtherThanThat) {
  LossTracker account(1, 7000);
  Record record;
  record.rdt_sequence = 30'000;
  record.ft_sequence = 26'000;
  EXPECT_TRUE(account.accept(record, 10s));
  record.rdt_sequence = 1;
  record.ft_sequence = 27'000;
  EXPECT_TRUE(account.accept(record, 10s + 520ms)) << "held up for 0.38 s on its way";
  EXPECT_EQ(account.counters().restarts, 1u);
  EXPECT_EQ(account.counters().lost_network, 999u);
}

TEST(Sequence, ARestartAcrossTheWrapIsNoBoot) {
  LossTracker account(1, 7000);
  Record record;
  record.rdt_sequence = 500;
  record.ft_sequence = 0xffffffff - 999;
  EXPECT_TRUE(account.accept(record, 10s));
  record.rdt_sequence = 1;
  record.ft_sequence = 6;
  EXPECT_TRUE(account.accept(record, 10s + 150ms));
  EXPECT_EQ(account.counters().restarts, 1u);
  EXPECT_EQ(account.counters().lost_network, 1005u);
}

TEST(Sequence, ADuplicateIsDiscarded) {
  Stream stream;
  stream.accept(1, 100);
  stream.accept(2, 101);
  stream.accept(3, 102);
  EXPECT_FALSE(stream.accept(3, 102));
  EXPECT_FALSE(stream.accept(1, 100));
  EXPECT_TRUE(stream.accept(4, 103));
  EXPECT_EQ(stream.counters().duplicates, 2u);
  EXPECT_EQ(stream.counters().late, 0u);
  EXPECT_EQ(stream.counters().expected, 4u);
}

TEST(Sequence, ALateRecordIsDiscardedAndStaysLost) {
  Stream stream;
  for (const std::uint32_t i : {100u, 101u, 102u, 104u}) EXPECT_TRUE(stream.accept(i, 1000 + i));
  EXPECT_FALSE(stream.accept(103, 1103));
  EXPECT_TRUE(stream.accept(105, 1105));
  EXPECT_EQ(stream.counters().late, 1u);
  EXPECT_EQ(stream.counters().lost_network, 1u);
  EXPECT_EQ(stream.counters().duplicates, 0u);
  stream.expect_closed();
}

TEST(Sequence, AStreamThatBeginsAnewGoesOnWithoutLoss) {
  Stream stream;
  for (std::uint32_t i = 1; i <= 2000; ++i) stream.accept(i, 5000 + i);
  for (std::uint32_t i = 1; i <= 2998; ++i) EXPECT_TRUE(stream.accept(i, 7000 + i));
  EXPECT_EQ(stream.counters().restarts, 1u);
  EXPECT_EQ(stream.counters().received, 4998u);
  EXPECT_EQ(stream.counters().expected, 4998u);
}

TEST(Sequence, WhatIsMissingAcrossARestartIsCountedByFt) {
  Stream stream(7);
  stream.accept(2000, 70000);
  stream.accept(1, 70000 + 7 * 50);
  EXPECT_EQ(stream.counters().restarts, 1u);
  EXPECT_EQ(stream.counters().lost_network, 49u);
  stream.expect_closed();
}

TEST(Sequence, ALateRecordOfTheEpochBeforeIsNoReboot) {
  Stream stream;
  for (std::uint32_t i = 1; i <= 100; ++i) {
    if (i != 99) stream.accept(i, 5000 + i);
  }
  for (std::uint32_t i = 1; i <= 10; ++i) stream.accept(i, 5100 + i);
  EXPECT_FALSE(stream.accept(99, 5099));
  EXPECT_TRUE(stream.accept(11, 5111));
  EXPECT_EQ(stream.counters().late, 1u);
  EXPECT_EQ(stream.counters().reboots, 0u);
  EXPECT_EQ(stream.counters().restarts, 1u);
}

TEST(Sequence, ADelayedCopyOfTheStreamOfASessionBeforeIsNoReboot) {
  Stream stream(2);
  for (std::uint32_t i = 0; i < 50; ++i) EXPECT_TRUE(stream.accept(1 + i, 102'711 + 2 * i));
  for (std::uint32_t i = 0; i < 10; ++i) EXPECT_FALSE(stream.accept(25'000 + i, 102'400 + 2 * i));
  for (std::uint32_t i = 60; i < 100; ++i) EXPECT_TRUE(stream.accept(1 + i, 102'711 + 2 * i));
  EXPECT_EQ(stream.counters().reboots, 0u);
  EXPECT_EQ(stream.counters().duplicates + stream.counters().late, 10u);
  EXPECT_EQ(stream.counters().received, 90u);
  stream.expect_closed();
}

TEST(Sequence, AFarDropOfFtIsARebootOnceASecondRecordConfirmsIt) {
  Stream stream;
  for (std::uint32_t i = 1; i <= 100; ++i) stream.accept(i, 10'000'000 + i);
  stream.wait(3s);
  EXPECT_FALSE(stream.accept(1, 20'000));
  EXPECT_TRUE(stream.accept(2, 20'001));
  EXPECT_TRUE(stream.accept(3, 20'002));
  EXPECT_EQ(stream.counters().reboots, 1u);
  const auto first = stream.account().take_confirmed();
  ASSERT_TRUE(first) << "the first of the two is a true measurement as well";
  EXPECT_EQ(first->record.ft_sequence, 20'000u);
  EXPECT_EQ(stream.counters().received, 103u);
  EXPECT_EQ(stream.counters().late + stream.counters().duplicates, 0u);
  const std::vector<Event> events = stream.account().events().take();
  ASSERT_EQ(events.size(), 1u);
  EXPECT_EQ(events[0].kind, EventKind::rebooted);
  EXPECT_EQ(events[0].ft, 20'000u);
  EXPECT_EQ(events[0].previous_ft, 10'000'100u);
  EXPECT_EQ(stream.counters().lost_network, 0u);
  stream.expect_closed();
}

TEST(Sequence, ARebootThatLooksLikeAForwardJumpIsFoundByTheTimeItWouldHaveTaken) {
  Stream stream;
  for (std::uint32_t i = 1; i <= 100; ++i) stream.accept(i, 0x90000000u + i);
  stream.wait(3s);
  stream.accept(1, 20'000);
  EXPECT_TRUE(stream.accept(2, 20'001));
  EXPECT_EQ(stream.counters().reboots, 1u);
  EXPECT_EQ(stream.counters().lost_network, 0u);
  stream.expect_closed();
}

TEST(Sequence, ARebootWhoseFirstTwoRecordsOvertakeEachOtherLosesNeither) {
  Stream stream;
  for (std::uint32_t i = 1; i <= 100; ++i) stream.accept(i, 10'000'000 + i);
  stream.wait(3s);
  EXPECT_FALSE(stream.accept(2, 20'001));
  EXPECT_TRUE(stream.accept(1, 20'000));
  const auto second = stream.account().take_confirmed();
  ASSERT_TRUE(second);
  EXPECT_EQ(second->record.ft_sequence, 20'001u);
  EXPECT_TRUE(stream.accept(3, 20'002));
  EXPECT_EQ(stream.counters().reboots, 1u);
  EXPECT_EQ(stream.counters().received, 103u);
  EXPECT_EQ(stream.counters().reordered, 1u);
  EXPECT_EQ(stream.counters().late + stream.counters().duplicates, 0u);
  stream.expect_closed();
}

TEST(Sequence, ARebootIntoAnotherRateIsARebootToo) {
  Stream stream(7);
  for (std::uint32_t i = 1; i <= 100; ++i) stream.accept(i, 10'000'000 + 7 * i);
  stream.wait(3s);
  for (std::uint32_t i = 0; i < 50; ++i) EXPECT_EQ(stream.accept(1 + i, 20'000 + 2 * i), i > 0);
  EXPECT_EQ(stream.counters().reboots, 1u);
  EXPECT_EQ(stream.counters().received, 150u);
  EXPECT_EQ(stream.counters().irregular, 49u);
  EXPECT_EQ(stream.counters().late + stream.counters().duplicates, 0u);
  stream.expect_closed();
}

TEST(Sequence, ARebootIsConfirmedByARecordThatCouldBelongToAStreamBefore) {
  Stream stream;
  stream.accept(1, 1001);
  stream.accept(1, 2001);
  ASSERT_EQ(stream.counters().restarts, 1u);
  stream.accept(999'004, 1'000'000);
  EXPECT_TRUE(stream.accept(999'005, 1'000'005)) << "on the line on which the first stream was";
  EXPECT_EQ(stream.counters().reboots, 1u);
  EXPECT_EQ(stream.counters().received, 4u);
  EXPECT_TRUE(stream.account().take_confirmed());
  stream.expect_closed();
}

TEST(Sequence, ASingleStrayRecordIsNoReboot) {
  Stream stream;
  for (std::uint32_t i = 1; i <= 100; ++i) {
    stream.accept(i, 10'000'000 + i);
    if (i % 10 == 0) {
      EXPECT_FALSE(stream.accept(i / 10, i / 10));
    }
  }
  EXPECT_EQ(stream.counters().reboots, 0u);
  EXPECT_EQ(stream.counters().received, 100u);
  stream.expect_closed();
}

TEST(Sequence, ABoxThatBootsWithinSecondsOfItsFirstBootIsRecognisedToo) {
  Stream stream;
  for (std::uint32_t i = 1; i <= 1000; ++i) stream.accept(i, 10'000 + i);
  EXPECT_FALSE(stream.accept(1, 1));
  for (std::uint32_t i = 2; i <= 11'000; ++i) EXPECT_TRUE(stream.accept(i, i));
  EXPECT_EQ(stream.counters().reboots, 1u);
  EXPECT_EQ(stream.counters().received, 12'000u);
  stream.expect_closed();
}

TEST(Sequence, ABurstOfLateRecordsFromBeforeARestartIsNoReboot) {
  Stream stream;
  for (std::uint32_t i = 1; i <= 100; ++i) {
    if (i < 50 || i >= 60) stream.accept(i, 5000 + i);
  }
  for (std::uint32_t i = 1; i <= 10; ++i) stream.accept(i, 5100 + i);
  for (std::uint32_t i = 50; i < 60; ++i) EXPECT_FALSE(stream.accept(i, 5000 + i));
  EXPECT_EQ(stream.counters().reboots, 0u);
  EXPECT_EQ(stream.counters().late, 10u);
  stream.expect_closed();
}

TEST(Sequence, NamesARestartWithItsNumbers) {
  Stream stream;
  stream.accept(2000, 70'000);
  stream.accept(1, 70'050);
  const std::vector<Event> events = stream.account().events().take();
  ASSERT_EQ(events.size(), 1u);
  EXPECT_EQ(events[0].kind, EventKind::restarted);
  EXPECT_EQ(events[0].previous_rdt, 2000u);
  EXPECT_EQ(events[0].rdt, 1u);
  EXPECT_EQ(events[0].records, 49u);
  EXPECT_NE(to_string(events[0]).find("rdt 1 after 2000"), std::string::npos);
}

TEST(Sequence, NamesAStallOnceAndItsEnd) {
  Stream stream;
  stream.accept(1, 100);
  for (std::uint32_t i = 2; i <= 30; ++i) EXPECT_FALSE(stream.accept(i, 100));
  EXPECT_TRUE(stream.accept(31, 101));
  EXPECT_TRUE(stream.accept(32, 102));
  const std::vector<Event> events = stream.account().events().take();
  ASSERT_EQ(events.size(), 2u);
  EXPECT_EQ(events[0].kind, EventKind::stalled);
  EXPECT_EQ(events[1].kind, EventKind::stall_ended);
  EXPECT_EQ(events[1].records, 29u);
  EXPECT_EQ(stream.counters().irregular, 0u);
  stream.expect_closed();
}

TEST(Sequence, AStreamThatBeginsAnewWhileTheMeasurementStandsStillHasBegunAnew) {
  Stream stream;
  for (std::uint32_t i = 1; i <= 10; ++i) stream.accept(i, 100 + i);
  for (std::uint32_t i = 11; i <= 15; ++i) EXPECT_FALSE(stream.accept(i, 110));
  for (std::uint32_t i = 1; i <= 20; ++i) EXPECT_FALSE(stream.accept(i, 110));
  EXPECT_TRUE(stream.accept(21, 111));
  EXPECT_TRUE(stream.accept(22, 112));
  EXPECT_EQ(stream.counters().restarts, 1u);
  EXPECT_EQ(stream.counters().stalled, 25u);
  EXPECT_EQ(stream.counters().irregular, 0u);
  stream.expect_closed();
}

TEST(Sequence, KeepsTheOldestEventsAndCountsTheOthers) {
  Stream stream;
  for (std::uint32_t i = 0; i < 100; ++i) stream.accept(1, 100 + i);
  EXPECT_EQ(stream.counters().restarts, 99u);
  EXPECT_EQ(stream.account().events().dropped(), 99 - EventLog::kCapacity);
  EXPECT_EQ(stream.account().events().take().size(), EventLog::kCapacity);
}

TEST(Sequence, AStreamOfWholeDuplicatesIsNeverTakenForAReboot) {
  Stream stream;
  for (std::uint32_t first = 1; first < 20'000; first += 400) {
    for (int copy = 0; copy < 2; ++copy) {
      for (std::uint32_t i = 0; i < 400; ++i) EXPECT_EQ(stream.accept(first + i, 9'000 + first + i), copy == 0);
    }
  }
  EXPECT_EQ(stream.counters().duplicates, 20'000u);
  EXPECT_EQ(stream.counters().received, 20'000u);
  EXPECT_EQ(stream.counters().reboots, 0u);
}

TEST(Sequence, AMeasurementThatStandsStillIsNotDelivered) {
  Stream stream;
  stream.accept(1, 100);
  for (std::uint32_t i = 2; i < 50; ++i) EXPECT_FALSE(stream.accept(i, 100));
  EXPECT_EQ(stream.counters().stalled, 48u);
  EXPECT_TRUE(stream.accept(50, 101));
  stream.expect_closed();
}

TEST(Sequence, ALostHourIsCountedWhenAnHourHasPassed) {
  Stream stream;
  stream.accept(1, 100);
  stream.wait(3600s);
  EXPECT_TRUE(stream.accept(1 + 7000 * 3600, 100 + 7000 * 3600));
  EXPECT_EQ(stream.counters().lost_network, 7000u * 3600 - 1);
  stream.expect_closed();
}

TEST(Sequence, AnUnexpectedStrideIsMarked) {
  Stream stream(1);
  stream.accept(1, 100);
  EXPECT_TRUE(stream.accept(2, 107));
  EXPECT_EQ(stream.counters().irregular, 1u);
  EXPECT_EQ(stream.counters().lost_network, 6u);
  stream.expect_closed();
}

TEST(Sequence, ANewSegmentOwesNothingToTheOneBefore) {
  Stream stream;
  stream.accept(1, 100);
  stream.account().begin_segment();
  stream.accept(1, 90'000);
  EXPECT_EQ(stream.counters().lost_network, 0u);
  EXPECT_EQ(stream.counters().restarts, 0u);
  EXPECT_EQ(stream.counters().expected, 2u);
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
    stream.expect_closed();
    EXPECT_LE(c.lost_host, host_lost);
    EXPECT_GE(c.lost_host + 1, host_lost);  // the last may have had no record behind it
    EXPECT_EQ(c.late + c.duplicates, offered - accepted);
    EXPECT_EQ(c.reboots + c.irregular, 0u);
    EXPECT_LE(c.restarts, restarts);
  }
}

}  // namespace
}  // namespace kphi::netbox
