// What a record costs on its way from the kernel to the queue at 200 000 records per second, against a loop of recvmmsg
// that only swaps bytes, both with the same naps, interleaved. Goal: at most 1.5 times as much, nothing lost.
#include "test/bench/figures.hpp"
#include "test/drivers/netbox/receivers.hpp"

namespace {

using namespace kphi;
using namespace kphi::netbox;
using namespace kphi::netbox::test;

constexpr int kPairs = 9;

void compare(const BoxProcess& box, bool buffered, const std::string& mode) {
  std::vector<double> ratios, with_consumer, bare_ns, driver_ns;
  for (int i = 0; i < kPairs; ++i) {
    const std::optional<Pair> pair = measure_pair(box, buffered, 0.7);
    if (!pair) continue;
    ratios.push_back(pair->ratio());
    with_consumer.push_back(pair->ratio_with_consumer());
    bare_ns.push_back(pair->bare.receiver_ns());
    driver_ns.push_back(pair->driver.receiver_ns());
  }
  if (ratios.empty()) return fmt::print("{}: no pair, the generator never reached its rate\n", mode), void();
  fmt::print(
      "{}: bare loop {:.0f} ns/record, receive thread {:.0f}; it and the consumer / bare loop {:.2f}; worst pair "
      "{:.2f}; {} of "
      "{} pairs void\n",
      mode, median(bare_ns), median(driver_ns), median(with_consumer), *std::max_element(ratios.begin(), ratios.end()),
      kPairs - static_cast<int>(ratios.size()), kPairs);
  bench::at_most(1.5, median(ratios), mode + ", 200 k/s: CPU time of receive thread / bare recvmmsg loop");
}

void lose_nothing(const BoxProcess& box, const std::string& mode) {
  const SteadyClock clock(kHasteHz / 7000);
  Driver driver(box.ports(), clock);
  const Cost cost = driver.run(5, Driver::Consumer::waits);
  fmt::print("{}: {} records at {:.0f}/s, {} lost, {}\n", mode, cost.records, cost.rate_hz(), cost.lost,
             driver.in_order ? "in order" : "OUT OF ORDER");
  bench::at_most(0, static_cast<double>(cost.lost) / static_cast<double>(cost.records),
                 mode + ", 200 k/s for 5 s: lost / received");
}

}  // namespace

int main() {
  const double speed = kHasteHz / 7000;
  const BoxProcess single({.records_per_datagram = 1, .speed = speed}), blocks({.speed = speed});
  compare(blocks, true, "buffered");
  compare(single, false, "single-record");
  lose_nothing(blocks, "buffered");
  lose_nothing(single, "single-record");
}
