// The motor's link against a module whose bytes take their time on the wire. Each row is one run of some seconds:
// readings of four quantities per second, and the share of one core that the driver takes (getrusage, less the fake
// module's own thread).
#include <benchmark/benchmark.h>
#include <sys/resource.h>

#include <algorithm>
#include <array>
#include <thread>

#include "drivers/iq/link/motor.hpp"
#include "test/bench/paced_module.hpp"
#include "test/soon.hpp"

namespace kphi::iq {
namespace {

using namespace std::chrono_literals;
using test::soon;
constexpr MotorChannel kFour[] = {MotorChannel::speed, MotorChannel::motor_current, MotorChannel::supply_voltage,
                                  MotorChannel::supply_current};

double cpu_seconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

/// Arguments: baud, cycles per second asked for, quantities in each cycle.
void poll(benchmark::State& state) {
  const auto baud = static_cast<unsigned>(state.range(0));
  Settings settings;
  settings.telemetry_hz = static_cast<double>(state.range(1));
  settings.slow_hz = 1;
  settings.every_cycle.assign(std::begin(kFour), std::begin(kFour) + state.range(2));
  for (auto _ : state) {
    fake::PacedModule module(baud);
    const SteadyClock clock;
    Motor motor(module.device(), baud, settings, clock);
    std::array<MotorReading, 1024> readings;
    if (!soon([&] { return motor.take(readings) > 0; })) return state.SkipWithError("the module never answered");
    std::array<int, kMotorChannels.size()> count{};
    const double cpu = cpu_seconds() - module.cpu_seconds();
    const Instant begin = clock.now();
    while (clock.now() - begin < 3s) {
      std::this_thread::sleep_for(50ms);  // a consumer that costs next to nothing
      while (const std::size_t n = motor.take(readings)) {
        for (std::size_t i = 0; i < n; ++i) ++count[static_cast<std::size_t>(readings[i].channel)];
      }
    }
    const double seconds = to_seconds(clock.now() - begin);
    const auto rate_of = [&](MotorChannel q) { return count[static_cast<std::size_t>(q)] / seconds; };
    double rate = 1e9;
    for (const MotorChannel quantity : settings.every_cycle) rate = std::min(rate, rate_of(quantity));
    state.counters["cycles/s"] = rate;
    state.counters["cpu_percent"] = 100 * (cpu_seconds() - module.cpu_seconds() - cpu) / seconds;
    state.counters["median_latency_us"] = 1e6 * to_seconds(motor.round_trips().quantile(0.5));
    state.counters["timeouts"] = static_cast<double>(motor.counters().timeouts);
    state.counters["skipped"] = static_cast<double>(motor.counters().skipped_polls);
  }
}

// The wire's own limits: 262 and 2095 cycles of four quantities.
BENCHMARK(poll)->Args({115200, 260, 4})->Iterations(1)->Unit(benchmark::kSecond);
BENCHMARK(poll)->Args({921600, 2000, 4})->Iterations(1)->Unit(benchmark::kSecond);
BENCHMARK(poll)->Args({921600, 1000, 1})->Iterations(1)->Unit(benchmark::kSecond);
BENCHMARK(poll)->Args({921600, 1000, 4})->Iterations(1)->Unit(benchmark::kSecond);
BENCHMARK(poll)->Args({115200, 50, 1})->Iterations(1)->Unit(benchmark::kSecond);

}  // namespace
}  // namespace kphi::iq
