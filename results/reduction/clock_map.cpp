#include "results/reduction/clock_map.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace kphi::results {
namespace {

constexpr double kBinNs = 0.5e9;
constexpr std::size_t kLeastBins = 4;
constexpr std::uint64_t kCounts = std::uint64_t{1} << 32;  // of ft_sequence
constexpr std::size_t kBlock = 1024;                       // records looked at together
constexpr std::size_t kPiece = 8192;                       // records read together

/// One fresh record: device time, and how much later it arrived than the device's clock says.
struct Point {
  double device_ns;
  double delay_ns;
};

/// llround, without a call.
Nanoseconds rounded(double value) {
  const auto whole = static_cast<Nanoseconds>(value);
  const double rest = value - static_cast<double>(whole);
  return whole + static_cast<int>(rest >= 0.5) - static_cast<int>(rest <= -0.5);
}

/// Whether each of `n` records has counted on since the one before it. Signed difference: the wrap of the 32-bit
/// counter goes forward, a restart of the box back.
bool counts_on(const std::uint32_t* ft, std::size_t n) {
  std::int32_t back = 0;
  for (std::size_t i = 0; i < n; ++i)
    back |= static_cast<std::int32_t>(static_cast<std::int32_t>(ft[i] - ft[i - 1]) <= 0);
  return back == 0;
}

/// Of a datagram of many records only the last is fresh: the others waited for it. `each`: of its index and arrival.
template <class Each>
void for_each_fresh(const LoadCellColumns& columns, std::size_t begin, std::size_t end, Each&& each) {
  std::vector<Nanoseconds> piece;
  for (std::size_t at = begin; at < end; at += kPiece) {
    const std::size_t n = std::min(kPiece, end - at);
    piece.resize(std::min(n + 1, end - at));
    columns.read_arrival(at, piece);
    for (std::size_t i = 0; i < n; ++i) {
      if (i + 1 == piece.size() || piece[i + 1] != piece[i]) each(at + i, piece[i]);
    }
  }
}

/// The first record that arrived at or after each break.
std::vector<std::size_t> records_at(const LoadCellColumns& columns, std::span<const Nanoseconds> breaks) {
  std::vector<std::size_t> found;
  if (breaks.empty()) return found;
  std::vector<Nanoseconds> arrival(columns.size());
  columns.read_arrival(0, arrival);
  for (const Nanoseconds time : breaks) {
    found.push_back(static_cast<std::size_t>(std::lower_bound(arrival.begin(), arrival.end(), time) - arrival.begin()));
  }
  return found;
}

}  // namespace

ClockMap::ClockMap(const LoadCellColumns& columns, double device_rate_hz, std::span<const Nanoseconds> breaks)
    : ft_(columns.ft_sequence()), tick_ns_(1e9 / device_rate_hz) {
  const std::vector<std::size_t> broken = records_at(columns, breaks);
  for (std::size_t begin = 0; begin < ft_.size();) {
    const auto next_break = std::upper_bound(broken.begin(), broken.end(), begin);
    ClockEpoch epoch;
    epoch.rebooted = begin > 0 && !counts_on(&ft_[begin], 1);
    epoch.begin = begin;
    epoch.end = counting_until(begin, next_break == broken.end() ? ft_.size() : *next_break);
    epoch.ft_first = ft_[begin];
    fit(columns, epoch);
    epochs_.push_back(epoch);
    begin = epoch.end;
  }
}

/// `next_break`: a record that begins an epoch anyway.
std::size_t ClockMap::counting_until(std::size_t begin, std::size_t next_break) const {
  std::size_t end = begin + 1;
  while (end + kBlock <= next_break && counts_on(&ft_[end], kBlock)) end += kBlock;
  while (end < next_break && counts_on(&ft_[end], 1)) ++end;
  return end;
}

std::uint32_t ClockMap::count(const ClockEpoch& epoch, std::size_t index) const { return ft_[index] - epoch.ft_first; }

void ClockMap::fit(const LoadCellColumns& columns, ClockEpoch& epoch) const {
  Nanoseconds first_arrival = 0;
  columns.read_arrival(epoch.begin, std::span(&first_arrival, 1));
  std::vector<Point> bins;
  double bin_end = -1;
  for_each_fresh(columns, epoch.begin, epoch.end, [&](std::size_t i, Nanoseconds arrival) {
    const double device = static_cast<double>(count(epoch, i)) * tick_ns_;
    const Point p{device, static_cast<double>(arrival - first_arrival) - device};
    if (p.device_ns >= bin_end) {
      bins.push_back(p);
      bin_end = (std::floor(p.device_ns / kBinNs) + 1) * kBinNs;
    } else if (p.delay_ns < bins.back().delay_ns) {
      bins.back() = p;
    }
  });

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

Nanoseconds ClockMap::time_of_count(const ClockEpoch& epoch, std::uint64_t count) const {
  const double device = static_cast<double>(count) * tick_ns_;
  return rounded(epoch.offset_ns + device + epoch.skew * device);
}

Nanoseconds ClockMap::time_ns(const ClockEpoch& epoch, std::size_t index) const {
  return time_of_count(epoch, count(epoch, index));
}

/// The first count since the begin of the epoch that lies at or after `time`; kCounts when there is none.
std::uint64_t ClockMap::count_at(const ClockEpoch& epoch, Nanoseconds time) const {
  std::uint64_t low = 0, high = kCounts;
  const double guess = (static_cast<double>(time) - epoch.offset_ns) / (tick_ns_ * (1 + epoch.skew));
  if (guess > 2 && guess < static_cast<double>(kCounts - 2)) {
    const auto near = static_cast<std::uint64_t>(guess);
    if (time_of_count(epoch, near - 2) < time && time_of_count(epoch, near + 2) >= time) {
      low = near - 1;
      high = near + 2;
    }
  }
  while (low < high) {
    const std::uint64_t middle = low + (high - low) / 2;
    if (time_of_count(epoch, middle) < time) {
      low = middle + 1;
    } else {
      high = middle;
    }
  }
  return low;
}

std::size_t ClockMap::first_at(const ClockEpoch& epoch, Nanoseconds time) const {
  return first_at(epoch, time, epoch.begin, epoch.end);
}

std::size_t ClockMap::first_at(const ClockEpoch& epoch, Nanoseconds time, std::size_t begin, std::size_t end) const {
  const std::uint64_t wanted = count_at(epoch, time);
  std::size_t low = begin;
  std::size_t stride = 1;
  while (low + stride < end && count(epoch, low + stride) < wanted) {
    low += stride;
    stride *= 2;
  }
  const auto first = ft_.begin();
  const auto found = std::partition_point(first + static_cast<std::ptrdiff_t>(low),
                                          first + static_cast<std::ptrdiff_t>(std::min(low + stride, end)),
                                          [&](std::uint32_t ft) { return ft - epoch.ft_first < wanted; });
  return static_cast<std::size_t>(found - first);
}

std::vector<Nanoseconds> stall_ends(std::span<const StreamEvent> events) {
  std::vector<Nanoseconds> times;
  for (const StreamEvent& event : events) {
    if (event.kind == EventKind::stall_ended) times.push_back(event.time_ns);
  }
  return times;
}

}  // namespace kphi::results
