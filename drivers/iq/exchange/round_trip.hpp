// How long the module takes to answer: the time-out of the next request, and a histogram.
#pragma once

#include <array>
#include <cstdint>

#include "base/clock.hpp"

namespace kphi::iq {

/// Durations from 1 µs to 1 s, four buckets per octave; shorter and longer ones are counted in the outermost buckets.
class RoundTripHistogram {
 public:
  static constexpr std::size_t kBuckets = 81;
  void add(Duration duration) noexcept;
  [[nodiscard]] std::uint64_t count() const noexcept { return count_; }
  [[nodiscard]] const std::array<std::uint32_t, kBuckets>& buckets() const noexcept { return buckets_; }
  /// Where bucket `i` begins.
  [[nodiscard]] static Duration lower_edge(std::size_t i) noexcept;
  /// The duration below which this share, 0..1, of all lies, within 10 %. Zero before the first.
  [[nodiscard]] Duration quantile(double share) const noexcept;

 private:
  std::array<std::uint32_t, kBuckets> buckets_{};
  std::uint64_t count_ = 0;
};

/// The time-out of a request from the measured round trips: smoothed + 4 mean deviations (RFC 6298, equations 2.2 and
/// 2.3), doubled by each series of time-outs, clamped between two bounds. It starts at the longest.
class AdaptiveTimeout {
 public:
  AdaptiveTimeout(Duration shortest, Duration longest) noexcept
      : shortest_(shortest), longest_(longest), timeout_(longest) {}
  void measured(Duration round_trip) noexcept;
  /// A request that was sent at `sent` timed out. Requests sent before the last doubling do not double it again.
  void timed_out(Instant sent, Instant now) noexcept;
  [[nodiscard]] Duration timeout() const noexcept { return timeout_; }
  /// Zero before the first.
  [[nodiscard]] Duration smoothed() const noexcept { return smoothed_; }

 private:
  Duration shortest_, longest_;
  Duration timeout_;
  Duration smoothed_{0}, deviation_{0};
  Instant doubled_at_{Instant::min()};
};

}  // namespace kphi::iq
