#include "daq/cell_stream.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "daq/event_doubts.hpp"

namespace kphi::daq {
namespace {

using results::LoadCellRecord;
using results::Nanoseconds;

constexpr std::uint32_t kMonitorBit = 1u << 16;  // a condition the user set; raises the summary bit, too
constexpr std::uint32_t kSummaryBit = 1u << 31;

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

bool constant(const CountSums& sums, std::uint32_t n) {
  return sums.squares * n == static_cast<Wide>(sums.sum) * sums.sum;
}

}  // namespace

bool CellBin::frozen() const { return n > 1 && constant(force, n); }

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

double CellBins::torque(std::size_t bin) const {
  const CellBin& b = bins_[bin];
  if (2.0 * b.n < expected_ || b.n == 0) return std::numeric_limits<double>::quiet_NaN();
  return torque_origin_ + static_cast<double>(b.torque.sum) / b.n;
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

CellStream::CellStream(const results::RunRecording& run)
    : header_(run.header),
      records_(run.load_cell),
      clock_(run.load_cell, run.header.load_cell.device_rate_hz, stall_ends(run.events)) {
  for (const ClockEpoch& epoch : clock_.epochs()) {
    if (epoch.rebooted) reboots_.push_back(clock_.time_ns(epoch, epoch.begin));
  }
  const auto& scale = header_.load_cell;
  for (std::size_t i = 0; i < limits_.size(); ++i) {
    const double counts = scale.range[i] * (i < 3 ? scale.counts_per_newton : scale.counts_per_newton_metre);
    const double full = std::numeric_limits<std::int32_t>::max();
    limits_[i] = static_cast<std::int32_t>(counts > 0 && counts < full ? counts : full);
  }
}

std::size_t CellStream::boot_at(Nanoseconds time) const {
  return static_cast<std::size_t>(std::count_if(reboots_.begin(), reboots_.end(), [&](auto t) { return t < time; }));
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
    find_gaps(epoch, begin, end, bins);
    if (begin == end) continue;
    if (first) {
      const auto axis = static_cast<std::size_t>(header_.thrust_axis);
      bins.force_origin_ = records_[begin].counts[axis];
      bins.torque_origin_ = records_[begin].counts[axis + 3];
      first = false;
    }
    std::size_t from = begin;
    for (std::size_t i = 0; i < bins.size() && from < end; ++i) {
      const std::size_t to = clock_.first_at(epoch, bins.window(i, i + 1).end, from, end);
      add(from, to, bins.bins_[i], bins);
      from = to;
    }
  }
  return bins;
}

void CellStream::add(std::size_t begin, std::size_t end, CellBin& bin, const CellBins& bins) const {
  const auto axis = static_cast<std::size_t>(header_.thrust_axis);
  CountSums force, torque;
  std::uint32_t status = 0;
  bool at_limit = false;
  for (std::size_t r = begin; r < end; ++r) {
    const LoadCellRecord& record = records_[r];
    force.add(static_cast<std::int64_t>(record.counts[axis]) - bins.force_origin_);
    torque.add(static_cast<std::int64_t>(record.counts[axis + 3]) - bins.torque_origin_);
    if (record.status != (kSummaryBit | kMonitorBit)) status |= record.status;
    for (std::size_t i = 0; i < 6; ++i) {
      at_limit |= static_cast<bool>(static_cast<int>(record.counts[i] >= limits_[i]) |
                                    static_cast<int>(record.counts[i] <= -limits_[i]));
    }
  }
  bin.force.add(force);
  bin.torque.add(torque);
  bin.n += static_cast<std::uint32_t>(end - begin);
  bin.status |= status;
  bin.at_limit |= at_limit;
}

/// Gaps inside the window and across its ends.
void CellStream::find_gaps(const ClockEpoch& epoch, std::size_t begin, std::size_t end, CellBins& bins) const {
  const std::uint32_t stride = std::max(header_.load_cell.ft_stride, 1u);
  const std::size_t from = std::max(begin, epoch.begin + 1);
  const std::size_t to = std::min(end + 1, epoch.end);
  for (std::size_t i = from; i < to; ++i) {
    const std::uint32_t advance = records_[i].ft_sequence - records_[i - 1].ft_sequence;
    if (advance < 2 * stride) continue;
    const std::uint32_t missing = advance / stride - 1;
    const Nanoseconds before = clock_.time_ns(epoch, i - 1);
    const double period = static_cast<double>(clock_.time_ns(epoch, i) - before) / (missing + 1.0);
    bins.gaps_.push_back({static_cast<double>(before), period, missing});
  }
}

}  // namespace kphi::daq
