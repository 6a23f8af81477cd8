#include "drivers/netbox/stream/batching.hpp"

#include <algorithm>

namespace kphi::netbox {
namespace {

using namespace std::chrono_literals;

constexpr Duration kPrompt = 150us, kGathered = 2ms;
// The last one may be a little late, and is worth waiting for.
constexpr Duration kMargin = 10us;
// Where datagrams come in bunches, which one will be the next cannot be told: sleeping would only make them older.
constexpr std::uint64_t kEvenEnough = 16;

Duration in_bench_time(Duration wall, double bench_per_wall) noexcept {
  return from_seconds(to_seconds(wall) * bench_per_wall);
}

/// As many as let the first grow no older than `limit`.
std::int64_t datagrams_within(Duration limit, Duration period) noexcept {
  return 1 + limit / std::max(period, Duration{1});
}

}  // namespace

Batching::Batching(HandOver policy, Duration period, double bench_per_wall) noexcept
    : policy_(policy),
      period_(period),
      margin_(in_bench_time(kMargin, bench_per_wall)),
      prompt_(datagrams_within(in_bench_time(kPrompt, bench_per_wall), period)),
      gathered_(datagrams_within(in_bench_time(kGathered, bench_per_wall), period)) {}

Duration Batching::sleep_time(Instant now, bool awaited) const noexcept {
  const std::int64_t count = together(awaited);
  if (count < 2) return Duration{0};
  // Counted from the newest datagram, not from now: else the naps would drift against the stream.
  const Duration whole = count * period_ + margin_;
  return std::clamp(newest_ + whole - now, Duration{0}, whole);
}

std::int64_t Batching::together(bool awaited) const noexcept {
  switch (policy_) {
    case HandOver::at_once:
      return 1;
    case HandOver::gathered:
      return gathered_;
    case HandOver::as_asked:
      if (!awaited) return gathered_;
      [[fallthrough]];
    case HandOver::prompt:
      break;
  }
  return even_ >= kEvenEnough ? prompt_ : 1;
}

}  // namespace kphi::netbox
