#include "drivers/netbox/receive/load_cell.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <optional>

#include "base/error.hpp"
#include "test/drivers/netbox/fake_box.hpp"

namespace kphi::netbox {
namespace {

using namespace std::chrono_literals;
using test::captured_xml;
using test::FakeBox;
using test::FakeWeb;
using test::with;
using testing::AllOf;
using testing::HasSubstr;

constexpr auto kPatience = 20s;

std::string xml(unsigned divisor = 1, unsigned records_per_datagram = 40) {
  const std::string rate = std::to_string(7000 / divisor), size = std::to_string(records_per_datagram);
  return with(with(captured_xml(), "comrdtrate", rate.c_str()), "comrdtbsiz", size.c_str());
}

/// Takes until `wanted` records have come; each must follow the one before, unless `gaps` may be between them.
std::uint64_t consume(LoadCell& cell, std::uint64_t wanted, bool gaps = false) {
  std::vector<StampedRecord> batch(512);
  std::uint64_t taken = 0;
  std::uint32_t before = 0;
  Instant arrival{0};
  const auto deadline = std::chrono::steady_clock::now() + kPatience;
  while (taken < wanted && std::chrono::steady_clock::now() < deadline) {
    if (!cell.wait(1s)) continue;
    const std::size_t count = cell.take(batch);
    for (std::size_t i = 0; i < count; ++i) {
      const StampedRecord& stamped = batch[i];
      if (taken + i > 0 && !gaps) {
        EXPECT_EQ(stamped.record.rdt_sequence, before + 1);
      }
      before = stamped.record.rdt_sequence;
      EXPECT_GE(stamped.arrival, arrival - 20ms);
      arrival = stamped.arrival;
    }
    taken += count;
  }
  return taken;
}

template <class Condition>
bool eventually(Condition condition) {
  const auto deadline = std::chrono::steady_clock::now() + kPatience;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > deadline) return false;
    std::this_thread::yield();
  }
  return true;
}

std::string start_failure(LoadCell& cell) {
  try {
    cell.start();
  } catch (const DeviceError& error) {
    return error.what();
  }
  return "none";
}

TEST(LoadCell, ConstructionReadsTheConfigurationAndLeavesTheStreamAlone) {
  FakeWeb web(FakeWeb::page(xml()));
  FakeBox box({});
  const SteadyClock clock;
  {
    LoadCell cell({"127.0.0.1", box.port(), web.port()}, clock);
    EXPECT_EQ(cell.configuration().records_per_datagram, 40);
    EXPECT_EQ(cell.configuration().rdt_rate_hz, 7000);
    EXPECT_EQ(cell.state(), State::idle);
    EXPECT_EQ(cell.newest_arrival(), 0ns);
    EXPECT_FALSE(cell.wait(0ns));
  }
  EXPECT_EQ(box.starts() + box.stops(), 0);
}

void stream_without_loss(unsigned records_per_datagram) {
  FakeWeb web(FakeWeb::page(xml(1, records_per_datagram)));
  FakeBox box({.records_per_datagram = records_per_datagram});
  const SteadyClock clock;
  LoadCell cell({"127.0.0.1", box.port(), web.port()}, clock);
  cell.start();
  EXPECT_EQ(cell.state(), State::streaming);
  EXPECT_GE(consume(cell, 7000), 7000u);
  EXPECT_LT(clock.now() - cell.newest_arrival(), 5s);
  cell.stop();
  const Counters counters = cell.counters();
  EXPECT_GE(counters.received, 7000u);
  EXPECT_EQ(counters.expected, counters.received);
  EXPECT_EQ(counters.lost_network + counters.lost_host + counters.malformed + counters.queue_overflows, 0u);
  EXPECT_TRUE(eventually([&] { return !box.streaming(); }));
  EXPECT_EQ(box.starts(), 1);
  EXPECT_EQ(box.settings_written(), 0);
  EXPECT_EQ(cell.state(), State::idle);
}

TEST(LoadCell, TakesSevenThousandRecordsPerSecondBuffered) { stream_without_loss(40); }
TEST(LoadCell, TakesSevenThousandRecordsPerSecondOneByOne) { stream_without_loss(1); }

TEST(LoadCell, TakesTwentyTimesTheRateOnAClockTwentyTimesAsFast) {
  FakeWeb web(FakeWeb::page(xml()));
  FakeBox box({.speed = 20});
  const SteadyClock clock(20);
  LoadCell cell({"127.0.0.1", box.port(), web.port()}, clock);
  cell.start();
  EXPECT_GE(consume(cell, 70'000), 70'000u);
  cell.stop();
  EXPECT_EQ(cell.counters().expected, cell.counters().received);
}

TEST(LoadCell, ASleepingConsumerLosesNothing) {
  FakeWeb web(FakeWeb::page(xml(1, 1)));
  FakeBox box({.records_per_datagram = 1});
  const SteadyClock clock;
  LoadCell cell({"127.0.0.1", box.port(), web.port()}, clock);
  cell.start();
  ASSERT_TRUE(eventually([&] { return cell.counters().received >= 7000; }));  // nobody takes for a second
  cell.stop();
  const Counters counters = cell.counters();
  EXPECT_EQ(counters.queue_overflows, 0u);
  EXPECT_EQ(counters.lost_network + counters.lost_host, 0u);
  EXPECT_EQ(consume(cell, counters.received), counters.received);
}

TEST(LoadCell, CountsExactlyWhatTheNetworkLost) {
  FakeWeb web(FakeWeb::page(xml()));
  FakeBox box({.skip_every = 10});
  const SteadyClock clock;
  LoadCell cell({"127.0.0.1", box.port(), web.port()}, clock);
  cell.start();
  EXPECT_GE(consume(cell, 4000, true), 4000u);
  cell.stop();
  const Counters counters = cell.counters();
  EXPECT_EQ(counters.expected, counters.received + counters.lost_network);
  EXPECT_EQ(counters.lost_host, 0u);
  EXPECT_GE(counters.lost_network, 400u);
  EXPECT_LE(counters.lost_network, box.skipped());
  EXPECT_EQ(counters.irregular, 0u);
}

TEST(LoadCell, RepeatsAStartThatWasLost) {
  FakeWeb web(FakeWeb::page(xml()));
  FakeBox box({.starts_ignored = 2});
  const SteadyClock clock;
  LoadCell cell({"127.0.0.1", box.port(), web.port()}, clock);
  cell.start();
  EXPECT_EQ(box.starts(), 3);
  EXPECT_GE(consume(cell, 100), 100u);
}

TEST(LoadCell, RepeatsAStopThatWasLost) {
  FakeWeb web(FakeWeb::page(xml()));
  FakeBox box({.stops_ignored = 2});  // the one before the start, and the one at the end
  const SteadyClock clock;
  {
    LoadCell cell({"127.0.0.1", box.port(), web.port()}, clock);
    cell.start();
    EXPECT_GE(consume(cell, 100), 100u);
  }
  EXPECT_TRUE(eventually([&] { return !box.streaming(); }));
  EXPECT_GE(box.stops(), 3);
}

TEST(LoadCell, StartsAgainAfterAStopWithItsCountersGoingOn) {
  FakeWeb web(FakeWeb::page(xml()));
  FakeBox box({});
  const SteadyClock clock;
  LoadCell cell({"127.0.0.1", box.port(), web.port()}, clock);
  cell.start();
  EXPECT_GE(consume(cell, 400), 400u);
  cell.stop();
  const std::uint64_t first = cell.counters().received;
  cell.start();
  ASSERT_TRUE(eventually([&] { return cell.counters().received >= first + 400; }));
  EXPECT_EQ(cell.counters().lost_network, 0u);
  EXPECT_EQ(cell.counters().expected, cell.counters().received);
}

TEST(LoadCell, SaysThatAStreamHasFallenSilent) {
  FakeWeb web(FakeWeb::page(xml()));
  FakeBox box({.mute_after_1000 = true});
  const SteadyClock clock;
  LoadCell cell({"127.0.0.1", box.port(), web.port()}, clock);
  cell.start();
  EXPECT_TRUE(eventually([&] { return cell.state() == State::silent; }));
  EXPECT_EQ(cell.counters().received, 1000u);
  EXPECT_EQ(box.starts(), 1) << "it must not fight for a stream that another client has taken";
}

std::vector<EventKind> kinds_until(LoadCell& cell, std::size_t wanted) {
  std::vector<EventKind> kinds;
  EXPECT_TRUE(eventually([&] {
    for (const Event& event : cell.take_events()) kinds.push_back(event.kind);
    return kinds.size() >= wanted;
  }));
  return kinds;
}

TEST(LoadCell, ASilentStreamOfABoxThatAnswersIsCalledTakenOver) {
  FakeWeb web(FakeWeb::page(xml()));
  FakeBox box({.mute_after_1000 = true});
  const SteadyClock clock;
  LoadCell cell({"127.0.0.1", box.port(), web.port()}, clock);
  cell.start();
  EXPECT_THAT(kinds_until(cell, 2), testing::ElementsAre(EventKind::silent, EventKind::taken_over));
}

TEST(LoadCell, ASilentStreamOfABoxThatIsGoneIsCalledUnreachable) {
  std::optional<FakeWeb> web(std::in_place, FakeWeb::page(xml()));
  FakeBox box({.mute_after_1000 = true});
  const SteadyClock clock;
  LoadCell cell({"127.0.0.1", box.port(), web->port()}, clock);
  web.reset();
  cell.start();
  EXPECT_THAT(kinds_until(cell, 2), testing::ElementsAre(EventKind::silent, EventKind::unreachable));
}

TEST(LoadCell, GivesUpABoxThatDoesNotComeBack) {
  std::optional<FakeWeb> web(std::in_place, FakeWeb::page(xml()));
  FakeBox box({.mute_after_1000 = true});
  const SteadyClock clock;
  LoadCell cell({"127.0.0.1", box.port(), web->port()}, clock, {.first_pause = 20ms, .give_up_after = 200ms});
  web.reset();
  cell.start();
  EXPECT_THAT(kinds_until(cell, 3),
              testing::ElementsAre(EventKind::silent, EventKind::unreachable, EventKind::given_up));
  EXPECT_EQ(cell.state(), State::silent);
  EXPECT_EQ(box.starts(), 1);
}

TEST(LoadCell, StartsABoxAgainThatHasForgottenItsPeaks) {
  std::atomic<bool> booted{false};
  FakeWeb web({{}, {}, false, [&](const std::string&) {
                 return FakeWeb::page(booted ? with(xml(), "runpkmx", "0;0;0;0;0;0") : xml()).pieces[0];
               }});
  FakeBox box({.mute_after_1000 = true});
  const SteadyClock clock;
  LoadCell cell({"127.0.0.1", box.port(), web.port()}, clock);
  cell.start();
  booted = true;
  EXPECT_THAT(kinds_until(cell, 3),
              testing::ElementsAre(EventKind::silent, EventKind::rebooted, EventKind::reconnected));
  EXPECT_EQ(box.starts(), 2);
  // Silent again, and nothing tells of another boot: this time it is left alone.
  EXPECT_THAT(kinds_until(cell, 2), testing::ElementsAre(EventKind::silent, EventKind::taken_over));
  EXPECT_EQ(box.starts(), 2);
  EXPECT_EQ(cell.counters().received, 2000u);
}

TEST(LoadCell, AClosedRdtPortIsAClearErrorWithinSeconds) {
  FakeWeb web(FakeWeb::page(xml()));
  std::uint16_t closed = 0;
  {
    const test::LoopbackSocket gone(SOCK_DGRAM);
    closed = gone.port();
  }
  const SteadyClock clock;
  LoadCell cell({"127.0.0.1", closed, web.port()}, clock);
  const auto begun = std::chrono::steady_clock::now();
  EXPECT_THAT(start_failure(cell), AllOf(HasSubstr("Net Box 127.0.0.1:" + std::to_string(closed)),
                                         HasSubstr("refuses the RDT port"), HasSubstr("check rdt_port")));
  EXPECT_LT(std::chrono::steady_clock::now() - begun, 10s);
  EXPECT_EQ(cell.state(), State::failed);
}

TEST(LoadCell, AMuteBoxIsAClearErrorWithinSeconds) {
  FakeWeb web(FakeWeb::page(xml()));
  FakeBox box({.starts_ignored = 1000});
  const SteadyClock clock;
  LoadCell cell({"127.0.0.1", box.port(), web.port()}, clock);
  EXPECT_THAT(start_failure(cell), AllOf(HasSubstr("no record after 6 requests"), HasSubstr("firewall")));
  EXPECT_EQ(box.starts(), 6);
}

TEST(LoadCell, ADisabledStreamIsNamedWithoutTrying) {
  FakeWeb web(FakeWeb::page(with(xml(), "comrdte", "Disabled")));
  FakeBox box({});
  const SteadyClock clock;
  LoadCell cell({"127.0.0.1", box.port(), web.port()}, clock);
  EXPECT_THAT(start_failure(cell), AllOf(HasSubstr("RDT is disabled"), HasSubstr("Communications page")));
  EXPECT_EQ(box.starts(), 0);
}

TEST(LoadCell, AWrongConfigurationNamesTheBox) {
  FakeWeb web(FakeWeb::page(with(xml(), "cfgcpf", "0")));
  const SteadyClock clock;
  try {
    LoadCell cell({"127.0.0.1", 1, web.port()}, clock);
    FAIL();
  } catch (const DeviceError& error) {
    EXPECT_THAT(error.what(), HasSubstr("Net Box 127.0.0.1: read the configuration"));
  }
}

TEST(LoadCell, TellsHowLongTheProcessMayStandStill) {
  FakeWeb web(FakeWeb::page(xml()));
  const SteadyClock clock;
  LoadCell cell({"127.0.0.1", 1, web.port()}, clock);
  EXPECT_THAT(cell.receive_buffer_note(), testing::ContainsRegex("^[0-9.]+ MiB, tolerates [0-9]+ ms"));
}

TEST(LoadCell, SaysWhatToDoAboutABufferSmallerThanAskedFor) {
  FakeWeb web(FakeWeb::page(xml()));
  const SteadyClock clock;
  const LoadCell cell({"127.0.0.1", 1, web.port()}, clock);
  const std::optional<Finding> finding = cell.receive_buffer_finding();
  EXPECT_EQ(finding.has_value(), cell.receive_buffer_bytes() < std::size_t{8} << 20);
  if (finding) {
    EXPECT_THAT(finding->next_move, HasSubstr("net.core.rmem_max"));
  }
}

TEST(ReceiveBuffer, HoldsWhatWasMeasured) {
  EXPECT_NEAR(static_cast<double>(datagrams_held(8'388'608, 36)), 10'082, 10);
  EXPECT_NEAR(static_cast<double>(datagrams_held(212'992, 36)), 256, 1);
  EXPECT_NEAR(static_cast<double>(datagrams_held(212'992, 1440)), 92, 1);
}

}  // namespace
}  // namespace kphi::netbox
