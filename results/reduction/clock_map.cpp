#include "results/reduction/clock_map.hpp"

#include <algorithm>
#include <cmath>

namespace kphi::results {
namespace {

constexpr double kBinNs = 0.5e9;
constexpr std::size_t kLeastBins = 4;

/// The least delayed record of each half second of device time, and the line through them.
class DelayFloor {
 public:
  /// `delay_ns`: how much later the record arrived than the device's clock says, after the first of its epoch.
  void add(double device_ns, double delay_ns) {
    if (device_ns >= bin_end_) {
      bins_.push_back({device_ns, delay_ns});
      bin_end_ = (std::floor(device_ns / kBinNs) + 1) * kBinNs;
    } else if (delay_ns < bins_.back().delay_ns) {
      bins_.back() = {device_ns, delay_ns};
    }
  }

  void fit(ClockEpoch& epoch) const {
    double mean_x = 0, mean_y = 0, xx = 0, xy = 0;
    for (const Point& p : bins_) {
      mean_x += p.device_ns / static_cast<double>(bins_.size());
      mean_y += p.delay_ns / static_cast<double>(bins_.size());
    }
    for (const Point& p : bins_) {
      xx += (p.device_ns - mean_x) * (p.device_ns - mean_x);
      xy += (p.device_ns - mean_x) * (p.delay_ns - mean_y);
    }
    if (bins_.size() >= kLeastBins && xx > 0) {
      epoch.skew = xy / xx;
      epoch.offset_ns = mean_y - epoch.skew * mean_x;
    } else {
      epoch.offset_ns = std::ranges::min(bins_, {}, &Point::delay_ns).delay_ns;
    }
  }

 private:
  struct Point {
    double device_ns, delay_ns;
  };
  std::vector<Point> bins_;
  double bin_end_ = -1;
};

}  // namespace

ClockMap::ClockMap(const LoadCellColumns& cell, double device_rate_hz, std::span<const StreamEvent> events)
    : ft_(cell.ft_sequence), tick_ns_(1e9 / device_rate_hz) {
  const std::vector<Nanoseconds>& arrival_ns = cell.arrival_ns;
  // Signed difference: the wrap of the 32-bit counter goes forward, a restart of the box back.
  const auto counts_on = [&](std::size_t i) { return static_cast<std::int32_t>(ft_[i] - ft_[i - 1]) > 0; };
  std::vector<std::size_t> broken;  // the first record that arrived at or after the end of each stall
  for (const StreamEvent& event : events) {
    if (event.kind != EventKind::stall_ended) continue;
    broken.push_back(
        static_cast<std::size_t>(std::ranges::lower_bound(arrival_ns, event.time_ns) - arrival_ns.begin()));
  }
  for (std::size_t begin = 0; begin < ft_.size();) {
    const auto next_break = std::ranges::upper_bound(broken, begin);
    const std::size_t last = next_break == broken.end() ? ft_.size() : *next_break;
    ClockEpoch epoch{begin, begin, ft_[begin]};
    epoch.rebooted = begin > 0 && !counts_on(begin);
    DelayFloor floor;
    for (bool counts = true; counts;) {
      const std::size_t i = epoch.end++;
      counts = epoch.end < last && counts_on(epoch.end);
      // Of a datagram of many records only the last is fresh: the others waited for it.
      if (counts && arrival_ns[i + 1] == arrival_ns[i]) continue;
      const double device = device_ns(epoch, ft_[i]);
      floor.add(device, static_cast<double>(arrival_ns[i] - arrival_ns[begin]) - device);
    }
    floor.fit(epoch);
    epoch.offset_ns += static_cast<double>(arrival_ns[begin]);
    epochs_.push_back(epoch);
    begin = epoch.end;
  }
}

Nanoseconds ClockMap::time_of(const ClockEpoch& epoch, std::uint32_t ft) const {
  const double device = device_ns(epoch, ft);
  return std::llround(epoch.offset_ns + device + epoch.skew * device);
}

std::size_t ClockMap::first_at(const ClockEpoch& epoch, Nanoseconds time, std::size_t from) const {
  const auto earlier = [&](std::uint32_t ft) { return time_of(epoch, ft) < time; };
  auto counts = std::span(ft_).subspan(from, epoch.end - from);
  std::size_t reach = 1;  // in growing leaps, since a search across all records would miss the cache
  while (reach < counts.size() && earlier(counts[reach])) reach *= 2;
  counts = counts.first(std::min(reach + 1, counts.size()));
  return from + static_cast<std::size_t>(std::ranges::partition_point(counts, earlier) - counts.begin());
}

}  // namespace kphi::results
