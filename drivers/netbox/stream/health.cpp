#include "drivers/netbox/stream/health.hpp"

#include <algorithm>
#include <cmath>

namespace kphi::netbox {

void ClockEstimate::restart() noexcept {
  begun_ = has_line_ = false;
  points_.clear();
}

Duration ClockEstimate::add(std::uint32_t ft_sequence, Instant arrival) noexcept {
  if (!begun_) {
    begun_ = true;
    newest_ft_ = ft_sequence;
    newest_count_ = 0;
    first_arrival_ = arrival;
    bin_end_s_ = kBinSeconds;
    best_ = {};
    smallest_delay_ = largest_delay_ = 0;
    return Duration{0};
  }
  newest_count_ += static_cast<std::int32_t>(ft_sequence - newest_ft_);
  newest_ft_ = ft_sequence;
  Point point;
  point.device_s = static_cast<double>(newest_count_) * device_period_s_;
  point.delay_s = to_seconds(arrival - first_arrival_) - point.device_s;
  smallest_delay_ = std::min(smallest_delay_, point.delay_s);
  largest_delay_ = std::max(largest_delay_, point.delay_s);
  if (point.device_s >= bin_end_s_) {
    close_bin();
    bin_end_s_ = kBinSeconds * (std::floor(point.device_s / kBinSeconds) + 1);
    best_ = point;
  } else if (point.delay_s < best_.delay_s) {
    best_ = point;
  }
  return from_seconds(point.delay_s - least_delay(point.device_s));
}

void ClockEstimate::close_bin() noexcept {
  points_.push_back(best_);
  while (points_.front().device_s < best_.device_s - kWindowSeconds) points_.pop_front();
  if (points_.size() >= kLeastBins) fit();
}

void ClockEstimate::fit() noexcept {
  const double n = static_cast<double>(points_.size());
  double mean_x = 0, mean_y = 0, xx = 0, xy = 0, yy = 0;
  for (const Point& point : points_) {
    mean_x += point.device_s / n;
    mean_y += point.delay_s / n;
  }
  for (const Point& point : points_) {
    const double x = point.device_s - mean_x, y = point.delay_s - mean_y;
    xx += x * x;
    xy += x * y;
    yy += y * y;
  }
  slope_ = xy / xx;
  offset_ = mean_y;
  centre_ = mean_x;
  const double variance = std::max(0.0, yy - slope_ * xy) / (n - 2);
  const double lever = points_.back().device_s - mean_x;
  line_error_ = std::sqrt(variance * (1 / n + lever * lever / xx));
  has_line_ = true;
}

double ClockEstimate::least_delay(double device_s) const noexcept {
  return has_line_ ? offset_ + slope_ * (device_s - centre_) : smallest_delay_;
}

Duration ClockEstimate::uncertainty() const noexcept {
  return from_seconds(has_line_ ? line_error_ : largest_delay_ - smallest_delay_);
}

void HealthMeter::begin() noexcept {
  clock_.restart();
  jitter_ = {};
  records_ = datagrams_ = high_water_ = 0;
}

void HealthMeter::note(const LoadCellRecord& newest, std::uint64_t records, std::uint64_t reboots) noexcept {
  if (reboots != reboots_) clock_.restart();
  reboots_ = reboots;
  jitter_.add(clock_.add(newest.ft_sequence, newest.arrival()));
  if (datagrams_++ == 0) {
    first_ = newest.arrival();
  } else {
    records_ += records;
  }
  newest_ = newest.arrival();
}

StreamHealth HealthMeter::health() const noexcept {
  StreamHealth health;
  const double seconds = to_seconds(newest_ - first_);
  if (datagrams_ > 1 && seconds > 0) {
    health.records_per_second = static_cast<double>(records_) / seconds;
    health.datagrams_per_second = static_cast<double>(datagrams_ - 1) / seconds;
  }
  // Jitter comes from this computer and the network: wall time.
  health.jitter_p50_s = to_seconds(jitter_.quantile(0.5)) / bench_speed_;
  health.jitter_p99_s = to_seconds(jitter_.quantile(0.99)) / bench_speed_;
  health.skew_ppm = clock_.skew_ppm();
  health.clock_uncertainty_s = to_seconds(clock_.uncertainty());
  health.queue_high_water = high_water_;
  return health;
}

}  // namespace kphi::netbox
