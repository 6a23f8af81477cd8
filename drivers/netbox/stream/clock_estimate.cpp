#include "drivers/netbox/stream/clock_estimate.hpp"

#include <algorithm>
#include <cmath>

namespace kphi::netbox {

void ClockEstimate::restart() noexcept {
  begun_ = has_line_ = false;
  point_count_ = 0;
}

Duration ClockEstimate::add(std::uint32_t ft_sequence, Instant arrival) noexcept {
  if (!begun_) {
    begun_ = true;
    ++epochs_;
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
  if (point_count_ == points_.size()) {
    std::copy(points_.begin() + 1, points_.end(), points_.begin());
    --point_count_;
  }
  points_[point_count_++] = best_;
  const double oldest = best_.device_s - kWindowSeconds;
  const auto kept = std::find_if(points_.begin(), points_.begin() + static_cast<std::ptrdiff_t>(point_count_),
                                 [&](const Point& point) { return point.device_s >= oldest; });
  const auto gone = static_cast<std::size_t>(kept - points_.begin());
  std::copy(kept, points_.begin() + static_cast<std::ptrdiff_t>(point_count_), points_.begin());
  point_count_ -= gone;
  if (point_count_ >= kLeastBins) fit();
}

void ClockEstimate::fit() noexcept {
  const double n = static_cast<double>(point_count_);
  double mean_x = 0, mean_y = 0, xx = 0, xy = 0, yy = 0;
  for (std::size_t i = 0; i < point_count_; ++i) {
    mean_x += points_[i].device_s / n;
    mean_y += points_[i].delay_s / n;
  }
  for (std::size_t i = 0; i < point_count_; ++i) {
    const double x = points_[i].device_s - mean_x, y = points_[i].delay_s - mean_y;
    xx += x * x;
    xy += x * y;
    yy += y * y;
  }
  slope_ = xy / xx;
  offset_ = mean_y;
  centre_ = mean_x;
  const double variance = std::max(0.0, yy - slope_ * xy) / (n - 2);
  const double lever = points_[point_count_ - 1].device_s - mean_x;
  line_error_ = std::sqrt(variance * (1 / n + lever * lever / xx));
  has_line_ = true;
}

double ClockEstimate::least_delay(double device_s) const noexcept {
  return has_line_ ? offset_ + slope_ * (device_s - centre_) : smallest_delay_;
}

Duration ClockEstimate::uncertainty() const noexcept {
  return from_seconds(has_line_ ? line_error_ : largest_delay_ - smallest_delay_);
}

}  // namespace kphi::netbox
