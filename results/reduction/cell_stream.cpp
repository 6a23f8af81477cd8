#include "results/reduction/cell_stream.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace kphi::results {
namespace {

constexpr Nanoseconds kBin = 10'000'000;
constexpr double kLeastSamplesPerBin = 2;

CountMean mean_of(const CountSums& sums, std::int32_t origin, std::uint64_t samples) {
  if (samples == 0) return {std::numeric_limits<double>::quiet_NaN(), 0};
  const double n = static_cast<double>(samples);
  const double mean = origin + static_cast<double>(sums.sum) / n;
  if (samples < 2) return {mean, 0};
  const Wide spread = sums.squares * static_cast<Wide>(samples) - static_cast<Wide>(sums.sum) * sums.sum;
  return {mean, std::sqrt(static_cast<double>(spread) / n / (n - 1))};
}

std::uint32_t stride_of(const RunHeader& header) { return std::max(header.load_cell.ft_stride, 1u); }

/// So many differences below kSmall have sums that fit into 32 bits, and their squares into 64.
constexpr std::size_t kNarrow = 128;
constexpr std::uint32_t kSmall = 1u << 24;

/// In vectors; false, and nothing added, if a difference is not small.
bool add_narrow(std::span<const std::int32_t> counts, std::int32_t origin, CountSums& sums) {
  std::uint32_t sum = 0, larger = 0;
  std::uint64_t squares = 0;
  for (const std::int32_t count : counts) {
    const std::uint32_t bits = static_cast<std::uint32_t>(count) - static_cast<std::uint32_t>(origin);
    const auto difference = static_cast<std::int32_t>(bits);
    const std::int32_t overflow = (count ^ origin) & (count ^ difference);
    const std::uint32_t size = difference < 0 ? 0 - bits : bits;
    larger |= size | (overflow < 0 ? kSmall : 0);
    sum += bits;
    squares += std::uint64_t{size} * size;
  }
  if (larger >= kSmall) return false;
  sums.sum += static_cast<std::int32_t>(sum);
  sums.squares += static_cast<Wide>(squares);
  return true;
}

void add_wide(std::span<const std::int32_t> counts, std::int32_t origin, CountSums& sums) {
  for (const std::int32_t count : counts) {
    const std::int64_t difference = std::int64_t{count} - origin;
    sums.sum += difference;
    sums.squares += static_cast<Wide>(difference) * difference;
  }
}

}  // namespace

void CountSums::add(std::span<const std::int32_t> counts, std::int32_t origin) {
  for (std::size_t at = 0; at < counts.size(); at += kNarrow) {
    const auto few = counts.subspan(at, std::min(kNarrow, counts.size() - at));
    if (!add_narrow(few, origin, *this)) add_wide(few, origin, *this);
  }
}

bool CellBin::frozen() const { return n > 1 && force.squares * n == static_cast<Wide>(force.sum) * force.sum; }

double CellBins::Gap::up_to(double time_ns) const {
  return std::clamp(std::ceil((time_ns - before_ns) / period_ns) - 1, 0.0, static_cast<double>(missing));
}

Window CellBins::window(std::size_t first, std::size_t last) const {
  return {begin_ + static_cast<Nanoseconds>(first) * width_, begin_ + static_cast<Nanoseconds>(last) * width_};
}

std::size_t CellBins::first_from(Nanoseconds time) const {
  if (time <= begin_) return 0;
  return std::min(static_cast<std::size_t>((time - begin_ + width_ - 1) / width_), bins_.size());
}

double CellBins::force(std::size_t bin) const {
  const CellBin& b = bins_[bin];
  if (2.0 * b.n < expected_ || b.n == 0) return std::numeric_limits<double>::quiet_NaN();
  return force_origin_ + static_cast<double>(b.force.sum) / b.n;
}

CellWindow CellBins::over(std::size_t first, std::size_t last) const {
  CellWindow found;
  CountSums force, torque;
  std::size_t frozen_since = first;
  for (std::size_t i = first; i < last; ++i) {
    const CellBin& bin = bins_[i];
    found.n += bin.n;
    force.add(bin.force);
    torque.add(bin.torque);
    found.status |= bin.status;
    found.at_limit |= bin.at_limit;
    const bool goes_on =
        bin.frozen() && (i == frozen_since || bin.force.sum * bins_[i - 1].n == bins_[i - 1].force.sum * bin.n);
    if (!goes_on) frozen_since = bin.frozen() ? i : i + 1;
    found.frozen |= static_cast<double>(i + 1 - frozen_since) * bin_s() >= kFrozenSpan;
  }
  found.force = mean_of(force, force_origin_, found.n);
  found.torque = mean_of(torque, torque_origin_, found.n);
  const Window whole = window(first, last);
  for (const Gap& gap : gaps_) {
    found.lost += static_cast<std::uint64_t>(gap.up_to(static_cast<double>(whole.end)) -
                                             gap.up_to(static_cast<double>(whole.begin)));
  }
  return found;
}

CellStream::CellStream(const RunRecording& run, const LoadCellColumns& cell)
    : header_(run.header), cell_(cell), clock_(cell_, run.header.load_cell.device_rate_hz, run.events) {
  for (const ClockEpoch& epoch : clock_.epochs())
    if (epoch.rebooted) reboots_.push_back(clock_.time_ns(epoch, epoch.begin));
}

std::size_t CellStream::boot_at(Nanoseconds time) const {
  return static_cast<std::size_t>(std::ranges::count_if(reboots_, [&](auto t) { return t < time; }));
}

Window CellStream::since_reboot(Window window) const {
  for (const Nanoseconds time : reboots_) {
    if (time < window.end) window.begin = std::max(window.begin, time);
  }
  return window;
}

CellBins CellStream::bins(const Window& window) const {
  CellBins bins;
  const double rate = header_.load_cell.sample_rate_hz;
  const double sparse = rate > 0 ? std::ceil(kLeastSamplesPerBin * 1e9 / rate) : 0;
  bins.begin_ = window.begin;
  bins.width_ = std::max(kBin, static_cast<Nanoseconds>(sparse));
  bins.expected_ = 1e-9 * static_cast<double>(bins.width_) * rate;
  if (window.end <= window.begin) return bins;
  bins.bins_.resize(static_cast<std::size_t>((window.end - window.begin) / bins.width_));
  const Window whole = bins.window(0, bins.size());
  bool first = true;
  for (const ClockEpoch& epoch : clock_.epochs()) {
    const std::size_t begin = clock_.first_at(epoch, whole.begin);
    const std::size_t end = clock_.first_at(epoch, whole.end);
    take_gaps(epoch, begin, end, bins);
    if (begin == end) continue;
    if (first) {
      bins.force_origin_ = cell_.force[begin];
      bins.torque_origin_ = cell_.torque[begin];
      first = false;
    }
    std::size_t from = begin;
    for (std::size_t i = 0; i < bins.size() && from < end; ++i) {
      const std::size_t to = clock_.first_at(epoch, bins.window(i, i + 1).end, from);
      add(from, to, bins, bins.bins_[i]);
      from = to;
    }
  }
  return bins;
}

void CellStream::add(std::size_t from, std::size_t to, CellBins& bins, CellBin& bin) const {
  bin.force.add(std::span(cell_.force).subspan(from, to - from), bins.force_origin_);
  bin.torque.add(std::span(cell_.torque).subspan(from, to - from), bins.torque_origin_);
  bin.n += static_cast<std::uint32_t>(to - from);
  auto mark = std::ranges::lower_bound(cell_.marks, from, {}, &LoadCellColumns::Mark::record);
  for (; mark != cell_.marks.end() && mark->record < to; ++mark) {
    bin.status |= mark->status;
    bin.at_limit |= mark->at_limit;
  }
}

EvenSamples CellStream::samples(const Window& window) const {
  EvenSamples found{header_.load_cell.device_rate_hz / stride_of(header_), {}};
  for (const ClockEpoch& epoch : clock_.epochs()) {
    const std::size_t begin = clock_.first_at(epoch, window.begin), end = clock_.first_at(epoch, window.end);
    if (begin == end) continue;
    if (!found.counts.empty()) return {};
    for (std::size_t i = begin; i < end; ++i) {
      const std::uint32_t strides = i == begin ? 1 : advance_to(i) / stride_of(header_);
      for (std::uint32_t k = 1; k < strides; ++k) found.counts.push_back(found.counts.back());
      found.counts.push_back(cell_.force[i]);
    }
  }
  return found;
}

/// Gaps inside the window and across its ends.
void CellStream::take_gaps(const ClockEpoch& epoch, std::size_t begin, std::size_t end, CellBins& bins) const {
  const std::size_t from = std::max(begin, epoch.begin + 1);
  const std::size_t to = std::min(end + 1, epoch.end);
  const std::uint32_t stride = stride_of(header_);
  // Within an epoch each record counts on by 1 at least.
  if (stride == 1 && from < to && cell_.ft_sequence[to - 1] - cell_.ft_sequence[from - 1] == to - from) return;
  const auto first = cell_.ft_sequence.begin();
  const auto jump = [stride](std::uint32_t a, std::uint32_t b) { return b - a >= 2 * stride; };
  for (std::size_t i = from; i < to; ++i) {
    i = static_cast<std::size_t>(std::adjacent_find(first + i - 1, first + to, jump) - first) + 1;
    if (i >= to) break;
    const std::uint32_t missing = advance_to(i) / stride - 1;
    const Nanoseconds before = clock_.time_ns(epoch, i - 1);
    const double period = static_cast<double>(clock_.time_ns(epoch, i) - before) / (missing + 1.0);
    bins.gaps_.push_back({static_cast<double>(before), period, missing});
  }
}

}  // namespace kphi::results
