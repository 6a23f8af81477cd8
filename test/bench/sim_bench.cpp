// What one tick of the simulated load cell costs: measure, judge, count, encode and hand over; 7000 of them are a
// second of the bench. Goal: 150 ns with everything switched on, on a quiet machine.
#include <benchmark/benchmark.h>

#include <array>

#include "drivers/sim/simulated_bench.hpp"

namespace {

using namespace kphi;
using namespace kphi::sim;

constexpr int kTicks = 7000;

NetBoxSettings settings_of(bool all_on) {
  NetBoxSettings settings;
  if (!all_on) return settings;
  settings.filter = 4;
  settings.bias_vector = {5, 5, 5, 5, 5, 5};
  return settings;
}

/// Box and wire alone, in one mode; the datagrams are taken as a server would, every millisecond.
void tick_of_the_box(benchmark::State& state, bool all_on, std::uint8_t command, FaultScript faults = {}) {
  NetBoxDevice box(settings_of(all_on));
  FaultInjector wire(box, std::move(faults), 1);
  wire.request(std::array<std::uint8_t, 8>{0x12, 0x34, 0, command, 0, 0, 0, 0}, 7, Instant{0});
  Datagram datagram;
  std::int64_t tick = 0;
  Wrench wrench{0.1, 0.2, 9.0, 0.01, 0.02, 0.03};
  for (auto _ : state) {
    for (int i = 0; i < kTicks; ++i) {
      const Instant now(++tick * 1'000'000 / 7);
      wrench[2] += 1e-9;
      wire.sample({now, wrench});
      if (tick % 7 == 0) {
        while (wire.next_datagram(datagram, now)) benchmark::DoNotOptimize(datagram.bytes[0]);
      }
    }
  }
  if (wire.truth().records_sent == 0) state.SkipWithError("nothing was sent");
  state.SetItemsProcessed(state.iterations() * kTicks);
}
BENCHMARK_CAPTURE(tick_of_the_box, buffered, false, std::uint8_t{3});
BENCHMARK_CAPTURE(tick_of_the_box, real_time, false, std::uint8_t{2});
BENCHMARK_CAPTURE(tick_of_the_box, buffered_all_on, true, std::uint8_t{3});
BENCHMARK_CAPTURE(tick_of_the_box, real_time_all_on, true, std::uint8_t{2});
BENCHMARK_CAPTURE(tick_of_the_box, buffered_with_loss, false, std::uint8_t{3},
                  FaultScript{fault_of({{"kind", "loss"}, {"at_s", "0"}, {"for_s", "1000000"}, {"p", "0.01"}})});
BENCHMARK_CAPTURE(tick_of_the_box, real_time_with_loss, false, std::uint8_t{2},
                  FaultScript{fault_of({{"kind", "loss"}, {"at_s", "0"}, {"for_s", "1000000"}, {"p", "0.01"}})});

/// Physics of motor, propeller and load cell besides.
void tick_of_the_bench(benchmark::State& state) {
  SimulatedBench bench{BenchSettings{}};
  bench.mount("5x3", 45);
  bench.wire().request(std::array<std::uint8_t, 8>{0x12, 0x34, 0, 3, 0, 0, 0, 0}, 7, Instant{0});
  Datagram datagram;
  Instant now{0};
  for (auto _ : state) {
    for (int i = 0; i < 1000; ++i) {
      bench.advance(now += std::chrono::milliseconds(1));
      while (bench.wire().next_datagram(datagram, now)) benchmark::DoNotOptimize(datagram.bytes[0]);
    }
  }
  state.SetItemsProcessed(static_cast<std::int64_t>(bench.ticks()));
}
BENCHMARK(tick_of_the_bench);

}  // namespace
