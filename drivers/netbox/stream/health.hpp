// How well the stream does, in figures for a person or a script.
#pragma once

#include <cstdint>

#include "base/clock.hpp"
#include "drivers/netbox/stream/clock_estimate.hpp"
#include "drivers/netbox/stream/delay_histogram.hpp"
#include "drivers/netbox/stream/sequence.hpp"

namespace kphi::netbox {

/// Bench time and bench rates. Since the last start().
struct Health {
  double records_per_second = 0;
  double datagrams_per_second = 0;
  std::int64_t jitter_p50_ns = 0;  ///< arrival after that of the least delayed datagram: device clock, mapped
  std::int64_t jitter_p99_ns = 0;
  double skew_ppm = 0;                    ///< device clock slow against this host's: positive; 0 before it is known
  std::int64_t clock_uncertainty_ns = 0;  ///< without the constant part of the delay
  std::uint64_t clock_epochs = 0;         ///< 1 + reboots seen
  std::uint64_t queue_high_water = 0;     ///< records that waited for the consumer at most
  std::uint64_t events_dropped = 0;       ///< beyond what the lists hold
};

/// Told of each datagram by the receive thread.
class HealthMeter {
 public:
  explicit HealthMeter(double device_rate_hz) noexcept : clock_(device_rate_hz) {}
  void begin() noexcept;
  /// `newest`: the last record delivered from a datagram.
  void note(const StampedRecord& newest, std::uint64_t records, std::uint64_t reboots) noexcept;
  void note_queue(std::uint64_t waiting) noexcept { high_water_ = waiting > high_water_ ? waiting : high_water_; }
  [[nodiscard]] Health health() const noexcept;
  [[nodiscard]] const ClockEstimate& clock() const noexcept { return clock_; }

 private:
  ClockEstimate clock_;
  DelayHistogram jitter_;
  std::uint64_t reboots_ = 0, records_ = 0, datagrams_ = 0, high_water_ = 0;
  Instant first_{0}, newest_{0};
};

}  // namespace kphi::netbox
