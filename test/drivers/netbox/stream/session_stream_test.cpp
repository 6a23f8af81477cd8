// What a session makes of the datagrams of a stream: order, sizes, losses, wraps.
#include <gmock/gmock.h>

#include <random>

#include "test/drivers/netbox/session_fixture.hpp"

namespace kphi::netbox::session_stream_test {

using namespace std::chrono_literals;
using namespace test;
using testing::IsEmpty;

TEST_F(SessionTest, PutsSwappedDatagramsInOrder) {
  start_streaming();
  now += 5ms;
  receive_block(81);
  EXPECT_EQ(out.size(), 40u);
  EXPECT_EQ(session.release_deadline(), now + settings.reorder_patience);
  EXPECT_EQ(counted(), "");
  now += 1ms;
  receive_block(41);
  ASSERT_EQ(out.size(), 120u);
  for (std::uint32_t i = 0; i < 120; ++i) EXPECT_EQ(out[i].ft_sequence, 1000 + i);
  EXPECT_EQ(session.release_deadline(), kNever);
  EXPECT_EQ(session.counters().lost_network + session.counters().late, 0u);
}

TEST_F(SessionTest, GivesUpAGapWhenItsTimeIsOverWithoutAFurtherDatagram) {
  start_streaming();
  receive_block(81);
  now = session.release_deadline();
  session.release(now, out);
  EXPECT_EQ(out.size(), 80u);
  EXPECT_EQ(session.counters().lost_network, 40u);
  receive_block(41);
  EXPECT_EQ(session.counters().late, 40u);
  EXPECT_EQ(out.size(), 80u);
}

TEST_F(SessionTest, WhatWaitsKeepsTheStreamAlive) {
  start_streaming();
  now += 400ms;
  receive_block(81);
  EXPECT_GT(session.deadline(), now + 500ms);
}

TEST_F(SessionTest, CountsWrongSizesAndGoesOn) {
  start_streaming();
  for (const std::size_t size : {0u, 35u, 37u, 71u, 1476u}) receive(Bytes(size, 0));
  EXPECT_EQ(session.counters().malformed, 5u);
  receive_block(41);
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
  receive_block(41 + 160);  // four datagrams missing, three of them dropped here
  session.flush(out);
  EXPECT_EQ(counted(), "lost 40, host 120");
  session.note_host_drops(3);
  receive_block(241 + 40);
  EXPECT_EQ(session.counters().lost_network, 40u) << "one datagram may have been overtaken";
  session.flush(out);
  EXPECT_EQ(counted(), "lost 80, host 120");
  receive(records(321, 1320, 10));
  session.note_host_drops(4);
  receive(records(371, 1370, 10));
  session.flush(out);
  EXPECT_EQ(session.counters().lost_host, 130u) << "the box now sends ten records per datagram";
}

TEST_F(SessionTest, ADuplicatedStartLosesNothing) {
  start_streaming();
  for (std::uint32_t i = 0; i < 50; ++i) {
    now += 5ms;
    receive(records(1 + 40 * i, 1040 + 40 * i, 40));
  }
  EXPECT_EQ(counted(), "restarts 1");
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

TEST_F(SessionTest, NeverAllocatesInTheCallersVectorOnceItIsLargeEnough) {
  start_streaming();
  out.clear();
  out.reserve(40);
  const LoadCellRecord* const address = out.data();
  for (std::uint32_t i = 1; i < 100; ++i) {
    out.clear();
    receive_block(1 + 40 * i);
    EXPECT_EQ(out.size(), 40u);
  }
  EXPECT_EQ(out.data(), address);
}

// A channel between a box and the session: loses, repeats, swaps and damages whole datagrams, the socket drops some,
// the stream begins anew. The account must close, and name the host's share; also where what is in order takes its
// shorter way.
TEST(SessionProperty, TheAccountClosesForEveryChannel) {
  std::uint64_t in_order = 0;
  for (unsigned seed = 0; seed < 200; ++seed) {
    std::mt19937 random(seed);
    const auto chance = [&](unsigned in) { return random() % in == 0; };
    StreamSettings settings;
    settings.divisor = 1 + random() % 100;
    settings.records_per_datagram = static_cast<int>(1 + random() % 40);
    const auto k = static_cast<unsigned>(settings.records_per_datagram);
    Session session(settings), twin(settings);
    std::vector<LoadCellRecord> out, of_twin;
    Instant now = 1s;
    for (Session* one : {&session, &twin}) one->start(1s);
    now = session.deadline();
    for (Session* one : {&session, &twin}) one->advance(now);
    const auto receive = [&](std::span<const std::uint8_t> datagram) {
      session.receive(datagram, now, out);
      std::vector<LoadCellRecord> slots(records_in(datagram.size()));
      if (!twin.receive_in_order(datagram, now, slots)) return twin.receive(datagram, now, of_twin);
      of_twin.insert(of_twin.end(), slots.begin(), slots.end());
      ++in_order;
    };
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
        receive(std::span(datagram).first(datagram.size() - 1 - random() % 35));
        ++malformed;
        continue;
      }
      for (Session* one : {&session, &twin}) one->note_host_drops(dropped);
      dropped_seen = dropped;
      receive(datagram);
      if (chance(25)) receive(datagram);
    }
    session.flush(out);
    twin.flush(of_twin);
    EXPECT_EQ(of_twin, out) << seed;
    const Counters& c = session.counters();
    EXPECT_EQ(twin.counters().expected, c.expected) << seed;
    EXPECT_EQ(twin.counters().duplicates, c.duplicates) << seed;
    EXPECT_EQ(c.expected, c.received + c.lost_network + c.lost_host) << seed;
    EXPECT_EQ(c.received, out.size()) << seed;
    EXPECT_EQ(c.lost_host, dropped_seen * k) << seed;
    EXPECT_EQ(c.malformed, malformed) << seed;
    EXPECT_EQ(c.reboots + c.late, 0u) << seed;
    for (std::size_t i = 1; i < out.size(); ++i)
      ASSERT_GT(static_cast<std::int32_t>(out[i].ft_sequence - out[i - 1].ft_sequence), 0) << seed;
  }
  EXPECT_GT(in_order, 40'000u);
}

TEST(SessionProperty, RandomDatagramsNeverBreakTheAccount) {
  std::mt19937 random(3);
  Session session{StreamSettings{}};
  std::vector<LoadCellRecord> out;
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

}  // namespace kphi::netbox::session_stream_test
