// A box at its true 7000 records per second: what that costs of one core and how old the records are when the consumer
// has them, for each way of taking them; and a minute beside two busy loops.
#include <fmt/format.h>

#include "test/drivers/netbox/busy_loops.hpp"
#include "test/drivers/netbox/receivers.hpp"

namespace {

using namespace kphi;
using namespace kphi::netbox;
using namespace kphi::netbox::test;

constexpr double kSeconds = 5;

double percent(double cpu_s, const Cost& cost) { return 100 * cpu_s / cost.wall_s; }

Cost bare(const BoxProcess& box, bool buffered, std::chrono::nanoseconds nap) {
  BareReceiver receiver(box.ports(), buffered);
  return receiver.run(kSeconds, nap);
}

void budget(const char* what, const BoxProcess& box, bool buffered, Driver::Consumer consumer,
            std::chrono::nanoseconds bare_nap, double age_goal_us) {
  const Cost floor = bare(box, buffered, bare_nap);
  const SteadyClock clock;
  Driver driver(box.ports(), clock, buffered);
  driver.keep_ages = true;
  const Cost cost = driver.run(kSeconds, consumer);
  const auto& ages = driver.ages();
  const auto age_us = [&](std::size_t percentile) { return 1e6 * to_seconds(ages[ages.size() * percentile / 100]); };
  fmt::print(
      "{:<31} receive thread / bare loop {:.2f}; of a core {:.2f} % (goal 2), bare {:.2f} %, consumer {:.2f} %; ", what,
      cost.receiver_ns() / floor.receiver_ns(), percent(cost.receiver_cpu_s, cost),
      percent(floor.receiver_cpu_s, floor), percent(cost.consumer_cpu_s, cost));
  if (age_goal_us > 0) {
    fmt::print("hand-over p99 / goal of {:.0f} us {:.2f} (p50 {:.0f} us, p99 {:.0f} us); ", age_goal_us,
               age_us(99) / age_goal_us, age_us(50), age_us(99));
  }
  fmt::print("{} lost\n", cost.lost);
}

void soak(const BoxProcess& box) {
  const BusyLoops busy(2);
  const SteadyClock clock;
  Driver driver(box.ports(), clock, true);
  driver.keep_ages = true;
  const Cost cost = driver.run(60, Driver::Consumer::waits);
  const auto& ages = driver.ages();
  const double p99_ms = 1e3 * to_seconds(ages[ages.size() * 99 / 100]);
  fmt::print(
      "buffered, 60 s beside 2 busy loops  {} records, {} lost (goal 0), {}; age p99 / goal of 20 ms: {:.2f} (p50 "
      "{:.2f} "
      "ms, p99 {:.2f} ms, oldest {:.1f} ms)\n",
      cost.records, cost.lost, driver.in_order ? "in order" : "OUT OF ORDER", p99_ms / 20,
      1e3 * to_seconds(ages[ages.size() / 2]), p99_ms, 1e3 * to_seconds(ages.back()));
}

void stall(const BoxProcess& box, bool buffered) {
  const SteadyClock clock;
  Driver driver(box.ports(), clock, buffered);
  const std::string note = driver.cell().receive_buffer_note();
  const double ms = std::stod(note.substr(note.find("tolerates ") + 10));
  fmt::print("{} stall tolerated / netft-cpp's 30 ms: {:.0f} (goal 30); receive buffer {}\n",
             buffered ? "buffered     " : "single-record", ms / 30, note);
}

}  // namespace

int main() {
  const BoxProcess single({.records_per_datagram = 1}), blocks({});
  constexpr auto kNone = std::chrono::nanoseconds(0);
  budget("buffered, consumer waits", blocks, true, Driver::Consumer::waits, kNone, 1000);
  budget("single-record, consumer waits", single, false, Driver::Consumer::waits, kNone, 200);
  budget("buffered, consumer polls", blocks, true, Driver::Consumer::polls, kBareNap, 0);
  budget("single-record, consumer polls", single, false, Driver::Consumer::polls, kBareNap, 0);
  stall(single, false);
  stall(blocks, true);
  soak(blocks);
}
