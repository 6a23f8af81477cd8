// What made other clients of the box lose records, stop or keep silent, each case alone, over real sockets. None of it
// may cost a record here that is not counted.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/netbox/receive/load.hpp"
#include "test/drivers/netbox_faults/live_box.hpp"

namespace kphi::netbox::test {
namespace cases_others_fail_test {

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
  LiveBox box({.records_per_datagram = records_per_datagram});
  const SteadyClock clock;
  LoadCell cell(box.address(), clock);
  Consumer consumer(cell);
  cell.start();
  ASSERT_TRUE(consumer.take_until(10'500));
  expect_all_delivered(cell, consumer);
  EXPECT_EQ(consumer.first_rdt(), 1u);
  EXPECT_EQ(cell.counters().duplicates, 0u);
  const sim::WireTruth& truth = box.stop();
  EXPECT_GE(truth.records_arrived, cell.counters().received);
  EXPECT_EQ(truth.starts, 1u);
}

TEST(CasesOthersFail, ACleanStreamOneByOne) { clean_stream(1); }
TEST(CasesOthersFail, ACleanStreamOfFortyRecordsPerDatagram) { clean_stream(40); }

TEST(CasesOthersFail, AdjacentSwapsAreNoLoss) {
  LiveBox box({.rate_hz = 1000,
               .records_per_datagram = 1,
               .time_scale = 4,
               .faults = {{{"kind", "reorder"}, {"at_s", "0"}, {"for_s", "1000"}, {"p", "0.01"}, {"depth", "1"}}}});
  const SteadyClock clock(4);
  LoadCell cell(box.address(), clock);
  Consumer consumer(cell);
  cell.start();
  ASSERT_TRUE(consumer.take_until(5000));
  expect_all_delivered(cell, consumer);
  EXPECT_GT(cell.counters().reordered, 10u);
}

TEST(CasesOthersFail, FiveRecordsPerSecond) {
  LiveBox box({.rate_hz = 5, .records_per_datagram = 1});
  const SteadyClock clock;
  LoadCell cell(box.address(), clock);
  Consumer consumer(cell);
  cell.start();
  ASSERT_TRUE(consumer.take_until(7));
  EXPECT_EQ(cell.state(), State::streaming);
  expect_all_delivered(cell, consumer);
  EXPECT_THAT(cell.take_events(), testing::IsEmpty());
  EXPECT_EQ(box.stop().starts, 1u) << "it waits instead of asking again";
}

TEST(CasesOthersFail, FiveRecordsPerSecondInBlocksOfForty) {
  LiveBox box({.rate_hz = 5, .records_per_datagram = 40, .time_scale = 20});
  const SteadyClock clock(20);
  LoadCell cell(box.address(), clock);
  Consumer consumer(cell);
  cell.start();
  ASSERT_TRUE(consumer.take_until(120));
  expect_all_delivered(cell, consumer);
  EXPECT_EQ(box.stop().starts, 1u);
}

/// A consumer that stands still, twice, while so many records come.
void blocked_consumer(std::uint64_t records) {
  LiveBox box({.records_per_datagram = 1});
  const SteadyClock clock;
  LoadCell cell(box.address(), clock);
  Consumer consumer(cell);
  cell.start();
  for (std::uint64_t second = 1; second <= 2; ++second) {
    ASSERT_TRUE(consumer.take_until(second * 3500));
    const std::uint64_t before = cell.counters().received;
    ASSERT_TRUE(soon([&] { return cell.counters().received >= before + records; }));
  }
  expect_all_delivered(cell, consumer);
  EXPECT_THAT(cell.take_events(), testing::IsEmpty());
  EXPECT_EQ(box.stop().starts, 1u) << "no reconnect";
}

TEST(CasesOthersFail, AConsumerBlockedForSixtyMilliseconds) { blocked_consumer(420); }
TEST(CasesOthersFail, AConsumerBlockedForTwoHundredMilliseconds) { blocked_consumer(1400); }

TEST(CasesOthersFail, AStreamThatBeginsAnewAfterTwoThousandRecords) {
  LiveBox box({.rate_hz = 1000,
               .records_per_datagram = 1,
               .time_scale = 4,
               .faults = {{{"kind", "doubled_start"}, {"at_s", "0"}, {"count", "1"}, {"delay_s", "2"}}}});
  const SteadyClock clock(4);
  LoadCell cell(box.address(), clock);
  Consumer consumer(cell);
  cell.start();
  ASSERT_TRUE(consumer.take_until(4998));
  EXPECT_THAT(events_until(cell, EventKind::restarted), ElementsAre(EventKind::restarted));
  expect_all_delivered(cell, consumer);
  EXPECT_EQ(cell.counters().restarts, 1u);
  EXPECT_EQ(cell.counters().duplicates, 0u);
  EXPECT_LT(consumer.last_rdt(), consumer.taken()) << "it counts anew";
}

TEST(CasesOthersFail, ARebootWithTheStreamComingOn) {
  LiveBox box({.time_scale = 4, .faults = {{{"kind", "reboot"}, {"at_s", "4"}, {"down_s", "0.2"}, {"resume", "1"}}}});
  const SteadyClock clock(4);
  LoadCell cell(box.address(), clock);
  Consumer consumer(cell);
  cell.start();
  ASSERT_TRUE(consumer.take_while([&] { return cell.counters().reboots == 0; }));
  ASSERT_TRUE(consumer.take_until(consumer.taken() + 2000)) << "records of the new epoch are delivered";
  EXPECT_THAT(events_until(cell, EventKind::rebooted), Contains(EventKind::rebooted));
  cell.stop();
  const Counters counters = cell.counters();
  EXPECT_EQ(counters.reboots, 1u);
  EXPECT_EQ(counters.restarts, 0u);
  EXPECT_EQ(counters.lost_network + counters.duplicates + counters.late, 0u);
  EXPECT_EQ(counters.expected, counters.received);
}

TEST(CasesOthersFail, ARebootWithTheStreamStopping) {
  LiveBox box({.time_scale = 4, .faults = {{{"kind", "reboot"}, {"at_s", "4"}, {"down_s", "0.2"}}}});
  const SteadyClock clock(4);
  LoadCell cell(box.address(), clock);
  Consumer consumer(cell);
  cell.start();
  EXPECT_THAT(events_until(cell, EventKind::taken_over), ElementsAre(EventKind::silent, EventKind::taken_over))
      << "the box answers again, and the driver does not fight for what may be another client's stream";
  // Who streams again reads the configuration again.
  LoadCell anew(box.address(), clock);
  Consumer again(anew);
  anew.start();
  ASSERT_TRUE(again.take_until(1000));
  expect_all_delivered(anew, again);
  cell.stop();
  const sim::WireTruth& truth = box.stop();
  EXPECT_EQ(truth.reboots, 1u);
  EXPECT_EQ(truth.starts, 2u);
}

/// A functor that cannot be copied is called in address, and keeps its state.
TEST(CasesOthersFail, AConsumerWithAStateIsNeverCopied) {
  LiveBox box({.time_scale = 4});
  const SteadyClock clock(4);
  LoadCell cell(box.address(), clock);
  Consumer consumer(cell);  // neither copyable nor movable: it compiles, so nobody copies it
  static_assert(!std::is_copy_constructible_v<Consumer> && !std::is_move_constructible_v<Consumer>);
  cell.start();
  ASSERT_TRUE(consumer.take_until(2000));
  expect_all_delivered(cell, consumer);
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
  LiveBox::Manner manner;
  manner.time_scale = 4;
  manner.quirks.bias_stops_stream = stops_stream;
  LiveBox box(manner);
  const SteadyClock clock(4);
  LoadCell cell(box.address(), clock);
  cell.start();
  EXPECT_GT(std::abs(mean_thrust(cell, 2000)), 0.05) << "there was something to take away";
  // The box takes one noisy sample as its zero: what remains is its noise, and after a bad one kphi asks again.
  std::uint64_t asked = 0;
  ASSERT_TRUE(soon([&] {
    const std::uint64_t starts = cell.counters().restarts;
    cell.set_bias();
    ++asked;
    if (stops_stream && !soon([&] { return cell.counters().restarts > starts; })) return true;
    return std::abs(mean_thrust(cell, 2000)) < 0.05;
  }));
  cell.stop();
  EXPECT_EQ(cell.counters().lost_network + cell.counters().lost_host == 0, !stops_stream);
  EXPECT_EQ(cell.counters().restarts, stops_stream ? asked : 0u);
  EXPECT_EQ(box.stop().starts, 1 + (stops_stream ? asked : 0u));
}

TEST(CasesOthersFail, ABiasOnABoxThatKeepsStreaming) { bias(false); }
TEST(CasesOthersFail, ABiasOnABoxThatStopsItsStream) { bias(true); }

}  // namespace cases_others_fail_test
}  // namespace kphi::netbox::test
