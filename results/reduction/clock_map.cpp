#include "results/reduction/clock_map.hpp"

#include <algorithm>
#include <iterator>
#include <limits>

namespace kphi::results {
namespace {

constexpr double kBinNs = 0.5e9;
constexpr std::size_t kLeastBins = 4;
constexpr double kMostDelayNs = 1e9, kMostSkew = 0.01;  // the clock of a box is a crystal

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

  void fit(ClockEpoch& epoch) {
    leave_out_what_stepped();
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

  /// The stamps of a computer whose calendar stepped can be wrong by years: they must not tilt the line.
  void leave_out_what_stepped() {
    std::vector<Point> sorted = bins_;
    const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
    std::ranges::nth_element(sorted, middle, {}, &Point::delay_ns);
    const double usual_ns = middle->delay_ns;
    std::erase_if(bins_, [&](const Point& p) {
      return std::abs(p.delay_ns - usual_ns) > kMostDelayNs + kMostSkew * std::abs(p.device_ns - middle->device_ns);
    });
  }
  std::vector<Point> bins_;
  double bin_end_ = -1;
};

/// No sample is later than its arrival. The line is a mean of the least delayed records, so some of them arrived a few
/// µs before it; one that is off by more carries a stamp of a clock that stepped, and is left as it is.
void hold_before_arrivals(const LoadCellColumns& cell, std::vector<Nanoseconds>& times) {
  constexpr Nanoseconds kLargestDeviation = 1'000'000;
  Nanoseconds next = std::numeric_limits<Nanoseconds>::max();
  auto datagram = cell.datagrams.rbegin();
  for (std::size_t i = times.size(); i-- > 0;) {
    while (std::next(datagram) != cell.datagrams.rend() && std::next(datagram)->end > i) ++datagram;
    if (const Nanoseconds late = times[i] - datagram->arrival_ns; late > 0 && late < kLargestDeviation)
      times[i] = datagram->arrival_ns;
    next = times[i] = std::min(times[i], next - 1);
  }
}

}  // namespace

ClockMap::ClockMap(const LoadCellColumns& cell, double device_rate_hz, std::span<const StreamEvent> events)
    : ft_(cell.ft_sequence), tick_ns_(1e9 / device_rate_hz) {
  const auto& datagrams = cell.datagrams;
  // Signed difference: the wrap of the 32-bit counter goes forward, a restart of the box back.
  const auto counts_on = [&](std::size_t i) { return static_cast<std::int32_t>(ft_[i] - ft_[i - 1]) > 0; };
  // Of many at once: no difference is 0 or negative.
  constexpr std::size_t kBlock = 64;
  const auto block_counts_on = [&](std::size_t first) {
    std::uint32_t signs = 0;
    for (std::size_t i = first; i < first + kBlock; ++i) {
      const std::uint32_t advance = ft_[i] - ft_[i - 1];
      signs |= advance | (advance - 1);
    }
    return static_cast<std::int32_t>(signs) >= 0;
  };
  std::vector<std::size_t> broken;  // the first record that arrived at or after the end of each stall
  for (const StreamEvent& event : events) {
    if (event.kind != EventKind::stall_ended) continue;
    const auto next = std::ranges::lower_bound(datagrams, event.time_ns, {}, &LoadCellColumns::Datagram::arrival_ns);
    broken.push_back(next == datagrams.begin() ? 0 : std::prev(next)->end);
  }
  auto datagram = datagrams.begin();
  for (std::size_t begin = 0; begin < ft_.size();) {
    const auto next_break = std::ranges::upper_bound(broken, begin);
    const std::size_t last = next_break == broken.end() ? ft_.size() : *next_break;
    ClockEpoch epoch{begin, begin + 1, ft_[begin]};
    epoch.rebooted = begin > 0 && !counts_on(begin);
    while (epoch.end + kBlock <= last && block_counts_on(epoch.end)) epoch.end += kBlock;
    while (epoch.end < last && counts_on(epoch.end)) ++epoch.end;
    DelayFloor floor;
    const Nanoseconds first_ns = datagram->arrival_ns;
    for (std::size_t end = begin; end < epoch.end;) {
      // Of a datagram of many records only the last is fresh: the others waited for it.
      end = std::min(datagram->end, epoch.end);
      const double device = device_ns(epoch, ft_[end - 1]);
      floor.add(device, static_cast<double>(datagram->arrival_ns - first_ns) - device);
      if (end == datagram->end) ++datagram;
    }
    floor.fit(epoch);
    epoch.offset_ns += static_cast<double>(first_ns);
    epochs_.push_back(epoch);
    begin = epoch.end;
  }
}

double ClockMap::exact_time_of(const ClockEpoch& epoch, std::uint32_t ft) const {
  const double device = device_ns(epoch, ft);
  return epoch.offset_ns + device + epoch.skew * device;
}

std::size_t ClockMap::first_at(const ClockEpoch& epoch, Nanoseconds time, std::size_t from) const {
  const double rounds_up = static_cast<double>(time) - 0.5;
  const auto earlier = [&](std::uint32_t ft) { return exact_time_of(epoch, ft) < rounds_up; };
  auto counts = ft_.subspan(from, epoch.end - from);
  std::size_t reach = 1;  // in growing leaps, since a search across all records would miss the cache
  while (reach < counts.size() && earlier(counts[reach])) reach *= 2;
  counts = counts.first(std::min(reach + 1, counts.size()));
  return from + static_cast<std::size_t>(std::ranges::partition_point(counts, earlier) - counts.begin());
}

std::vector<Nanoseconds> sample_times(const RunRecording& run, const LoadCellColumns& cell) {
  std::vector<Nanoseconds> times;
  times.reserve(cell.ft_sequence.size());
  if (run.header.load_cell.device_rate_hz > 0) {
    const ClockMap clock(cell, run.header.load_cell.device_rate_hz, run.events);
    for (const ClockEpoch& epoch : clock.epochs())
      for (std::size_t i = epoch.begin; i < epoch.end; ++i) times.push_back(clock.time_ns(epoch, i));
  } else {
    for (const auto& [end, arrival_ns] : cell.datagrams) times.resize(end, arrival_ns);
  }
  for (std::size_t i = 1; i < times.size(); ++i) times[i] = std::max(times[i], times[i - 1] + 1);
  hold_before_arrivals(cell, times);
  return times;
}

std::vector<Nanoseconds> sample_times(const RunRecording& run) {
  return sample_times(run, {run.load_cell, run.header});
}

}  // namespace kphi::results
