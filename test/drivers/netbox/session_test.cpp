#include "drivers/netbox/session.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "test/drivers/netbox/record_bytes.hpp"

namespace kphi::netbox {
namespace {

using namespace std::chrono_literals;
using test::Bytes;
using test::records;
using testing::ElementsAre;
using testing::IsEmpty;

class SessionTest : public testing::Test {
 protected:
  /// What the session wants the box to be told, as command codes.
  std::vector<int> told() {
    std::vector<int> commands;
    std::array<std::uint8_t, 8> request;
    while (session.next_request(request)) {
      EXPECT_EQ(request[0], 0x12);
      EXPECT_EQ(request[1], 0x34);
      EXPECT_THAT(std::vector(request.begin() + 4, request.end()), testing::Each(0));
      commands.push_back(request[2] << 8 | request[3]);
    }
    return commands;
  }
  void advance_to_deadline() {
    ASSERT_NE(session.deadline(), kNever);
    now = session.deadline();
    session.advance(now);
  }
  void receive(const Bytes& datagram) { session.receive(datagram, now, out); }
  void start_streaming(std::uint32_t ft = 1000) {
    session.start(now);
    advance_to_deadline();
    told();
    receive(records(1, ft, 40));
    ASSERT_EQ(session.state(), State::streaming);
  }

  Instant now = 1s;
  StreamSettings settings;
  Session session{settings};
  std::vector<StampedRecord> out;
};

TEST_F(SessionTest, DoesNothingUnasked) {
  EXPECT_EQ(session.state(), State::idle);
  EXPECT_EQ(session.deadline(), kNever);
  EXPECT_THAT(told(), IsEmpty());
}

TEST_F(SessionTest, StopsWaitsForSilenceAndStarts) {
  session.start(now);
  EXPECT_EQ(session.state(), State::starting);
  EXPECT_THAT(told(), ElementsAre(0));
  EXPECT_EQ(session.deadline(), now + settings.settle);
  session.advance(now);
  EXPECT_THAT(told(), IsEmpty());
  advance_to_deadline();
  EXPECT_THAT(told(), ElementsAre(3));
  receive(records(1, 1000, 40));
  EXPECT_EQ(session.state(), State::streaming);
  EXPECT_EQ(out.size(), 40u);
  EXPECT_EQ(session.counters().received, 40u);
}

TEST_F(SessionTest, AsksForRealTimeModeWhenTold) {
  settings.buffered = false;
  Session real_time(settings);
  real_time.start(now);
  real_time.advance(now + settings.settle);
  std::array<std::uint8_t, 8> request;
  ASSERT_TRUE(real_time.next_request(request));
  ASSERT_TRUE(real_time.next_request(request));
  EXPECT_EQ(request, encode_request(Command::real_time));
}

TEST_F(SessionTest, AsksForMultiUnitModeWhenTold) {
  settings.buffered = false;
  settings.multi_unit = true;
  Session several(settings);
  several.start(now);
  several.advance(now + settings.settle);
  std::array<std::uint8_t, 8> request;
  ASSERT_TRUE(several.next_request(request));
  ASSERT_TRUE(several.next_request(request));
  EXPECT_EQ(request, encode_request(Command::multi_unit));
}

TEST_F(SessionTest, ResetsTheLatchWithoutTouchingTheStream) {
  start_streaming();
  const Instant due = session.deadline();
  session.reset_latch();
  EXPECT_THAT(told(), ElementsAre(0x41));
  EXPECT_EQ(session.deadline(), due);
  EXPECT_EQ(session.state(), State::streaming);
}

TEST_F(SessionTest, StampsEachRecordWithItsDatagramsArrival) {
  start_streaming();
  out.clear();
  now += 5714us;
  receive(records(41, 1040, 40));
  ASSERT_EQ(out.size(), 40u);
  EXPECT_EQ(out.front().arrival, now);
  EXPECT_EQ(out.back().arrival, now);
  EXPECT_EQ(out.back().record.rdt_sequence, 80u);
}

TEST_F(SessionTest, DiscardsWhatAnOldStreamStillSendsAndWaitsForItsEnd) {
  session.start(now);
  told();
  for (int i = 0; i < 3; ++i) {
    now += 3ms;
    receive(records(90'000 + 40 * i, 1000 + 40 * i, 40));
    session.advance(now);
    EXPECT_EQ(session.deadline(), now + settings.settle);
  }
  EXPECT_THAT(out, IsEmpty());
  EXPECT_EQ(session.counters().drained, 3u);
  EXPECT_THAT(told(), ElementsAre(0)) << "the stop was lost and must be repeated, but not for each datagram";
  advance_to_deadline();
  EXPECT_THAT(told(), ElementsAre(3));
  receive(records(1, 2000, 40));
  EXPECT_EQ(session.counters().restarts, 0u);
  EXPECT_EQ(session.counters().lost_network, 0u);
  EXPECT_EQ(out.size(), 40u);
}

TEST_F(SessionTest, StartsAnywayWhenTheOldStreamDoesNotEnd) {
  session.start(now);
  const Instant begun = now;
  std::vector<int> commands;
  for (std::uint32_t i = 0; now < begun + 1s; ++i) {
    now += 1ms;
    receive(records(90'000 + i, 1000 + i));
    session.advance(now);
    commands = told();
    if (!commands.empty() && commands.back() == 3) break;
  }
  EXPECT_LE(now - begun, 20 * settings.settle + 1ms);
  ASSERT_FALSE(commands.empty());
  now += 2 * settings.settle;
  receive(records(95'000, 5000));  // still the old one
  EXPECT_EQ(session.state(), State::starting);
  EXPECT_THAT(told(), IsEmpty()) << "a stop now would end the stream that was just asked for";
  receive(records(1, 6000, 40));
  EXPECT_EQ(session.state(), State::streaming);
  EXPECT_EQ(session.counters().expected, 40u);
}

TEST_F(SessionTest, RepeatsALostStartWithGrowingPatience) {
  session.start(now);
  EXPECT_THAT(told(), ElementsAre(0));
  advance_to_deadline();
  EXPECT_THAT(told(), ElementsAre(3));
  const Duration two_periods = 2 * settings.datagram_period();
  for (const Duration patience : {100ms, 200ms, 400ms, 400ms}) {
    EXPECT_EQ(session.deadline(), now + patience + two_periods);
    advance_to_deadline();
    EXPECT_THAT(told(), ElementsAre(3));
    EXPECT_EQ(session.state(), State::starting);
  }
  receive(records(1, 1000, 40));
  EXPECT_EQ(session.state(), State::streaming);
}

TEST_F(SessionTest, GivesUpAfterItsAttemptsAndSaysSo) {
  session.start(now);
  std::vector<int> all;
  for (int i = 0; i < 100 && session.state() == State::starting; ++i) {
    for (const int command : told()) all.push_back(command);
    advance_to_deadline();
  }
  for (const int command : told()) all.push_back(command);
  EXPECT_EQ(session.state(), State::failed);
  EXPECT_EQ(session.deadline(), kNever);
  EXPECT_LT(now, 1s + 3s);
  EXPECT_THAT(all, ElementsAre(0, 3, 3, 3, 3, 3, 3, 0)) << "in case the box streams where we cannot see it";
}

TEST_F(SessionTest, CanBeStartedAgainAfterAFailure) {
  session.start(now);
  while (session.state() == State::starting) advance_to_deadline();
  told();
  start_streaming();
  EXPECT_EQ(session.counters().expected, 40u);
}

TEST_F(SessionTest, WaitsAsLongAsASlowBoxNeedsToFillADatagram) {
  settings.divisor = 7000;  // 1 Hz: 40 s
  Session slow(settings);
  slow.start(now);
  now = slow.deadline();
  slow.advance(now);
  EXPECT_GE(slow.deadline() - now, 80s);
  now += 41s;
  slow.advance(now);
  EXPECT_EQ(slow.state(), State::starting);
  slow.receive(records(1, 7000, 40, 7000), now, out);
  EXPECT_EQ(slow.state(), State::streaming);
  for (std::uint32_t i = 1; i < 10; ++i) {
    now += 40s;
    slow.advance(now);
    slow.receive(records(1 + 40 * i, 7000 + 7000 * 40 * i, 40, 7000), now, out);
    EXPECT_EQ(slow.state(), State::streaming);
  }
  EXPECT_EQ(out.size(), 400u);
  EXPECT_EQ(slow.counters().expected, 400u);
}

TEST_F(SessionTest, CallsAStreamSilentAfterItsTimeoutAndTakesItUpAgain) {
  start_streaming();
  const Duration silence = settings.silence_timeout + 3 * settings.datagram_period();
  EXPECT_EQ(session.deadline(), now + silence);
  advance_to_deadline();
  EXPECT_EQ(session.state(), State::silent);
  EXPECT_EQ(session.deadline(), kNever);
  EXPECT_THAT(told(), IsEmpty()) << "another client may have the box: it is not fought over";
  receive(records(41 + 4000, 1040 + 4000, 40));
  EXPECT_EQ(session.state(), State::streaming);
  session.flush(out);
  EXPECT_EQ(session.counters().lost_network, 4000u);
}

TEST_F(SessionTest, CountsWhatIsMissingAcrossItsOwnRestartFromSilence) {
  start_streaming();
  advance_to_deadline();
  session.start(now);
  advance_to_deadline();
  receive(records(1, 1040 + 5000, 40));
  session.flush(out);
  EXPECT_EQ(session.counters().restarts, 1u);
  EXPECT_EQ(session.counters().lost_network, 5000u);
  EXPECT_EQ(session.counters().expected, 5080u);
}

TEST_F(SessionTest, CountsNothingMissingBetweenAStopAndTheNextStart) {
  start_streaming();
  session.stop(now);
  now += 10s;
  start_streaming(71'040);
  EXPECT_EQ(session.counters().lost_network, 0u);
  EXPECT_EQ(session.counters().restarts, 0u);
  EXPECT_EQ(session.counters().expected, 80u);
  EXPECT_EQ(session.counters().received, 80u);
}

TEST_F(SessionTest, ARepeatedMeasurementDoesNotKeepTheStreamAlive) {
  start_streaming();
  const Instant due = session.deadline();
  for (std::uint32_t i = 0; now < due; ++i) {
    now += 5ms;
    Bytes stale;
    test::put_record(stale, 41 + i, 1039);
    receive(stale);
  }
  session.advance(now);
  EXPECT_EQ(session.state(), State::silent);
  EXPECT_EQ(out.size(), 40u);
}

TEST_F(SessionTest, NamesTheSilenceAndItsEnd) {
  start_streaming();
  advance_to_deadline();
  receive(records(41 + 4000, 1040 + 4000, 40));
  const std::vector<Event> events = session.take_events();
  ASSERT_EQ(events.size(), 2u);
  EXPECT_EQ(events[0].kind, EventKind::silent);
  EXPECT_EQ(events[0].at, now);
  EXPECT_EQ(events[1].kind, EventKind::resumed);
  EXPECT_EQ(events[1].ft, 5040u);
  EXPECT_THAT(session.take_events(), IsEmpty());
}

TEST_F(SessionTest, NamesTroubleOfTheBoxOnceForEachTimeItRises) {
  start_streaming();
  std::uint32_t sent = 40;
  const auto receive_with = [&](std::uint32_t status) {
    Bytes datagram;
    test::put_record(datagram, 1 + sent, 1000 + sent, status);
    ++sent;
    receive(datagram);
  };
  for (const std::uint32_t status : {0x80100000u, 0x80100000u, 0u, 0x80400000u, 0x80500000u, 0x80020000u})
    receive_with(status);
  const std::vector<Event> events = session.take_events();
  ASSERT_EQ(events.size(), 3u);
  EXPECT_EQ(events[0].status, 1u << 20);
  EXPECT_EQ(events[1].status, 1u << 22);
  EXPECT_EQ(events[2].status, 1u << 20 | 1u << 22);
  EXPECT_THAT(to_string(events[1]), testing::HasSubstr("network communication failure"));
  EXPECT_EQ(session.counters().received, 46u) << "its records are delivered all the same";
}

TEST_F(SessionTest, PutsSwappedDatagramsInOrder) {
  start_streaming();
  now += 5ms;
  receive(records(81, 1080, 40));
  EXPECT_EQ(out.size(), 40u);
  EXPECT_EQ(session.release_deadline(), now + settings.reorder_patience);
  EXPECT_EQ(session.counters().lost_network, 0u);
  now += 1ms;
  receive(records(41, 1040, 40));
  ASSERT_EQ(out.size(), 120u);
  for (std::uint32_t i = 0; i < 120; ++i) EXPECT_EQ(out[i].record.ft_sequence, 1000 + i);
  EXPECT_EQ(session.release_deadline(), kNever);
  EXPECT_EQ(session.counters().lost_network + session.counters().late, 0u);
}

TEST_F(SessionTest, GivesUpAGapWhenItsTimeIsOverWithoutAFurtherDatagram) {
  start_streaming();
  receive(records(81, 1080, 40));
  now = session.release_deadline();
  session.release(now, out);
  EXPECT_EQ(out.size(), 80u);
  EXPECT_EQ(session.counters().lost_network, 40u);
  receive(records(41, 1040, 40));
  EXPECT_EQ(session.counters().late, 40u);
  EXPECT_EQ(out.size(), 80u);
}

TEST_F(SessionTest, WhatWaitsKeepsTheStreamAlive) {
  start_streaming();
  now += 400ms;
  receive(records(81, 1080, 40));
  EXPECT_GT(session.deadline(), now + 500ms);
}

TEST_F(SessionTest, ABiasOnABoxThatKeepsStreamingIsOneRequest) {
  start_streaming();
  told();
  session.set_bias(now);
  EXPECT_THAT(told(), ElementsAre(0x42));
  const Instant end = now + 300ms;
  for (std::uint32_t i = 1; now < end; ++i) {
    now += settings.datagram_period();
    receive(records(1 + 40 * i, 1000 + 40 * i, 40));
    session.advance(now);
  }
  EXPECT_THAT(told(), IsEmpty());
  EXPECT_EQ(session.counters().lost_network, 0u);
}

TEST_F(SessionTest, ABiasOnABoxThatStopsIsFollowedByAStart) {
  start_streaming();
  told();
  session.set_bias(now);
  EXPECT_THAT(told(), ElementsAre(0x42));
  EXPECT_EQ(session.deadline(), now + 3 * settings.datagram_period() + settings.bias_patience);
  advance_to_deadline();
  EXPECT_THAT(told(), ElementsAre(3));
  advance_to_deadline();
  EXPECT_THAT(told(), ElementsAre(3)) << "a start can be lost";
  now = session.deadline() - 1ms;
  receive(records(1, 1040 + 1500, 40));
  advance_to_deadline();
  EXPECT_THAT(told(), IsEmpty());
  EXPECT_EQ(session.state(), State::streaming);
  session.flush(out);
  EXPECT_EQ(session.counters().lost_network, 1500u) << "what the box measured meanwhile is accounted for";
  EXPECT_EQ(session.counters().restarts, 1u);
}

TEST_F(SessionTest, ABiasWithoutAStreamIsNotSent) {
  session.set_bias(now);
  EXPECT_THAT(told(), IsEmpty());
  EXPECT_EQ(session.deadline(), kNever);
}

TEST_F(SessionTest, StopsAndRepeatsTheStopWhileTheBoxGoesOn) {
  start_streaming();
  session.stop(now);
  EXPECT_EQ(session.state(), State::idle);
  EXPECT_THAT(told(), ElementsAre(0));
  receive(records(41, 1040, 40));
  EXPECT_THAT(told(), IsEmpty()) << "was on its way";
  now += settings.settle;
  receive(records(81, 1080, 40));
  EXPECT_THAT(told(), ElementsAre(0));
  EXPECT_EQ(out.size(), 40u);
  EXPECT_EQ(session.counters().drained, 2u);
}

TEST_F(SessionTest, CountsWrongSizesAndGoesOn) {
  start_streaming();
  for (const std::size_t size : {0u, 35u, 37u, 71u, 1476u}) receive(Bytes(size, 0));
  EXPECT_EQ(session.counters().malformed, 5u);
  receive(records(41, 1040, 40));
  EXPECT_EQ(session.counters().received, 80u);
  EXPECT_EQ(session.counters().datagrams, 7u);
}

TEST_F(SessionTest, TakesDatagramsOfAnySizeInOneStream) {
  start_streaming();
  std::uint32_t sent = 40;
  for (unsigned count = 1; count <= 40; ++count) {
    receive(records(1 + sent, 1000 + sent, count));
    sent += count;
  }
  EXPECT_EQ(session.counters().received, sent);
  EXPECT_EQ(session.counters().expected, sent);
}

TEST_F(SessionTest, ChargesTheHostWithWholeDatagrams) {
  start_streaming();
  session.note_host_drops(3);
  receive(records(41 + 160, 1040 + 160, 40));  // four datagrams missing, three of them dropped here
  session.flush(out);
  EXPECT_EQ(session.counters().lost_host, 120u);
  EXPECT_EQ(session.counters().lost_network, 40u);
  session.note_host_drops(3);
  receive(records(241 + 40, 1240 + 40, 40));
  EXPECT_EQ(session.counters().lost_network, 40u) << "one datagram may have been overtaken";
  session.flush(out);
  EXPECT_EQ(session.counters().lost_host, 120u);
  EXPECT_EQ(session.counters().lost_network, 80u);
}

TEST_F(SessionTest, ADuplicatedStartLosesNothing) {
  start_streaming();
  for (std::uint32_t i = 0; i < 50; ++i) {
    now += 5ms;
    receive(records(1 + 40 * i, 1040 + 40 * i, 40));
  }
  EXPECT_EQ(session.counters().restarts, 1u);
  EXPECT_EQ(session.counters().received, 2040u);
  EXPECT_EQ(session.counters().expected, 2040u);
}

TEST_F(SessionTest, StreamsAcrossBothWraps) {
  session.start(now);
  advance_to_deadline();
  receive(records(1, 0xffffffff - 50, 1));
  std::uint32_t rdt = 2, ft = 0xffffffff - 49;
  for (int i = 0; i < 10; ++i, rdt += 40, ft += 40) receive(records(rdt, ft, 40));
  EXPECT_EQ(session.counters().received, 401u);
  EXPECT_EQ(session.counters().expected, 401u);
}

TEST_F(SessionTest, TheShortWayCountsAsTheLongOne) {
  start_streaming();
  std::vector<StampedRecord> room(40);
  for (std::uint32_t i = 1; i <= 50; ++i) {
    const Bytes datagram = records(1 + 40 * i, 1000 + 40 * i, 40);
    ASSERT_EQ(session.receive_in_order(datagram, now += 5ms, room), 40u);
    for (std::uint32_t j = 0; j < 40; ++j) {
      EXPECT_EQ(room[j].record.rdt_sequence, 1 + 40 * i + j);
      EXPECT_EQ(room[j].arrival, now);
    }
  }
  EXPECT_EQ(session.counters().datagrams, 51u);
  EXPECT_EQ(session.counters().received, 2040u);
  EXPECT_EQ(session.counters().expected, 2040u);
  EXPECT_GT(session.deadline(), now + 500ms);
}

TEST_F(SessionTest, TheShortWayTakesNothingOutOfOrder) {
  std::vector<StampedRecord> room(40);
  EXPECT_EQ(session.receive_in_order(records(1, 1000, 40), now, room), 0u) << "it does not stream";
  start_streaming();
  Bytes broken = records(41, 1040, 40);
  broken[36 * 20 + 3] ^= 1;  // rdt of one in the middle
  Bytes jumping = records(41, 1040, 40);
  jumping[36 * 20 + 7] ^= 1;  // ft
  for (const Bytes& datagram : {records(42, 1041, 40), records(41, 1041, 40), records(1, 1000, 40), broken, jumping,
                                Bytes(35, 0), Bytes(1476, 0), Bytes{}})
    EXPECT_EQ(session.receive_in_order(datagram, now, room), 0u);
  EXPECT_EQ(session.receive_in_order(records(41, 1040, 40), now, std::span(room).first(39)), 0u) << "no room";
  EXPECT_EQ(session.counters().datagrams, 1u);
  receive(records(81, 1080, 40));
  EXPECT_EQ(session.receive_in_order(records(41, 1040, 40), now, room), 0u) << "others wait for it";
  receive(records(41, 1040, 40));
  EXPECT_EQ(session.counters().received, 120u);
}

TEST_F(SessionTest, TheShortWayHearsOfTroubleToo) {
  start_streaming();
  std::vector<StampedRecord> room(2);
  Bytes datagram;
  test::put_record(datagram, 41, 1040);
  test::put_record(datagram, 42, 1041, 0x80400000);
  EXPECT_EQ(session.receive_in_order(datagram, now, room), 2u);
  const std::vector<Event> events = session.take_events();
  ASSERT_EQ(events.size(), 1u);
  EXPECT_EQ(events[0].kind, EventKind::box_trouble);
  EXPECT_EQ(events[0].ft, 1040u);
}

TEST_F(SessionTest, NeverAllocatesInTheCallersVectorOnceItIsLargeEnough) {
  start_streaming();
  out.clear();
  out.reserve(40);
  const StampedRecord* const place = out.data();
  for (std::uint32_t i = 1; i < 100; ++i) {
    out.clear();
    receive(records(1 + 40 * i, 1000 + 40 * i, 40));
    EXPECT_EQ(out.size(), 40u);
  }
  EXPECT_EQ(out.data(), place);
}

// A channel between a box and the session: loses, repeats, swaps and damages whole datagrams, the socket drops some,
// the stream begins anew. The account must close, and name the host's share.
TEST(SessionProperty, TheAccountClosesForEveryChannel) {
  for (unsigned seed = 0; seed < 200; ++seed) {
    std::mt19937 random(seed);
    const auto chance = [&](unsigned in) { return random() % in == 0; };
    StreamSettings settings;
    settings.divisor = 1 + random() % 100;
    settings.records_per_datagram = static_cast<int>(1 + random() % 40);
    const auto k = static_cast<unsigned>(settings.records_per_datagram);
    Session session(settings);
    std::vector<StampedRecord> out;
    Instant now = 1s;
    session.start(now);
    session.advance(now = session.deadline());
    std::uint32_t rdt = 1, ft = random();
    std::uint64_t malformed = 0, dropped = 0, dropped_seen = 0;
    for (int i = 0; i < 400; ++i, rdt += k, ft += k * settings.divisor) {
      if (chance(100)) rdt = 1;
      now += settings.datagram_period();
      const Bytes datagram = records(rdt, ft, k, settings.divisor);
      if (i > 0 && chance(20)) {
        if (chance(2)) ++dropped;
        continue;
      }
      if (chance(30)) {
        session.receive(std::span(datagram).first(datagram.size() - 1 - random() % 35), now, out);
        ++malformed;
        continue;
      }
      session.note_host_drops(dropped);
      dropped_seen = dropped;
      session.receive(datagram, now, out);
      if (chance(25)) session.receive(datagram, now, out);
    }
    session.flush(out);
    const Counters& c = session.counters();
    EXPECT_EQ(c.expected, c.received + c.lost_network + c.lost_host) << seed;
    EXPECT_EQ(c.received, out.size()) << seed;
    EXPECT_EQ(c.lost_host, dropped_seen * k) << seed;
    EXPECT_EQ(c.malformed, malformed) << seed;
    EXPECT_EQ(c.reboots + c.late, 0u) << seed;
    for (std::size_t i = 1; i < out.size(); ++i)
      ASSERT_GT(static_cast<std::int32_t>(out[i].record.ft_sequence - out[i - 1].record.ft_sequence), 0) << seed;
  }
}

TEST(SessionProperty, RandomDatagramsNeverBreakTheAccount) {
  std::mt19937 random(3);
  Session session{StreamSettings{}};
  std::vector<StampedRecord> out;
  Instant now = 1s;
  session.start(now);
  for (int i = 0; i < 20'000; ++i) {
    Bytes datagram(random() % 2 == 0 ? 36 * (1 + random() % 40) : random() % 1500);
    for (auto& byte : datagram) byte = static_cast<std::uint8_t>(random() % 4);
    now += Duration(random() % 100'000'000);
    out.clear();
    session.receive(datagram, now, out);
    session.advance(now);
    const Counters& c = session.counters();
    ASSERT_EQ(c.expected, c.received + c.lost_network + c.lost_host);
  }
}

}  // namespace
}  // namespace kphi::netbox
