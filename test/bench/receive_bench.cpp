// What a record costs on its way from the kernel to the queue at 200 000 records per second, against a loop of recvmmsg
// that only swaps bytes, both with the same naps, interleaved. Goal: at most 1.5 times as much, nothing lost.
#include <fmt/format.h>

#include "test/drivers/netbox/receivers.hpp"

namespace {

using namespace kphi;
using namespace kphi::netbox;
using namespace kphi::netbox::test;

void compare(const BoxProcess& box, bool buffered) {
  const char* mode = buffered ? "buffered     " : "single-record";
  std::vector<double> ratios, with_consumer, bare_ns;
  int unusable = 0;
  for (int i = 0; i < 9; ++i) {
    const std::optional<Pair> pair = measure_pair(box, buffered, 1.0);
    if (!pair) {
      ++unusable;
      continue;
    }
    ratios.push_back(pair->ratio());
    with_consumer.push_back(pair->ratio_with_consumer());
    bare_ns.push_back(pair->bare.receiver_ns());
  }
  if (ratios.empty()) return fmt::print("{} no pair: the generator never reached its rate\n", mode), void();
  fmt::print(
      "{} 200 k/s  receive thread / bare recvmmsg loop: median {:.2f} worst {:.2f} (goal 1.50); with its consumer "
      "{:.2f}; bare {:.0f} ns/record; {} pairs, {} void\n",
      mode, median(ratios), *std::max_element(ratios.begin(), ratios.end()), median(with_consumer), median(bare_ns),
      ratios.size(), unusable);
}

void lose_nothing(const BoxProcess& box, bool buffered) {
  const SteadyClock clock(kHasteHz / 7000);
  Driver driver(box.ports(), clock, buffered);
  const Cost cost = driver.run(5, Driver::Consumer::waits);
  fmt::print("{} 200 k/s for 5 s  {} records at {:.0f}/s, {} lost (goal 0), {}\n",
             buffered ? "buffered     " : "single-record", cost.records, cost.rate_hz(), cost.lost,
             driver.in_order ? "in order" : "OUT OF ORDER");
}

}  // namespace

int main() {
  const double speed = kHasteHz / 7000;
  const BoxProcess single({.records_per_datagram = 1, .speed = speed}), blocks({.speed = speed});
  compare(blocks, true);
  compare(single, false);
  lose_nothing(blocks, true);
  lose_nothing(single, false);
}
