// The connection in virtual time: what it does about silences, answers and changed configurations.
#include "drivers/netbox/stream/connection.hpp"

#include <gmock/gmock.h>

#include <cmath>

#include "test/drivers/netbox/record_bytes.hpp"

namespace kphi::netbox::connection_test {

using namespace std::chrono_literals;
using namespace test;
using testing::ElementsAre;
using testing::IsEmpty;

std::string page(const char* element = "comrdtrate", const char* content = "7000") {
  return with(with(with(captured_xml(), "comrdtrate", "7000"), "comrdtbsiz", "40"), element, content);
}
Answer answer_of(const std::string& xml) {
  return ask_box([&] { return xml; });
}
Answer no_answer() {
  return ask_box([]() -> std::string { throw std::runtime_error("refused"); });
}
const std::string kForgottenPeaks = page("runpkmx", "0;0;0;0;0;0");

class ConnectionTest : public testing::Test {
 protected:
  /// Commands to the box's RDT port.
  std::vector<int> requested() {
    std::vector<int> commands;
    std::array<std::uint8_t, 8> request;
    while (connection.next_request(request)) commands.push_back(request[2] << 8 | request[3]);
    return commands;
  }
  std::vector<EventKind> events() {
    std::vector<EventKind> kinds;
    for (const Event& event : connection.take_events()) kinds.push_back(event.kind);
    return kinds;
  }
  std::size_t taken() {
    connection.deliver();
    return connection.take(out);
  }
  void advance_to_deadline() {
    ASSERT_NE(connection.deadline(), kNever);
    connection.advance(now = connection.deadline());
  }
  /// Records `rdt`, `rdt` + 1, … of one datagram, their ft_sequence 1000 ahead.
  void receive(std::uint32_t rdt, unsigned count = 40, std::uint32_t ft_ahead = 1000, unsigned stride = 1) {
    connection.receive(records(rdt, rdt + ft_ahead, count, stride), now += 1ms);
    connection.advance(now);
  }
  void stream() {
    connection.start(now);
    advance_to_deadline();
    EXPECT_THAT(requested(), ElementsAre(0, 3));
    receive(1);
    ASSERT_EQ(connection.state(), State::streaming);
    EXPECT_EQ(taken(), 40u);
  }
  void fall_silent() {
    advance_to_deadline();
    ASSERT_EQ(connection.state(), State::silent);
    ASSERT_TRUE(connection.next_question());
    EXPECT_FALSE(connection.next_question()) << "each question once";
  }
  /// Answers each question so, until there is none or `end`; returns the times between the questions.
  std::vector<Duration> pauses_until(Instant end, const Answer& given) {
    std::vector<Duration> pauses;
    for (Instant before = now; connection.deadline() != kNever && connection.deadline() <= end; before = now) {
      advance_to_deadline();
      if (!connection.next_question()) continue;
      pauses.push_back(now - before);
      connection.answered(given, now);
    }
    return pauses;
  }
  void answer(Answer given) {
    connection.answered(std::move(given), now += 1ms);
    connection.advance(now);
  }
  void answer_the_next_question(Answer given) {
    advance_to_deadline();
    ASSERT_TRUE(connection.next_question());
    answer(std::move(given));
  }
  void stream_and_fall_silent() {
    stream();
    fall_silent();
  }

  Instant now = 1s;
  Connection connection{parse_configuration(page())};
  std::vector<LoadCellRecord> out = std::vector<LoadCellRecord>(4096);
};

TEST(Answer, SaysHowFarItCame) {
  EXPECT_EQ(no_answer().kind, Answer::Kind::unreachable);
  EXPECT_EQ(answer_of("<html/>").kind, Answer::Kind::unusable);
  EXPECT_EQ(answer_of(page("comrdte", "Disabled")).kind, Answer::Kind::rdt_disabled);
  const Answer ready = answer_of(page());
  EXPECT_EQ(ready.kind, Answer::Kind::ready);
  EXPECT_EQ(ready.configuration->records_per_datagram, 40);
}

TEST_F(ConnectionTest, ABoxThatWasAwayStreamsAgainWhenItAnswers) {
  stream_and_fall_silent();
  answer(no_answer());
  EXPECT_THAT(events(), ElementsAre(EventKind::silent, EventKind::unreachable));
  EXPECT_THAT(requested(), IsEmpty());
  for (int i = 0; i < 3; ++i) answer_the_next_question(no_answer());
  EXPECT_THAT(events(), IsEmpty()) << "the same answer is reported once";
  answer_the_next_question(answer_of(page()));
  EXPECT_THAT(requested(), ElementsAre(0));
  EXPECT_EQ(connection.state(), State::silent) << "until a record arrives";
  advance_to_deadline();
  EXPECT_THAT(requested(), ElementsAre(3));
  receive(1, 40, 5000);
  EXPECT_EQ(connection.state(), State::streaming);
  advance_to_deadline();  // the records are held back behind the gap until then
  EXPECT_EQ(taken(), 40u);
  EXPECT_EQ(connection.counters().reconnects, 1u);
  EXPECT_THAT(events(), testing::Contains(EventKind::reconnected));
}

TEST_F(ConnectionTest, ABoxThatWasAwayInAnyWayIsStartedWhenItIsBack) {
  for (const Answer& away : {no_answer(), answer_of("<html/>"), answer_of(page("comrdte", "Disabled"))}) {
    connection.stop(now);
    (void)requested();
    stream_and_fall_silent();
    answer(away);
    EXPECT_THAT(requested(), IsEmpty());
    answer_the_next_question(answer_of(page()));
    EXPECT_THAT(requested(), ElementsAre(0));
  }
}

TEST_F(ConnectionTest, ABoxThatHasBootedStreamsAgainAtOnceAndAfterTheNextSilenceItIsLeftAlone) {
  stream_and_fall_silent();
  answer(answer_of(kForgottenPeaks));
  EXPECT_THAT(requested(), ElementsAre(0));
  EXPECT_THAT(events(), ElementsAre(EventKind::silent));
  advance_to_deadline();
  receive(1, 40, 5000);
  ASSERT_EQ(connection.state(), State::streaming);
  (void)requested();
  connection.advance(now += 20ms);  // the records held back
  fall_silent();
  answer(answer_of(kForgottenPeaks));
  EXPECT_THAT(requested(), IsEmpty());
}

TEST_F(ConnectionTest, AnAnswerThatComesAfterTheStreamIsNoNews) {
  stream_and_fall_silent();
  receive(41);
  answer(no_answer());
  EXPECT_THAT(events(), ElementsAre(EventKind::silent, EventKind::resumed));
  connection.advance(now += 100ms);
  EXPECT_FALSE(connection.next_question());
}

TEST_F(ConnectionTest, ABoxThatComesBackByItselfIsAskedAgainOnlyAfterItsNextSilence) {
  stream();
  for (const std::uint32_t rdt : {41u, 81u}) {
    fall_silent();
    answer(no_answer());
    EXPECT_THAT(events(), ElementsAre(EventKind::silent, EventKind::unreachable));
    receive(rdt);
    connection.advance(now += 300ms);
    EXPECT_FALSE(connection.next_question());
    EXPECT_THAT(events(), ElementsAre(EventKind::resumed));
  }
}

TEST_F(ConnectionTest, AStreamThatAnotherClientHasTakenIsLeftAlone) {
  stream_and_fall_silent();
  answer(answer_of(page()));
  EXPECT_THAT(events(), ElementsAre(EventKind::silent, EventKind::taken_over));
  EXPECT_EQ(connection.deadline(), kNever);
  connection.advance(now += 100s);
  EXPECT_FALSE(connection.next_question());
  EXPECT_THAT(requested(), IsEmpty());
}

TEST_F(ConnectionTest, AsksLessAndLessOftenUntilItGivesUpABoxThatStaysAway) {
  stream_and_fall_silent();
  const Instant silent = now;
  connection.answered(no_answer(), now);
  EXPECT_THAT(pauses_until(silent + 59s, no_answer()),
              ElementsAre(250ms, 500ms, 1000ms, 2000ms, 4000ms, 8000ms, 8000ms, 8000ms, 8000ms, 8000ms, 8000ms));
  EXPECT_EQ(connection.deadline(), silent + 60s);
  EXPECT_THAT(pauses_until(silent + 1000s, no_answer()), IsEmpty());
  EXPECT_THAT(events(), ElementsAre(EventKind::silent, EventKind::unreachable, EventKind::given_up));
  EXPECT_EQ(connection.state(), State::silent);
}

TEST_F(ConnectionTest, AStartWithoutARecordIsFollowedByAQuestion) {
  stream_and_fall_silent();
  answer(answer_of(kForgottenPeaks));
  while (connection.state() == State::silent && !connection.next_question()) advance_to_deadline();
  EXPECT_EQ(requested().front(), 0);
  answer(answer_of(page()));
  EXPECT_THAT(requested(), testing::Contains(0)) << "started again";
}

TEST_F(ConnectionTest, AfterABootWithTheStreamGoingOnItAsksAndNamesTheChange) {
  stream();
  now += 1s;
  receive(1, 40, 0);
  EXPECT_EQ(connection.counters().reboots, 1u);
  ASSERT_TRUE(connection.next_question());
  answer(answer_of(page("cfgcalsn", "FT99999")));
  EXPECT_THAT(events(), ElementsAre(EventKind::rebooted, EventKind::configuration_changed));
  EXPECT_THAT(requested(), IsEmpty()) << "its records are counted as before";
  EXPECT_EQ(connection.configuration().calibration_serial, "FT99999");
  answer(answer_of("<html/>"));
  EXPECT_THAT(events(), ElementsAre(EventKind::unusable));
  receive(81, 40, 0);
  answer(answer_of(page("comrdtrate", "1000")));
  EXPECT_EQ(taken(), 80u) << "the records held back are delivered before the stream starts again";
}

TEST_F(ConnectionTest, AnotherRateIsStreamedByItsOwnStride) {
  stream_and_fall_silent();
  answer(no_answer());
  answer_the_next_question(answer_of(page("comrdtrate", "1000")));
  EXPECT_EQ(connection.settings().divisor, 7u);
  advance_to_deadline();
  EXPECT_THAT(requested(), ElementsAre(0, 3));
  receive(1, 40, 8999, 7);
  advance_to_deadline();  // what is missing before it may still come
  EXPECT_EQ(taken(), 40u);
  connection.receive(records(41, 9280, 40, 7), now += 1ms);
  connection.receive(records(81, 9560, 40, 7), now += 1ms);
  EXPECT_EQ(connection.take(out), 0u) << "they wait for deliver()";
  EXPECT_TRUE(connection.deliver());
  EXPECT_EQ(connection.take(out), 80u);
  EXPECT_FALSE(connection.deliver());
  const Counters counters = connection.counters();
  EXPECT_EQ(counters.irregular, 0u);
  EXPECT_EQ(counters.received, 160u) << "the counters continue";
  EXPECT_EQ(counters.restarts, 1u);
  EXPECT_EQ(counters.lost_network, 1136u) << "of 7960 counts, by the new stride";
  EXPECT_NEAR(connection.health().datagrams_per_second, 1000, 1) << "of the new rate alone";
}

TEST_F(ConnectionTest, AStopDeliversTheRecordsHeldBack) {
  stream();
  receive(81);
  EXPECT_EQ(taken(), 0u) << "records 41 to 80 may still come";
  connection.stop(now);
  EXPECT_EQ(taken(), 40u);
  EXPECT_EQ(connection.counters().lost_network, 40u);
  EXPECT_EQ(connection.state(), State::idle);
  EXPECT_THAT(requested(), ElementsAre(0));
}

TEST_F(ConnectionTest, CountsTheRecordsThatNobodyTook) {
  stream();
  for (std::uint32_t rdt = 41; rdt < 200'000; rdt += 40) receive(rdt);
  const Counters counters = connection.counters();
  EXPECT_GT(counters.queue_overflows, 0u);
  std::uint64_t all = 40;
  while (const std::size_t count = taken()) all += count;
  EXPECT_EQ(all + counters.queue_overflows, counters.received);
  EXPECT_GE(all, 70'000u) << "10 s";
  EXPECT_GE(connection.health().queue_high_water, 70'000u);
}

/// Datagrams that arrive while the receive thread sleeps.
double gathered(const char* records_per_datagram, double speed = 1) {
  const Connection connection(parse_configuration(page("comrdtbsiz", records_per_datagram)), speed);
  const Duration period = connection.settings().datagram_period();
  return std::floor(to_seconds(connection.gathering_time(Instant{0})) / to_seconds(period));
}

TEST(Gathering, SharesAWakeUpAmongSingleRecordsOfTwoMilliseconds) {
  EXPECT_EQ(gathered("1"), 15);
  EXPECT_EQ(gathered("7"), 3);
  EXPECT_EQ(gathered("40"), 0) << "a block wakes the thread at once";
  EXPECT_NEAR(gathered("1", 200'000.0 / 7000), 0.002 * 200'000, 5) << "2 ms of wall time";
}

TEST(Gathering, EndsByTheStreamsTimeHoweverLateTheThreadIs) {
  const Connection connection(parse_configuration(page("comrdtbsiz", "1")));
  const Duration whole = connection.gathering_time(Instant{0});
  EXPECT_EQ(connection.gathering_time(40us), whole - 40us);
  EXPECT_EQ(connection.gathering_time(10ms), 0ns) << "behind: no sleep";
  EXPECT_EQ(connection.gathering_time(-1h), whole) << "a clock that was set back";
}

}  // namespace kphi::netbox::connection_test
