// Any text as a script of faults: refused, or one with which the wire neither makes up nor loses count of a datagram.
#include <cstdlib>
#include <string>

#include "base/error.hpp"
#include "drivers/sim/input_files.hpp"
#include "drivers/sim/netbox/fault_injector.hpp"
#include "test/fuzz/tokens.hpp"

namespace {

using namespace kphi;

constexpr std::string_view kTokens[] = {
    "format: kphi-faults/1\nfaults:\n",
    "  - {at_s: 0, for_s: 1, kind: loss, p: 0.1, burst: 3}\n",
    "  - {at_s: 0, for_s: 1, kind: gilbert, p_good_bad: 0.1, p_bad_good: 0.5}\n",
    "  - {at_s: 0, for_s: 1, kind: duplicate, p: 0.5, delay_s: 0.01}\n",
    "  - {at_s: 0, for_s: 1, kind: reorder, p: 0.5, depth: 5}\n",
    "  - {at_s: 0, for_s: 1, kind: delay, delay_s: 0.01, jitter_s: 0.01}\n",
    "  - {at_s: 0, for_s: 1, kind: jitter, mean_s: 0.001, spike_s: 0.01}\n",
    "  - {at_s: 0, for_s: 0.01, kind: hold}\n",
    "  - {at_s: 0, count: 5, kind: wrong_size, size: 35, replaces: true}\n",
    "  - {at_s: 0, for_s: 1, kind: short_block, records: 3}\n",
    "  - {at_s: 0, for_s: 1, kind: foreign_source}\n",
    "  - {at_s: 0, count: 1, kind: doubled_start, delay_s: 0.01}\n",
    "  - {at_s: 0.01, kind: taken_over}\n",
    "  - {at_s: 0.01, kind: reboot, down_s: 0.01, resume: true}\n",
    "  - {at_s: 0.01, for_s: 0.01, kind: stall}\n",
    "  - {at_s: 0.01, kind: overrun, samples: 3}\n",
    "  - {at_s: 0.01, kind: rate, rate_hz: 1000}\n",
    "  - {at_s: 0, kind: clock_skew, ppm: 500, wander_ppm: 3}\n",
    "  - {at_s: 0, kind: zero_drift, axis: 2, amount: 0.5}\n",
    "  - {at_s: 0, kind: units, force_unit: 1}\n",
    "  - {at_s: 0, count: 1, kind: http_missing_tag, tag: cfgcpf}\n",
    "quirks: {rate_write: continues, last_block: padded}\n",
};

void require(bool condition) {
  if (!condition) std::abort();
}

void stream_through(const std::string& text) {
  sim::NetBoxSettings settings;
  settings.records_per_datagram = 7;
  const sim::FaultFile file = sim::parse_faults(text, "faults.yaml");
  settings.quirks = file.quirks;
  sim::NetBoxDevice box(settings);
  sim::FaultInjector wire(box, file.faults, 1);
  wire.request(std::array<std::uint8_t, 8>{0x12, 0x34, 0, 3, 0, 0, 0, 0}, 7, Instant{0});
  sim::Datagram datagram;
  std::uint64_t taken = 0;
  for (std::int64_t tick = 1; tick <= 700; ++tick) {
    const Instant now(tick * 1'000'000 / 7);
    wire.sample({now, {}});
    while (wire.next_datagram(datagram, now)) {
      require(datagram.size <= sim::kDatagramBytesMax && datagram.at <= now);
      ++taken;
    }
  }
  const sim::WireTruth& truth = wire.truth();
  require(taken == truth.arrived + truth.malformed + truth.foreign);
  require(truth.arrived <= truth.sent + truth.duplicated && truth.dropped <= truth.sent);
}

}  // namespace

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t max, unsigned seed) {
  return kphi::test::mutate_with(kTokens, data, size, max, seed);
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    stream_through({reinterpret_cast<const char*>(data), size});
  } catch (const ConfigurationError&) {
  }
  return 0;
}
