#include "base/clock.hpp"

#include <algorithm>

namespace kphi {
namespace {

std::int64_t read(clockid_t id) noexcept {
  timespec t{};
  clock_gettime(id, &t);
  return to_duration(t).count();
}

Duration scaled(std::int64_t ns, double factor) noexcept {
  return Duration(static_cast<std::int64_t>(static_cast<double>(ns) * factor));
}

/// Exact to the time between two readings; a thread that is held up between them reads again.
std::int64_t lead_of_boottime() noexcept {
  constexpr std::int64_t kHeldUp = 20'000;
  std::int64_t lead = 0;
  for (int attempt = 0; attempt < 8; ++attempt) {
    const std::int64_t before = read(CLOCK_MONOTONIC);
    const std::int64_t boottime = read(CLOCK_BOOTTIME);
    const std::int64_t after = read(CLOCK_MONOTONIC);
    lead = boottime - after;
    if (after - before < kHeldUp) break;
  }
  return lead;
}

}  // namespace

SteadyClock::SteadyClock(double scale) noexcept
    : scale_(scale),
      epoch_monotonic_ns_(read(CLOCK_MONOTONIC)),
      epoch_realtime_ns_(read(CLOCK_REALTIME)),
      epoch_lead_ns_(lead_of_boottime()) {}

Instant SteadyClock::now() const noexcept { return scaled(read(CLOCK_MONOTONIC) - epoch_monotonic_ns_, scale_); }
Duration SteadyClock::stretched(Duration wall) const noexcept { return scaled(wall.count(), scale_); }
Duration SteadyClock::shrunk(Duration bench) const noexcept { return scaled(bench.count(), 1.0 / scale_); }

Instant SteadyClock::at_realtime(const timespec& stamp) const noexcept {
  // A paired reading, so that a step of the calendar clock does not move the samples.
  const std::int64_t realtime = read(CLOCK_REALTIME);
  const std::int64_t monotonic = read(CLOCK_MONOTONIC);
  return scaled(monotonic - (realtime - to_duration(stamp).count()) - epoch_monotonic_ns_, scale_);
}

std::chrono::system_clock::time_point SteadyClock::epoch_utc() const noexcept {
  return std::chrono::system_clock::time_point(
      std::chrono::duration_cast<std::chrono::system_clock::duration>(std::chrono::nanoseconds(epoch_realtime_ns_)));
}

Duration SteadyClock::suspended() const noexcept {
  return Duration(std::max<std::int64_t>(0, lead_of_boottime() - epoch_lead_ns_));
}

}  // namespace kphi
