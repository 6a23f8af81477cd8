#include "results/reduction/clock_map.hpp"

#include <algorithm>
#include <cmath>

namespace kphi::results {
namespace {

constexpr double kBinNs = 0.5e9;
constexpr std::size_t kLeastBins = 4;

/// One fresh record: device time, and how much later it arrived than the device's clock says.
struct Point {
  double device_ns;
  double delay_ns;
};

}  // namespace

ClockMap::ClockMap(const LoadCellColumns& columns, double device_rate_hz, std::span<const Nanoseconds> breaks)
    : ft_(columns.ft_sequence), tick_ns_(1e9 / device_rate_hz) {
  const std::span<const Nanoseconds> arrival(columns.arrival_ns);
  // Signed difference: the wrap of the 32-bit counter goes forward, a restart of the box back.
  const auto counts_on = [&](std::size_t i) { return static_cast<std::int32_t>(ft_[i] - ft_[i - 1]) > 0; };
  std::vector<std::size_t> broken;  // the first record that arrived at or after each break
  for (const Nanoseconds time : breaks)
    broken.push_back(static_cast<std::size_t>(std::ranges::lower_bound(arrival, time) - arrival.begin()));
  for (std::size_t begin = 0; begin < ft_.size();) {
    const auto next_break = std::ranges::upper_bound(broken, begin);
    const std::size_t last = next_break == broken.end() ? ft_.size() : *next_break;
    ClockEpoch epoch{begin, begin + 1, ft_[begin]};
    epoch.rebooted = begin > 0 && !counts_on(begin);
    while (epoch.end < last && counts_on(epoch.end)) ++epoch.end;
    fit(arrival, epoch);
    epochs_.push_back(epoch);
    begin = epoch.end;
  }
}

void ClockMap::fit(std::span<const Nanoseconds> arrival_ns, ClockEpoch& epoch) const {
  const Nanoseconds first_arrival = arrival_ns[epoch.begin];
  std::vector<Point> bins;
  double bin_end = -1;
  for (std::size_t i = epoch.begin; i < epoch.end; ++i) {
    // Of a datagram of many records only the last is fresh: the others waited for it.
    if (i + 1 < epoch.end && arrival_ns[i + 1] == arrival_ns[i]) continue;
    const double device = device_ns(epoch, ft_[i]);
    const Point p{device, static_cast<double>(arrival_ns[i] - first_arrival) - device};
    if (p.device_ns >= bin_end) {
      bins.push_back(p);
      bin_end = (std::floor(p.device_ns / kBinNs) + 1) * kBinNs;
    } else if (p.delay_ns < bins.back().delay_ns) {
      bins.back() = p;
    }
  }

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
    epoch.offset_ns = std::ranges::min(bins, {}, &Point::delay_ns).delay_ns;
  }
  epoch.offset_ns += static_cast<double>(first_arrival);
}

Nanoseconds ClockMap::time_of(const ClockEpoch& epoch, std::uint32_t ft) const {
  const double device = device_ns(epoch, ft);
  return std::llround(epoch.offset_ns + device + epoch.skew * device);
}

std::size_t ClockMap::first_at(const ClockEpoch& epoch, Nanoseconds time) const {
  const auto records = std::span(ft_).subspan(epoch.begin, epoch.end - epoch.begin);
  const auto first = std::ranges::partition_point(records, [&](std::uint32_t ft) { return time_of(epoch, ft) < time; });
  return epoch.begin + static_cast<std::size_t>(first - records.begin());
}

std::vector<Nanoseconds> stall_ends(std::span<const StreamEvent> events) {
  std::vector<Nanoseconds> times;
  for (const StreamEvent& event : events) {
    if (event.kind == EventKind::stall_ended) times.push_back(event.time_ns);
  }
  return times;
}

}  // namespace kphi::results
