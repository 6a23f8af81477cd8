// The latency of single calls: each timed by itself, thousands of inputs, each many times and in a new order every
// time.
//
// What the operating system does to a call it may do to any call; what an input costs it costs every time. So an
// input's cost is its median over the rounds: an interruption drops out unless it strikes half of them, while a branch
// that the processor cannot foresee stays in. The raw tail is told besides, next to that of a piece of work which is
// the same every time and was timed in the same way: what that one shows is the machine's.
#pragma once

#include <sched.h>
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <numeric>
#include <random>
#include <vector>
#if defined(__x86_64__)
#include <x86intrin.h>
#endif

namespace kphi::bench {

#if defined(__x86_64__)
/// Ticks of the processor's time stamp, between two fences: nothing of the call runs outside them.
inline std::uint64_t ticks_before() {
  _mm_lfence();
  const std::uint64_t now = __rdtsc();
  _mm_lfence();
  return now;
}
inline std::uint64_t ticks_after() {
  unsigned core = 0;
  const std::uint64_t now = __rdtscp(&core);
  _mm_lfence();
  return now;
}
inline constexpr const char* kTick = "time stamp ticks";
#else
inline std::uint64_t ticks_before() {
  return static_cast<std::uint64_t>(std::chrono::steady_clock::now().time_since_epoch().count());
}
inline std::uint64_t ticks_after() { return ticks_before(); }
inline constexpr const char* kTick = "ns";
#endif

/// Stays on the core it is on: its caches and its clock are then one. Nothing if the system does not let it.
inline void stay_on_this_core() {
  cpu_set_t one;
  CPU_ZERO(&one);
  CPU_SET(static_cast<unsigned>(sched_getcpu()), &one);
  (void)sched_setaffinity(0, sizeof one, &one);
}

inline long context_switches() {
  rusage usage{};
  getrusage(RUSAGE_THREAD, &usage);
  return usage.ru_nivcsw + usage.ru_nvcsw;
}

/// The value below which `share` of them lie.
inline double quantile(std::vector<double> values, double share) {
  const std::size_t at =
      std::min(values.size() - 1, static_cast<std::size_t>(share * static_cast<double>(values.size())));
  std::nth_element(values.begin(), values.begin() + static_cast<long>(at), values.end());
  return values[at];
}

struct Latencies {
  double usual = 0;                         ///< median of all calls
  double dearest = 0;                       ///< of the inputs' medians, the largest
  double p999 = 0, p9999 = 0, longest = 0;  ///< of all calls, raw
  std::size_t calls = 0;
  long switches = 0;  ///< of context, meanwhile

  [[nodiscard]] double worst_over_median() const { return dearest / usual; }
};

/// Ticks of each call of `work(input)`, inputs 0 to `inputs` − 1, less `clock`, what timing nothing takes.
template <class Work>
Latencies latencies(std::size_t inputs, std::size_t rounds, double clock, Work&& work) {
  std::mt19937_64 random(3);
  std::vector<std::size_t> order(inputs);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::vector<double> ticks(inputs * rounds);
  const long switches = context_switches();
  for (std::size_t round = 0; round < rounds; ++round) {
    std::shuffle(order.begin(), order.end(), random);
    for (const std::size_t input : order) {
      const std::uint64_t begun = ticks_before();
      work(input);
      ticks[input * rounds + round] = static_cast<double>(ticks_after() - begun) - clock;
    }
  }
  Latencies found;
  found.switches = context_switches() - switches;
  found.calls = ticks.size();
  for (auto from = ticks.begin(); from != ticks.end(); from += static_cast<long>(rounds)) {
    found.dearest = std::max(found.dearest, quantile({from, from + static_cast<long>(rounds)}, 0.5));
  }
  found.usual = quantile(ticks, 0.5);
  found.p999 = quantile(ticks, 0.999);
  found.p9999 = quantile(ticks, 0.9999);
  found.longest = *std::max_element(ticks.begin(), ticks.end());
  return found;
}

/// What timing nothing takes.
inline double ticks_of_the_clock() {
  return latencies(1000, 101, 0, [](std::size_t) {}).usual;
}

}  // namespace kphi::bench
