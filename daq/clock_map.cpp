#include "daq/clock_map.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace kphi::daq {
namespace {

constexpr double kBinNs = 0.5e9;
constexpr std::size_t kLeastBins = 4;
constexpr results::Nanoseconds kNoBreak = std::numeric_limits<results::Nanoseconds>::max();

/// One fresh record: device time, and how much later it arrived than the device's clock says.
struct Point {
  double device_ns;
  double delay_ns;
};

}  // namespace

ClockMap::ClockMap(std::span<const results::LoadCellRecord> records, double device_rate_hz,
                   std::span<const results::Nanoseconds> breaks)
    : records_(records), tick_ns_(1e9 / device_rate_hz) {
  // Signed difference: the wrap of the 32-bit counter goes forward, a restart of the box back.
  const auto counts_on = [&](std::size_t i) {
    return static_cast<std::int32_t>(records[i].ft_sequence - records[i - 1].ft_sequence) > 0;
  };
  for (std::size_t begin = 0; begin < records.size();) {
    while (!breaks.empty() && breaks.front() <= records[begin].arrival_ns) breaks = breaks.subspan(1);
    const results::Nanoseconds next_break = breaks.empty() ? kNoBreak : breaks.front();
    std::size_t end = begin + 1;
    while (end < records.size() && counts_on(end) && records[end].arrival_ns < next_break) ++end;
    ClockEpoch epoch;
    epoch.rebooted = begin > 0 && !counts_on(begin);
    epoch.begin = begin;
    epoch.end = end;
    epoch.ft_first = records[begin].ft_sequence;
    fit(epoch);
    epochs_.push_back(epoch);
    begin = end;
  }
}

double ClockMap::device_ns(const ClockEpoch& epoch, std::size_t index) const {
  return static_cast<double>(records_[index].ft_sequence - epoch.ft_first) * tick_ns_;
}

/// Of a datagram of many records only the last is fresh: the others waited for it.
bool ClockMap::fresh(const ClockEpoch& epoch, std::size_t index) const {
  return index + 1 == epoch.end || records_[index + 1].arrival_ns != records_[index].arrival_ns;
}

void ClockMap::fit(ClockEpoch& epoch) const {
  const results::Nanoseconds first_arrival = records_[epoch.begin].arrival_ns;
  const auto point = [&](std::size_t i) {
    const double device = device_ns(epoch, i);
    return Point{device, static_cast<double>(records_[i].arrival_ns - first_arrival) - device};
  };
  std::vector<Point> bins;
  double bin_end = -1;
  for (std::size_t i = epoch.begin; i < epoch.end; ++i) {
    if (!fresh(epoch, i)) continue;
    const Point p = point(i);
    if (p.device_ns >= bin_end) {
      bins.push_back(p);
      bin_end = (std::floor(p.device_ns / kBinNs) + 1) * kBinNs;
    } else if (p.delay_ns < bins.back().delay_ns) {
      bins.back() = p;
    }
  }

  epoch.bins = bins.size();
  double mean_x = 0, mean_y = 0, xx = 0, xy = 0;
  for (const Point& p : bins) {
    mean_x += p.device_ns / static_cast<double>(bins.size());
    mean_y += p.delay_ns / static_cast<double>(bins.size());
  }
  for (const Point& p : bins) {
    xx += (p.device_ns - mean_x) * (p.device_ns - mean_x);
    xy += (p.device_ns - mean_x) * (p.delay_ns - mean_y);
  }
  if (bins.size() >= kLeastBins && xx > 0) {
    epoch.skew = xy / xx;
    epoch.offset_ns = mean_y - epoch.skew * mean_x;
  } else {
    epoch.offset_ns = std::min_element(bins.begin(), bins.end(), [](const Point& a, const Point& b) {
                        return a.delay_ns < b.delay_ns;
                      })->delay_ns;
  }

  epoch.offset_ns += static_cast<double>(first_arrival);
}

double ClockMap::residual_p99_ns(const ClockEpoch& epoch) const {
  std::vector<double> residuals;
  for (std::size_t i = epoch.begin; i < epoch.end; ++i) {
    if (fresh(epoch, i)) residuals.push_back(static_cast<double>(records_[i].arrival_ns - time_ns(epoch, i)));
  }
  const auto p99 = residuals.begin() + static_cast<std::ptrdiff_t>(0.99 * static_cast<double>(residuals.size() - 1));
  std::nth_element(residuals.begin(), p99, residuals.end());
  return *p99;
}

results::Nanoseconds ClockMap::time_ns(const ClockEpoch& epoch, std::size_t index) const {
  const double device = device_ns(epoch, index);
  return std::llround(epoch.offset_ns + device + epoch.skew * device);
}

std::size_t ClockMap::first_at(const ClockEpoch& epoch, results::Nanoseconds time) const {
  return first_at(epoch, time, epoch.begin, epoch.end);
}

std::size_t ClockMap::first_at(const ClockEpoch& epoch, results::Nanoseconds time, std::size_t begin,
                               std::size_t end) const {
  std::size_t low = begin;
  std::size_t stride = 1;
  while (low + stride < end && time_ns(epoch, low + stride) < time) {
    low += stride;
    stride *= 2;
  }
  std::size_t high = std::min(low + stride, end);
  while (low < high) {
    const std::size_t middle = low + (high - low) / 2;
    if (time_ns(epoch, middle) < time) {
      low = middle + 1;
    } else {
      high = middle;
    }
  }
  return low;
}

}  // namespace kphi::daq
