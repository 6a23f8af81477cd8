// Figures on the quality of the stream: rates, jitter, clock, queue.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>

#include "base/clock.hpp"
#include "drivers/netbox/stream/clock_estimate.hpp"
#include "drivers/netbox/stream/sequence.hpp"

namespace kphi::netbox {

/// Quantiles of delays from 0 to hours, each at most 12.5 % too high. Integers only, a few nanoseconds per value.
class DelayHistogram {
 public:
  /// Negative delays count as zero.
  void add(Duration delay) noexcept {
    const auto ns = static_cast<std::uint64_t>(std::max<std::int64_t>(0, delay.count()));
    ++counts_[class_of(ns)];
    ++total_;
  }
  void clear() noexcept {
    counts_.fill(0);
    total_ = 0;
  }
  [[nodiscard]] std::uint64_t total() const noexcept { return total_; }
  /// The `share` (0..1) of all delays is not above it; 0 when there is none.
  [[nodiscard]] Duration quantile(double share) const noexcept {
    auto left = static_cast<std::uint64_t>(share * static_cast<double>(total_));
    for (std::size_t i = 0; i < counts_.size(); ++i) {
      if (counts_[i] > left) return Duration(static_cast<std::int64_t>(upper_end(i)));
      left -= counts_[i];
    }
    return Duration{0};
  }

 private:
  // Eight classes for each power of two.
  static std::size_t class_of(std::uint64_t ns) noexcept {
    if (ns < 8) return ns;
    const auto power = static_cast<std::size_t>(std::bit_width(ns)) - 4;
    return std::min<std::size_t>(8 * power + (ns >> power), kClasses - 1);
  }
  static std::uint64_t upper_end(std::size_t index) noexcept {
    if (index < 16) return index;
    const std::size_t power = index / 8 - 1;
    return ((index - 8 * power + 1) << power) - 1;
  }

  static constexpr std::size_t kClasses = 8 * 44;
  std::array<std::uint64_t, kClasses> counts_{};
  std::uint64_t total_ = 0;
};

/// Bench time and bench rates. Since the last start().
struct Health {
  double records_per_second = 0;
  double datagrams_per_second = 0;
  std::int64_t jitter_p50_ns = 0;  ///< arrival after that of the least delayed datagram: device clock, mapped
  std::int64_t jitter_p99_ns = 0;
  double skew_ppm = 0;                    ///< device clock slow against this host's: positive; 0 before it is known
  std::int64_t clock_uncertainty_ns = 0;  ///< without the constant part of the delay
  std::uint64_t clock_epochs = 0;         ///< 1 + reboots seen
  std::uint64_t queue_high_water = 0;     ///< most records that waited for the consumer
  std::uint64_t events_dropped = 0;       ///< beyond what the lists hold
};

/// One thread.
class HealthMeter {
 public:
  explicit HealthMeter(double device_rate_hz) noexcept : clock_(device_rate_hz) {}
  void begin() noexcept;
  /// `newest`: the last record delivered from a datagram.
  void note(const StampedRecord& newest, std::uint64_t records, std::uint64_t reboots) noexcept;
  void note_queue(std::uint64_t waiting) noexcept { high_water_ = waiting > high_water_ ? waiting : high_water_; }
  [[nodiscard]] Health health() const noexcept;

 private:
  ClockEstimate clock_;
  DelayHistogram jitter_;
  std::uint64_t reboots_ = 0, records_ = 0, datagrams_ = 0, high_water_ = 0;
  Instant first_{0}, newest_{0};
};

}  // namespace kphi::netbox
