// What made other clients of the box lose records, stop or keep silent, each case alone, over real sockets. None of it
// may cost a record here that is not counted.
#include <gmock/gmock.h>

#include "drivers/netbox/receive/load.hpp"
#include "test/drivers/netbox_faults/live_box.hpp"

namespace kphi::netbox::test::cases_others_fail_test {

using namespace std::chrono_literals;
using testing::Contains;
using testing::ElementsAre;

/// Nothing is missing, nothing came twice or out of order, and the sum closes.
void expect_all_delivered(LoadCell& cell, Consumer& consumer) {
  cell.stop();
  consumer.take_what_waits();
  const Counters counters = cell.counters();
  EXPECT_EQ(consumer.taken(), counters.received);
  EXPECT_EQ(consumer.out_of_order(), 0u);
  EXPECT_EQ(consumer.samples_missing(), 0u);
  EXPECT_EQ(counters.lost_network + counters.lost_host + counters.queue_overflows, 0u);
  EXPECT_EQ(counters.late + counters.malformed + counters.irregular, 0u);
  EXPECT_EQ(counters.expected, counters.received);
}

void clean_stream(int records_per_datagram) {
  LiveStream s({.records_per_datagram = records_per_datagram});
  ASSERT_TRUE(s.start_and_take(10'500));
  expect_all_delivered(s.cell, s.consumer);
  EXPECT_EQ(s.consumer.first_rdt(), 1u);
  EXPECT_EQ(s.cell.counters().duplicates, 0u);
  const sim::WireTruth& truth = s.box.stop();
  EXPECT_GE(truth.records_arrived, s.cell.counters().received);
  EXPECT_EQ(truth.starts, 1u);
}

TEST(CasesOthersFail, ACleanStreamOneByOne) { clean_stream(1); }
TEST(CasesOthersFail, ACleanStreamOfFortyRecordsPerDatagram) { clean_stream(40); }

TEST(CasesOthersFail, AdjacentSwapsAreNoLoss) {
  LiveStream s({.rate_hz = 1000,
                .records_per_datagram = 1,
                .time_scale = 4,
                .faults = {"reorder at_s=0 for_s=1000 p=0.01 depth=1"}});
  ASSERT_TRUE(s.start_and_take(5000));
  expect_all_delivered(s.cell, s.consumer);
  EXPECT_GT(s.cell.counters().reordered, 10u);
}

TEST(CasesOthersFail, FiveRecordsPerSecond) {
  LiveStream s({.rate_hz = 5, .records_per_datagram = 1});
  ASSERT_TRUE(s.start_and_take(7));
  EXPECT_EQ(s.cell.state(), State::streaming);
  expect_all_delivered(s.cell, s.consumer);
  EXPECT_THAT(s.cell.take_events(), testing::IsEmpty());
  EXPECT_EQ(s.box.stop().starts, 1u) << "it waits instead of asking again";
}

TEST(CasesOthersFail, FiveRecordsPerSecondInBlocksOfForty) {
  LiveStream s({.rate_hz = 5, .records_per_datagram = 40, .time_scale = 20});
  ASSERT_TRUE(s.start_and_take(120));
  expect_all_delivered(s.cell, s.consumer);
  EXPECT_EQ(s.box.stop().starts, 1u);
}

/// A consumer that stands still, twice, while so many records come.
void blocked_consumer(std::uint64_t records) {
  LiveStream s({.records_per_datagram = 1});
  s.cell.start();
  for (std::uint64_t second = 1; second <= 2; ++second) {
    ASSERT_TRUE(s.consumer.take_until(second * 3500));
    const std::uint64_t before = s.cell.counters().received;
    ASSERT_TRUE(soon([&] { return s.cell.counters().received >= before + records; }));
  }
  expect_all_delivered(s.cell, s.consumer);
  EXPECT_THAT(s.cell.take_events(), testing::IsEmpty());
  EXPECT_EQ(s.box.stop().starts, 1u) << "no reconnect";
}

TEST(CasesOthersFail, AConsumerBlockedForSixtyMilliseconds) { blocked_consumer(420); }
TEST(CasesOthersFail, AConsumerBlockedForTwoHundredMilliseconds) { blocked_consumer(1400); }

TEST(CasesOthersFail, AStreamThatBeginsAnewAfterTwoThousandRecords) {
  LiveStream s({.rate_hz = 1000,
                .records_per_datagram = 1,
                .time_scale = 4,
                .faults = {"doubled_start at_s=0 count=1 delay_s=2"}});
  ASSERT_TRUE(s.start_and_take(4998));
  EXPECT_THAT(events_until(s.cell, EventKind::restarted), ElementsAre(EventKind::restarted));
  expect_all_delivered(s.cell, s.consumer);
  EXPECT_EQ(s.cell.counters().restarts, 1u);
  EXPECT_EQ(s.cell.counters().duplicates, 0u);
  EXPECT_LT(s.consumer.last_rdt(), s.consumer.taken()) << "it counts anew";
}

TEST(CasesOthersFail, ARebootWithTheStreamComingOn) {
  LiveStream s({.time_scale = 4, .faults = {"reboot at_s=4 down_s=0.2 resume=1"}});
  s.cell.start();
  ASSERT_TRUE(s.consumer.take_while([&] { return s.cell.counters().reboots == 0; }));
  ASSERT_TRUE(s.consumer.take_until(s.consumer.taken() + 2000)) << "records of the new epoch are delivered";
  EXPECT_THAT(events_until(s.cell, EventKind::rebooted), Contains(EventKind::rebooted));
  s.cell.stop();
  const Counters counters = s.cell.counters();
  EXPECT_EQ(counters.reboots, 1u);
  EXPECT_EQ(counters.restarts, 0u);
  EXPECT_EQ(counters.lost_network + counters.duplicates + counters.late, 0u);
  EXPECT_EQ(counters.expected, counters.received);
}

TEST(CasesOthersFail, ARebootWithTheStreamStopping) {
  LiveStream s({.time_scale = 4, .faults = {"reboot at_s=4 down_s=0.2"}});
  s.cell.start();
  EXPECT_THAT(events_until(s.cell, EventKind::taken_over), ElementsAre(EventKind::silent, EventKind::taken_over))
      << "the box answers again, and the driver does not fight for what may be another client's stream";
  // Who streams again reads the configuration again.
  LoadCell anew(s.box.address(), s.clock);
  Consumer again(anew);
  anew.start();
  ASSERT_TRUE(again.take_until(1000));
  expect_all_delivered(anew, again);
  s.cell.stop();
  const sim::WireTruth& truth = s.box.stop();
  EXPECT_EQ(truth.reboots, 1u);
  EXPECT_EQ(truth.starts, 2u);
}

/// A functor that cannot be copied is called in address, and keeps its state.
TEST(CasesOthersFail, AConsumerWithAStateIsNeverCopied) {
  LiveStream s({.time_scale = 4});
  static_assert(!std::is_copy_constructible_v<Consumer> && !std::is_move_constructible_v<Consumer>);
  ASSERT_TRUE(s.start_and_take(2000));
  expect_all_delivered(s.cell, s.consumer);
}

/// Of the next `records`; N.
double mean_thrust(LoadCell& cell, std::uint64_t records) {
  ZeroEstimate estimate;
  std::vector<LoadCellRecord> one(1);
  for (std::uint64_t taken = 0; taken < records && cell.wait(kPatience);) {
    taken += cell.take(one);
    estimate.add(one[0].counts, one[0].status);
  }
  return estimate.result(cell.configuration()).mean[2];
}

void bias(bool stops_stream) {
  LiveStream s({.quirks = {.bias_stops_stream = stops_stream}});
  s.cell.start();
  EXPECT_GT(std::abs(mean_thrust(s.cell, 2000)), 0.05) << "there was something to take away";
  // The box takes one noisy sample as its zero: what remains is its noise, and after a bad one kphi asks again.
  std::uint64_t asked = 0;
  ASSERT_TRUE(soon([&] {
    const std::uint64_t starts = s.cell.counters().restarts;
    s.cell.set_bias();
    ++asked;
    if (stops_stream && !soon([&] { return s.cell.counters().restarts > starts; })) return true;
    return std::abs(mean_thrust(s.cell, 2000)) < 0.05;
  }));
  s.cell.stop();
  EXPECT_EQ(s.cell.counters().lost_network + s.cell.counters().lost_host == 0, !stops_stream);
  EXPECT_EQ(s.cell.counters().restarts, stops_stream ? asked : 0u);
  EXPECT_EQ(s.box.stop().starts, 1 + (stops_stream ? asked : 0u));
}

TEST(CasesOthersFail, ABiasOnABoxThatKeepsStreaming) { bias(false); }
TEST(CasesOthersFail, ABiasOnABoxThatStopsItsStream) { bias(true); }

}  // namespace kphi::netbox::test::cases_others_fail_test
