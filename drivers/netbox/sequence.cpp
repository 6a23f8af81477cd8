#include "drivers/netbox/sequence.hpp"

#include <algorithm>

namespace kphi::netbox {
namespace {

// No datagram is on its way for longer: ft_sequence further back than this, or ahead of the time that has passed, was
// counted by a box that has booted anew.
constexpr double kLongestDelaySeconds = 5.0;

std::int32_t step(std::uint32_t from, std::uint32_t to) noexcept { return static_cast<std::int32_t>(to - from); }

}  // namespace

bool SequenceAccount::accept_unusual(const Record& record, Instant arrival) noexcept {
  if (!has_last_) return accept_first(record, arrival);
  const std::int32_t rdt_step = step(last_rdt_, record.rdt_sequence);
  const std::int32_t ft_step = step(last_ft_, record.ft_sequence);
  if (ft_step == 0) {
    if (rdt_step == 0) {
      ++counters_.duplicates;
    } else {
      ++counters_.stalled;
      last_rdt_ = record.rdt_sequence;
    }
    return false;
  }
  const bool believable = plausible(ft_step, arrival);
  if (ft_step > 0 && believable) return accept_forward(record, arrival, rdt_step, ft_step);
  if (!believable && confirms_reboot(record)) {
    ++counters_.reboots;
    return accept_first(record, arrival);
  }
  return refuse_backward(record, ft_step);
}

bool SequenceAccount::accept_first(const Record& record, Instant arrival) noexcept {
  has_last_ = true;
  host_credit_ = 0;
  remember(record, arrival);
  ++counters_.received;
  ++counters_.expected;
  return true;
}

bool SequenceAccount::accept_forward(const Record& record, Instant arrival, std::int32_t rdt_step,
                                     std::int32_t ft_step) noexcept {
  const auto advance = static_cast<std::uint64_t>(ft_step);
  const std::uint64_t records = std::max<std::uint64_t>(1, (advance + stride_ / 2) / stride_);
  if (rdt_step <= 0) {
    ++counters_.restarts;
  } else if (static_cast<std::uint64_t>(rdt_step) * stride_ != advance) {
    ++counters_.irregular;
  }
  if (records > 1) count_lost(records - 1, {last_ft_, record.ft_sequence});
  counters_.expected += records;
  ++counters_.received;
  remember(record, arrival);
  return true;
}

bool SequenceAccount::refuse_backward(const Record& record, std::int32_t ft_step) noexcept {
  if (ft_step < 0 && !in_recent_gap(record.ft_sequence)) {
    ++counters_.duplicates;
  } else {
    ++counters_.late;
  }
  return false;
}

bool SequenceAccount::plausible(std::int32_t ft_step, Instant arrival) const noexcept {
  const double device_seconds = ft_step / device_rate_hz_;
  const double host_seconds = std::max(0.0, to_seconds(arrival - last_arrival_));
  return device_seconds > -kLongestDelaySeconds && device_seconds < 2 * host_seconds + kLongestDelaySeconds;
}

bool SequenceAccount::confirms_reboot(const Record& record) noexcept {
  const bool confirms =
      has_stray_ && record.rdt_sequence == stray_rdt_ + 1 && record.ft_sequence == stray_ft_ + stride_;
  has_stray_ = true;
  stray_rdt_ = record.rdt_sequence;
  stray_ft_ = record.ft_sequence;
  return confirms;
}

void SequenceAccount::add_host_drops(std::uint64_t datagrams, std::uint64_t records_per_datagram) noexcept {
  counters_.host_drops += datagrams;
  host_credit_ += datagrams * records_per_datagram;
}

void SequenceAccount::count_lost(std::uint64_t records, const Gap& gap) noexcept {
  const std::uint64_t at_host = std::min(records, host_credit_);
  host_credit_ -= at_host;
  counters_.lost_host += at_host;
  counters_.lost_network += records - at_host;
  gaps_[gap_count_++ % gaps_.size()] = gap;
}

bool SequenceAccount::in_recent_gap(std::uint32_t ft) const noexcept {
  const auto known = static_cast<std::ptrdiff_t>(std::min<std::uint64_t>(gap_count_, gaps_.size()));
  return std::any_of(gaps_.begin(), gaps_.begin() + known,
                     [&](const Gap& gap) { return step(gap.after_ft, ft) > 0 && step(ft, gap.before_ft) > 0; });
}

}  // namespace kphi::netbox
