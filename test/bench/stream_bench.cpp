// A box at its true 7000 records per second, evenly sent: what that costs of one core and how old the records are when
// the consumer has them, against a loop of poll and recvmmsg that wakes up for each
// datagram, and against the goals of 2 % of a core and of an age (99 of 100) of 0.2 ms, buffered 1 ms. Then the stall
// that the receive buffer survives, and a minute beside two busy loops.
#include "test/bench/figures.hpp"
#include "test/drivers/netbox/busy_loops.hpp"
#include "test/drivers/netbox/receivers.hpp"

namespace {

using namespace kphi;
using namespace kphi::netbox;
using namespace kphi::netbox::test;
using Consumer = Driver::Consumer;

constexpr double kSeconds = 3;

struct Way {
  std::string name;
  bool buffered;
  Consumer consumer;
  bool to_be_cheap;    // 2 % of a core
  double age_goal_us;  // 0: none
};

double percent(double cpu_s, const Cost& cost) { return 100 * cpu_s / cost.wall_s; }

void budget(const BoxProcess& box, const Way& way) {
  const Cost floor = BareReceiver(box.ports(), way.buffered).run(kSeconds, std::chrono::nanoseconds(0));
  const SteadyClock clock;
  Driver driver(box.ports(), clock);
  driver.keep_ages = true;
  const Cost cost = driver.run(kSeconds, way.consumer);
  const auto age_us = [&](std::size_t percentile) { return 1e6 * to_seconds(driver.age(percentile)); };
  fmt::print(
      "{}: {:.2f} % of a core, its consumer {:.2f} %, bare loop {:.2f} %; wake-ups per record {:.3f}; age p50 "
      "{:.0f} p90 {:.0f} p99 {:.0f} us; {} lost\n",
      way.name, percent(cost.receiver_cpu_s, cost), percent(cost.consumer_cpu_s, cost),
      percent(floor.receiver_cpu_s, floor), cost.wakeups_per_record(), age_us(50), age_us(90), age_us(99), cost.lost);
  bench::compared(cost.receiver_ns() / floor.receiver_ns(), way.name + ": CPU time of receive thread / bare loop");
  const double of_goal = percent(cost.receiver_cpu_s, cost) / 2;
  if (way.to_be_cheap) bench::at_most(1, of_goal, way.name + ": CPU time of receive thread / 2 % of a core");
  if (way.age_goal_us > 0)
    bench::at_most(1, age_us(99) / way.age_goal_us, fmt::format("{}: age p99 / {:.0f} us", way.name, way.age_goal_us));
}

void soak(const BoxProcess& box) {
  const BusyLoops busy(2);
  const SteadyClock clock;
  Driver driver(box.ports(), clock);
  driver.keep_ages = true;
  const Cost cost = driver.run(60, Consumer::waits);
  const auto age_ms = [&](std::size_t percentile) { return 1e3 * to_seconds(driver.age(percentile)); };
  fmt::print(
      "buffered, 60 s beside 2 busy loops: {} records, {} lost, {}; age p50 {:.2f} p99 {:.2f} oldest {:.1f} ms\n",
      cost.records, cost.lost, driver.in_order ? "in order" : "OUT OF ORDER", age_ms(50), age_ms(99), age_ms(100));
  bench::at_most(1, age_ms(99) / 20, "buffered, 60 s beside 2 busy loops: age p99 / 20 ms");
  bench::at_most(0, static_cast<double>(cost.lost) / static_cast<double>(cost.records),
                 "buffered, 60 s beside 2 busy loops: lost / received");
}

void stall(const BoxProcess& box, const char* mode) {
  const SteadyClock clock;
  Driver driver(box.ports(), clock);
  const netbox::ReceiveBuffer buffer = driver.cell().receive_buffer();
  fmt::print("{}: receive buffer {}\n", mode, buffer.note());
  const double ms = buffer.tolerated_ms();
  bench::at_least(30, ms / 30, fmt::format("{}: stall tolerated / netft-cpp's 30 ms", mode));
}

}  // namespace

int main() {
  const BoxProcess single({.records_per_datagram = 1}), blocks({});
  budget(blocks, {"buffered, consumer waits", true, Consumer::waits, true, 1000});
  budget(single, {"single-record, consumer polls", false, Consumer::polls, true, 0});
  budget(single, {"single-record, consumer waits", false, Consumer::waits, true, 3000});
  stall(single, "single-record");
  stall(blocks, "buffered");
  soak(blocks);
}
