// The process stands still, or its consumer does: nothing is lost.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>

#include <vector>

#include "test/drivers/netbox/box_process.hpp"
#include "test/drivers/netbox/load_cell_bench.hpp"

namespace kphi::netbox::standstill_test {

using namespace std::chrono_literals;
using namespace test;

/// The child's life: streams 15 000 records and tells its account.
void be_the_reader(const Pipe& orders, const Pipe& reports) {
  Ports ports{};
  if (!orders.get(ports)) return;
  const SteadyClock clock;
  LoadCell cell({"127.0.0.1", ports.rdt, ports.http}, clock);
  cell.start();
  if (!soon([&] { return cell.counters().received >= 1000; })) return;
  reports.put(static_cast<int>(cell.receive_buffer().tolerated_ms()));
  if (!soon([&] { return cell.counters().received + cell.counters().lost_host >= 15'000; })) return;
  cell.stop();
  reports.put(cell.counters());
}

TEST(Standstill, AProcessStoppedForASecondLosesNothingOneRecordPerDatagram) {
  const Pipe orders, reports;
  const pid_t child = fork();  // before any thread of this test lives
  ASSERT_GE(child, 0);
  if (child == 0) {
    be_the_reader(orders, reports);
    _exit(0);
  }
  FakeWeb web(FakeWeb::page(streaming_xml(1)));
  FakeBox box({.records_per_datagram = 1});
  int tolerated_ms = 0;
  Counters counters;
  const bool started = orders.put(Ports{box.port(), web.port()}) && reports.get(tolerated_ms);
  const std::uint64_t before = box.sent();
  kill(child, SIGSTOP);
  const bool a_second_has_passed = soon([&] { return box.sent() >= before + 7000; });
  kill(child, SIGCONT);
  const bool reported = reports.get(counters);
  if (!reported) kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
  ASSERT_TRUE(started && a_second_has_passed && reported);
  EXPECT_EQ(counters.expected, counters.received + counters.lost_network + counters.lost_host);
  if (tolerated_ms < 1100)
    GTEST_SKIP() << "the kernel grants a buffer for " << tolerated_ms << " ms only: raise net.core.rmem_max to 4194304";
  EXPECT_EQ(counters.lost_network + counters.lost_host + counters.queue_overflows, 0u);
  EXPECT_GE(counters.received, 15'000u);
  EXPECT_EQ(box.starts(), 1) << "it carries on, it does not begin anew";
}

TEST(Standstill, AConsumerThatStandsStillForFiveSecondsLosesNothing) {
  Bench bench({.records_per_datagram = 1});
  bench.cell.start();
  ASSERT_TRUE(soon([&] { return bench.cell.counters().received >= 35'000; }));
  bench.cell.stop();
  const Counters counters = bench.cell.counters();
  EXPECT_EQ(counters.queue_overflows + counters.lost_network + counters.lost_host, 0u);
  EXPECT_GE(bench.cell.health().queue_high_water, 35'000u);
  EXPECT_NEAR(bench.cell.health().records_per_second, 7000, 200);
  std::vector<LoadCellRecord> taken(counters.received + 1);
  EXPECT_EQ(bench.cell.take(taken), counters.received);
  for (std::size_t i = 1; i < counters.received; ++i) ASSERT_EQ(taken[i].ft_sequence, taken[i - 1].ft_sequence + 1);
}

}  // namespace kphi::netbox::standstill_test
