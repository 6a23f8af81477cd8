#include "drivers/netbox/stream/session.hpp"

#include <gmock/gmock.h>

#include "test/drivers/netbox/session_fixture.hpp"

namespace kphi::netbox::session_test {

using namespace std::chrono_literals;
using namespace test;
using testing::ElementsAre;
using testing::IsEmpty;

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
  receive_block(1);
  EXPECT_EQ(session.state(), State::streaming);
  EXPECT_EQ(out.size(), 40u);
  EXPECT_EQ(session.counters().received, 40u);
}

TEST_F(SessionTest, StampsEachRecordWithItsDatagramsArrival) {
  start_streaming();
  out.clear();
  now += 5714us;
  receive_block(41);
  ASSERT_EQ(out.size(), 40u);
  EXPECT_EQ(out.front().arrival(), now);
  EXPECT_EQ(out.back().arrival(), now);
  EXPECT_EQ(out.back().rdt_sequence, 80u);
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
  receive_block(1, 1999);
  EXPECT_EQ(counted(), "");
  EXPECT_EQ(out.size(), 40u);
}

TEST_F(SessionTest, ADelayedDatagramOfAYoungStreamBeforeIsNotTheNewOnesFirst) {
  start_streaming();
  session.stop(now += 100ms);
  session.start(now);
  advance_to_deadline();
  now += 10ms;
  receive_block(601);
  EXPECT_EQ(session.state(), State::starting) << "nobody sends 640 records in 10 ms";
  EXPECT_EQ(session.counters().drained, 1u);
  receive_block(41, 1999);
  EXPECT_EQ(session.state(), State::streaming) << "the first datagram of the new one may be late";
}

TEST_F(SessionTest, ANewStreamIsKnownLateWhenItsFirstDatagramsAreLost) {
  session.start(now);
  advance_to_deadline();
  now += 90ms;
  receive_block(601);
  EXPECT_EQ(session.state(), State::streaming);
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
  receive_block(1, 5999);
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
  receive(records(2001, 1000, 40));
  EXPECT_EQ(session.state(), State::streaming) << "the first start may have arrived and all its datagrams been lost";
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

TEST_F(SessionTest, CallsAStreamSilentAfterItsTimeoutAndTakesItUpAgainAndNamesBoth) {
  start_streaming();
  const Duration silence = settings.silence_timeout + 3 * settings.datagram_period();
  EXPECT_EQ(session.deadline(), now + silence);
  advance_to_deadline();
  EXPECT_EQ(session.state(), State::silent);
  EXPECT_EQ(session.deadline(), kNever);
  EXPECT_THAT(told(), IsEmpty()) << "another client may have the box: it is not fought over";
  receive_block(41 + 4000);
  EXPECT_EQ(session.state(), State::streaming);
  session.flush(out);
  EXPECT_EQ(counted(), "lost 4000");
  const std::vector<Event> events = session.take_events();
  ASSERT_EQ(events.size(), 2u);
  EXPECT_EQ(events[0].kind, EventKind::silent);
  EXPECT_EQ(events[0].at, now);
  EXPECT_EQ(events[1].kind, EventKind::resumed);
  EXPECT_EQ(events[1].ft, 5040u);
  EXPECT_THAT(session.take_events(), IsEmpty());
}

TEST_F(SessionTest, CountsWhatIsMissingAcrossItsOwnRestartFromSilence) {
  start_streaming();
  advance_to_deadline();
  session.start(now);
  advance_to_deadline();
  receive_block(1, 6039);
  session.flush(out);
  EXPECT_EQ(counted(), "lost 5000, restarts 1");
  EXPECT_EQ(session.counters().expected, 5080u);
}

TEST_F(SessionTest, CountsNothingMissingBetweenAStopAndTheNextStart) {
  start_streaming();
  session.stop(now);
  now += 10s;
  start_streaming(71'040);
  EXPECT_EQ(counted(), "");
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

TEST_F(SessionTest, NamesTroubleOfTheBoxOnceForEachTimeItRises) {
  start_streaming();
  std::uint32_t sent = 40;
  const auto receive_with = [&](std::uint32_t status) {
    Bytes datagram;
    test::put_record(datagram, 1 + sent, 1000 + sent, status);
    test::put_record(datagram, 2 + sent, 1001 + sent);
    sent += 2;
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
  EXPECT_EQ(session.counters().received, 52u) << "its records are delivered all the same";
}

TEST_F(SessionTest, ABiasOnABoxThatKeepsStreamingIsOneRequest) {
  start_streaming();
  told();
  session.set_bias(now);
  EXPECT_THAT(told(), ElementsAre(0x42));
  stream_until(now + 300ms);
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
  receive_block(1, 2539);
  advance_to_deadline();
  EXPECT_THAT(told(), IsEmpty());
  EXPECT_EQ(session.state(), State::streaming);
  session.flush(out);
  EXPECT_EQ(counted(), "lost 1500, restarts 1") << "what the box measured meanwhile is accounted for";
}

TEST_F(SessionTest, ABiasThatABusyBoxTakesLateIsFollowedByAStart) {
  start_streaming();
  told();
  session.set_bias(now);
  EXPECT_THAT(told(), ElementsAre(0x42));
  const Instant taken = now + 300ms;
  stream_until(taken);
  EXPECT_THAT(told(), IsEmpty()) << "the stream goes on";
  advance_to_deadline();
  EXPECT_THAT(told(), ElementsAre(3));
  EXPECT_EQ(session.state(), State::streaming) << "long before it would count as silent";
  EXPECT_LT(now - taken, settings.silence_timeout / 2);
}

TEST_F(SessionTest, AStopAndAStartForgetTheBiasBefore) {
  start_streaming();
  session.set_bias(now);
  session.start(now);
  advance_to_deadline();
  EXPECT_EQ(session.deadline(), now + settings.reply_timeout + 2 * settings.datagram_period());
  receive_block(1, 1039);
  session.set_bias(now);
  session.stop(now);
  EXPECT_EQ(session.deadline(), kNever);
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
  receive_block(41);
  EXPECT_THAT(told(), IsEmpty()) << "was on its way";
  now += settings.settle;
  receive_block(81);
  EXPECT_THAT(told(), ElementsAre(0));
  EXPECT_EQ(out.size(), 40u);
  EXPECT_EQ(session.counters().drained, 2u);
}

}  // namespace kphi::netbox::session_test
