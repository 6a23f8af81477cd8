// Figures on the quality of the stream: rates, jitter, clock, queue.
#pragma once

#include <boost/circular_buffer.hpp>
#include <cstdint>

#include "base/clock.hpp"
#include "base/device_data.hpp"
#include "base/histogram.hpp"

namespace kphi::netbox {

/// The box's clock as seen from this computer: ft_sequence / device rate against the kernel's receive stamps.
/// Per bin of 0.5 s of device time the record with the smallest delay, over the last 60 s of bins a line by least
/// squares: host = device + a + b (device - device0). Causal, one thread, allocates at construction only.
/// The constant part of the delay (box, filter, wire) cannot be seen from one end: every time given here includes it.
class ClockEstimate {
 public:
  static constexpr double kBinSeconds = 0.5, kWindowSeconds = 60;
  static constexpr std::size_t kLeastBins = 4;
  /// Beyond this the rate or the divisor is not the configured one.
  static constexpr double kBelievableSkewPpm = 500;

  explicit ClockEstimate(double device_rate_hz) noexcept : device_period_s_(1 / device_rate_hz) {}

  /// The last record of each datagram (only that one is fresh), in the order of delivery. Returns its delay beyond the
  /// smallest one.
  Duration add(std::uint32_t ft_sequence, Instant arrival) noexcept;
  /// A new epoch, after a boot of the box: forgets everything.
  void restart() noexcept;

  /// Standard error of the smallest delay at the newest record, without the constant part; before kLeastBins bins are
  /// complete: the largest delay beyond the smallest.
  [[nodiscard]] Duration uncertainty() const noexcept;
  /// Device clock slow against the host's: positive. 0 before kLeastBins bins are complete.
  [[nodiscard]] double skew_ppm() const noexcept { return has_line_ ? 1e6 * slope_ : 0; }

 private:
  static constexpr std::size_t kBins = static_cast<std::size_t>(kWindowSeconds / kBinSeconds);
  struct Point {
    double device_s = 0, delay_s = 0;  // since the first record
  };

  void close_bin() noexcept;
  void fit() noexcept;
  [[nodiscard]] double least_delay(double device_s) const noexcept;

  const double device_period_s_;
  bool begun_ = false, has_line_ = false;
  std::uint32_t newest_ft_ = 0;
  std::int64_t newest_count_ = 0;  // samples since the first record
  Instant first_arrival_{0};
  double bin_end_s_ = 0;  // of the open bin, device time since the first record
  Point best_;            // of that bin
  double smallest_delay_ = 0, largest_delay_ = 0;
  boost::circular_buffer<Point> points_{kBins};  // the newest
  double offset_ = 0, slope_ = 0, centre_ = 0, line_error_ = 0;
};

/// Since begin(). One thread.
class HealthMeter {
 public:
  /// `bench_speed`: bench seconds per second.
  explicit HealthMeter(double device_rate_hz, double bench_speed = 1) noexcept
      : clock_(device_rate_hz), bench_speed_(bench_speed) {}
  void begin() noexcept;
  /// `newest`: the last record delivered from a datagram.
  void note(const LoadCellRecord& newest, std::uint64_t records, std::uint64_t reboots) noexcept;
  void note_queue(std::uint64_t waiting) noexcept { high_water_ = waiting > high_water_ ? waiting : high_water_; }
  [[nodiscard]] StreamHealth health() const noexcept;

 private:
  ClockEstimate clock_;
  double bench_speed_;
  DelayHistogram jitter_;
  std::uint64_t reboots_ = 0, records_ = 0, datagrams_ = 0, high_water_ = 0;
  Instant first_{0}, newest_{0};
};

}  // namespace kphi::netbox
