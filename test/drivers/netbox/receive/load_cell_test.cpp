#include <gmock/gmock.h>

#include "test/drivers/netbox/load_cell_bench.hpp"
#include "test/refusal.hpp"

namespace kphi::netbox::load_cell_test {

using namespace std::chrono_literals;
using namespace test;
using testing::AllOf;
using testing::HasSubstr;

constexpr auto kPatience = 20s;

/// Takes until `wanted` records have come; each must follow the one before, unless `gaps` may be between them.
std::uint64_t consume(LoadCell& cell, std::uint64_t wanted, bool gaps = false) {
  std::vector<LoadCellRecord> batch(512);
  std::uint64_t taken = 0;
  std::uint32_t before = 0;
  Instant arrival{0};
  const auto deadline = std::chrono::steady_clock::now() + kPatience;
  while (taken < wanted && std::chrono::steady_clock::now() < deadline) {
    if (!cell.wait(1s)) continue;
    const std::size_t count = cell.take(batch);
    for (std::size_t i = 0; i < count; ++i) {
      const LoadCellRecord& stamped = batch[i];
      if (taken + i > 0 && !gaps) {
        EXPECT_EQ(stamped.rdt_sequence, before + 1);
      }
      before = stamped.rdt_sequence;
      EXPECT_GE(stamped.arrival(), arrival - 20ms);
      arrival = stamped.arrival();
    }
    taken += count;
  }
  return taken;
}

std::string start_failure(LoadCell& cell) {
  return refusal([&] { return cell.start(), 0; });
}

TEST(LoadCell, ConstructionReadsTheConfigurationAndLeavesTheStreamAlone) {
  BenchBox bench;
  {
    LoadCell cell(bench.address, bench.clock);
    EXPECT_EQ(cell.configuration().records_per_datagram, 40);
    EXPECT_EQ(cell.configuration().rdt_rate_hz, 7000);
    EXPECT_EQ(cell.state(), State::idle);
    EXPECT_FALSE(cell.wait(0ns));
  }
  EXPECT_EQ(bench.box.starts() + bench.box.stops(), 0);
}

void stream_without_loss(unsigned records_per_datagram) {
  Bench bench({.records_per_datagram = records_per_datagram});
  bench.cell.start();
  EXPECT_EQ(bench.cell.state(), State::streaming);
  EXPECT_GE(consume(bench.cell, 7000), 7000u);
  bench.cell.stop();
  const Counters counters = bench.cell.counters();
  EXPECT_GE(counters.received, 7000u);
  EXPECT_EQ(counters.expected, counters.received);
  EXPECT_EQ(counters.lost_network + counters.lost_host + counters.malformed + counters.queue_overflows, 0u);
  EXPECT_TRUE(soon([&] { return !bench.box.streaming(); }));
  EXPECT_EQ(bench.box.starts(), 1);
  EXPECT_EQ(bench.box.settings_written(), 0);
  EXPECT_EQ(bench.cell.state(), State::idle);
}

TEST(LoadCell, TakesSevenThousandRecordsPerSecondBuffered) { stream_without_loss(40); }
TEST(LoadCell, TakesSevenThousandRecordsPerSecondOneByOne) { stream_without_loss(1); }

TEST(LoadCell, TakesTwentyTimesTheRateOnAClockTwentyTimesAsFast) {
  Bench bench({.speed = 20});
  bench.cell.start();
  EXPECT_GE(consume(bench.cell, 70'000), 70'000u);
  bench.cell.stop();
  EXPECT_EQ(bench.cell.counters().expected, bench.cell.counters().received);
}

TEST(LoadCell, ASleepingConsumerLosesNothing) {
  Bench bench({.records_per_datagram = 1});
  bench.cell.start();
  ASSERT_TRUE(soon([&] { return bench.cell.counters().received >= 7000; }));  // nobody takes for a second
  bench.cell.stop();
  const Counters counters = bench.cell.counters();
  EXPECT_EQ(counters.queue_overflows, 0u);
  EXPECT_EQ(counters.lost_network + counters.lost_host, 0u);
  EXPECT_EQ(consume(bench.cell, counters.received), counters.received);
}

TEST(LoadCell, ARecordWakesWhoWaitsForIt) {
  Bench bench({.records_per_datagram = 1});
  bench.cell.start();
  std::array<LoadCellRecord, 1024> records;
  const Instant begin = bench.clock.now();
  for (int woken = 0; woken < 5; ++woken) {
    while (bench.cell.take(records) > 0) {
    }
    ASSERT_TRUE(bench.cell.wait(20s));
    ASSERT_LT(bench.clock.now() - begin, 20s) << "it was found when the time was over";
  }
}

TEST(LoadCell, CountsExactlyWhatTheNetworkLost) {
  Bench bench({.skip_every = 10});
  bench.cell.start();
  EXPECT_GE(consume(bench.cell, 4000, true), 4000u);
  bench.cell.stop();
  const Counters counters = bench.cell.counters();
  EXPECT_EQ(counters.expected, counters.received + counters.lost_network);
  EXPECT_EQ(counters.lost_host, 0u);
  EXPECT_GE(counters.lost_network, 400u);
  EXPECT_LE(counters.lost_network, bench.box.skipped());
  EXPECT_EQ(counters.irregular, 0u);
}

TEST(LoadCell, RepeatsAStartThatWasLost) {
  Bench bench({.starts_ignored = 2});
  bench.cell.start();
  EXPECT_EQ(bench.box.starts(), 3);
  EXPECT_GE(consume(bench.cell, 100), 100u);
}

TEST(LoadCell, RepeatsAStopThatWasLost) {
  BenchBox bench({.stops_ignored = 2});  // the one before the start, and the one at the end
  {
    LoadCell cell(bench.address, bench.clock);
    cell.start();
    EXPECT_GE(consume(cell, 100), 100u);
  }
  EXPECT_TRUE(soon([&] { return !bench.box.streaming(); }));
  EXPECT_GE(bench.box.stops(), 3);
}

TEST(LoadCell, StartsAgainAfterAStopWithItsCountersGoingOn) {
  Bench bench;
  bench.cell.start();
  EXPECT_GE(consume(bench.cell, 400), 400u);
  bench.cell.stop();
  const std::uint64_t first = bench.cell.counters().received;
  bench.cell.start();
  ASSERT_TRUE(soon([&] { return bench.cell.counters().received >= first + 400; }));
  EXPECT_EQ(bench.cell.counters().lost_network, 0u);
  EXPECT_EQ(bench.cell.counters().expected, bench.cell.counters().received);
}

std::vector<EventKind> kinds_until(LoadCell& cell, std::size_t wanted) {
  std::vector<EventKind> kinds;
  EXPECT_TRUE(soon([&] {
    for (const Event& event : cell.take_events()) kinds.push_back(event.kind);
    return kinds.size() >= wanted;
  }));
  return kinds;
}

TEST(LoadCell, ASilentStreamOfABoxThatAnswersIsCalledTakenOver) {
  Bench bench({.mute_after_1000 = true});
  bench.cell.start();
  EXPECT_THAT(kinds_until(bench.cell, 2), testing::ElementsAre(EventKind::silent, EventKind::taken_over));
  EXPECT_EQ(bench.cell.state(), State::silent);
  EXPECT_EQ(bench.cell.counters().received, 1000u);
  EXPECT_EQ(bench.box.starts(), 1) << "it must not fight for a stream that another client has taken";
}

TEST(LoadCell, ASilentStreamOfABoxThatIsGoneIsCalledUnreachable) {
  Bench bench({.mute_after_1000 = true});
  bench.web.reset();
  bench.cell.start();
  EXPECT_THAT(kinds_until(bench.cell, 2), testing::ElementsAre(EventKind::silent, EventKind::unreachable));
}

TEST(LoadCell, StartsABoxAgainThatHasForgottenItsPeaks) {
  std::atomic<bool> booted{false};
  Bench bench(
      {.mute_after_1000 = true},
      {{}, {}, false, [&](const std::string&) {
         return FakeWeb::page(booted ? with(streaming_xml(), "runpkmx", "0;0;0;0;0;0") : streaming_xml()).pieces[0];
       }});
  bench.cell.start();
  booted = true;
  EXPECT_THAT(kinds_until(bench.cell, 3),
              testing::ElementsAre(EventKind::silent, EventKind::rebooted, EventKind::reconnected));
  EXPECT_EQ(bench.box.starts(), 2);
  // Silent again, and nothing tells of another boot: this time it is left alone.
  EXPECT_THAT(kinds_until(bench.cell, 2), testing::ElementsAre(EventKind::silent, EventKind::taken_over));
  EXPECT_EQ(bench.box.starts(), 2);
  EXPECT_EQ(bench.cell.counters().received, 2000u);
}

TEST(LoadCell, AClosedRdtPortIsAClearErrorWithinSeconds) {
  FakeWeb web(FakeWeb::page(streaming_xml()));
  const std::uint16_t closed = closed_port(SOCK_DGRAM);
  const SteadyClock clock;
  LoadCell cell({"127.0.0.1", closed, web.port()}, clock);
  const auto begun = std::chrono::steady_clock::now();
  EXPECT_THAT(start_failure(cell), AllOf(HasSubstr("Net Box 127.0.0.1:" + std::to_string(closed)),
                                         HasSubstr("refuses the RDT port"), HasSubstr("check rdt_port")));
  EXPECT_LT(std::chrono::steady_clock::now() - begun, 10s);
  EXPECT_EQ(cell.state(), State::failed);
}

TEST(LoadCell, AMuteBoxIsAClearErrorWithinSeconds) {
  Bench bench({.starts_ignored = 1000});
  EXPECT_THAT(start_failure(bench.cell), AllOf(HasSubstr("no record after 6 requests"), HasSubstr("firewall")));
  EXPECT_EQ(bench.box.starts(), 6);
}

TEST(LoadCell, ADisabledStreamIsNamedWithoutTrying) {
  Bench bench({}, FakeWeb::page(with(streaming_xml(), "comrdte", "Disabled")));
  EXPECT_THAT(start_failure(bench.cell), AllOf(HasSubstr("RDT is disabled"), HasSubstr("Communications page")));
  EXPECT_EQ(bench.box.starts(), 0);
}

TEST(LoadCell, AWrongConfigurationNamesTheBox) {
  EXPECT_THAT(refusal([&] { return Bench({}, FakeWeb::page(with(streaming_xml(), "cfgcpf", "0"))).cell.state(); }),
              HasSubstr("Net Box 127.0.0.1: read the configuration"));
}

TEST(LoadCell, TellsHowLongTheProcessMayStandStill) {
  const ReceiveBuffer buffer = Bench({.speed = 4}).cell.receive_buffer();
  EXPECT_GT(buffer.bytes, 0u);
  EXPECT_EQ(buffer.payload_bytes, 1440u);
  EXPECT_NEAR(static_cast<double>(buffer.period.count()), 1e9 * 40 / 7000 / 4, 1) << "time runs four times as fast";
}

}  // namespace kphi::netbox::load_cell_test
