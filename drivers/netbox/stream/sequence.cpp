#include "drivers/netbox/stream/sequence.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace kphi::netbox {
namespace {

// No datagram is on its way for longer: ft_sequence further back than this, or ahead of the time that has passed, was
// counted by a box that has booted anew.
constexpr double kLongestDelaySeconds = 5.0;
constexpr std::uint32_t kLargestStride = 7000;
constexpr double kUsualDelaySeconds = 0.05, kLargestSkew = 0.01;

std::int32_t step(std::uint32_t from, std::uint32_t to) noexcept { return static_cast<std::int32_t>(to - from); }

}  // namespace

void LossTracker::begin_segment() noexcept {
  has_last_ = has_stray_ = false;
  stall_run_ = 0;
  began_anew_stalled_ = false;
  former_count_ = 0;
}

bool LossTracker::accept_unusual(const Record& record, Instant arrival) noexcept {
  if (!has_last_) return accept_first(record, arrival);
  const std::int32_t rdt_step = step(last_rdt(), record.rdt_sequence);
  const std::int32_t ft_step = step(last_ft_, record.ft_sequence);
  if (ft_step == 0) {
    if (rdt_step == 0) return refuse(&Counters::duplicates);
    // One stream shows the same measurement behind its first record, never before it.
    began_anew_stalled_ |= step(last_rdt_, record.rdt_sequence) < 0;
    note_stall(record, arrival);
    return refuse(&Counters::stalled);
  }
  if (looks_rebooted(record, arrival)) {
    if (note_stray(record, arrival, ft_step)) return accept_reboot(record, arrival);
    return refuse(stray_counted_);
  }
  if (ft_step > 0 && !on_former_line(record)) return accept_forward(record, arrival, rdt_step, ft_step);
  return refuse(ft_step < 0 && !in_recent_gap(record.ft_sequence) ? &Counters::duplicates : &Counters::late);
}

bool LossTracker::looks_rebooted(const Record& record, Instant arrival) const noexcept {
  if (!has_last_) return false;
  const std::int32_t ft_step = step(last_ft_, record.ft_sequence);
  if (!plausible(ft_step, arrival)) return true;
  // From shortly before the wrap, or behind it, a boot looks like a step forward; the time that has passed tells them
  // apart.
  const bool begins_anew = ft_step > 0 && step(last_rdt(), record.rdt_sequence) <= 0;
  if (begins_anew && counted_since_last(record.ft_sequence, arrival) && !in_time(ft_step, arrival)) return true;
  // A stream that a session before this one has asked for: a copy of it can be on its way still.
  if (ft_step < 0 && !sent_since_last(step(last_rdt(), record.rdt_sequence), arrival)) return false;
  // What is late or doubled lies on the line of this stream or of one before.
  return ft_step < 0 && line(record.rdt_sequence, record.ft_sequence) != line(last_rdt_, last_ft_) &&
         !on_former_line(record);
}

bool LossTracker::on_former_line(const Record& record) const noexcept {
  const std::uint32_t its_line = line(record.rdt_sequence, record.ft_sequence);
  if (its_line == line(last_rdt_, last_ft_)) return false;
  const auto known = static_cast<std::ptrdiff_t>(std::min<std::uint64_t>(former_count_, former_lines_.size()));
  return std::find(former_lines_.begin(), former_lines_.begin() + known, its_line) != former_lines_.begin() + known;
}

bool LossTracker::note_stray(const Record& record, Instant arrival, std::int32_t ft_step) noexcept {
  if (has_stray_ &&
      (confirms(candidate_reboot_.record, record, arrival) || confirms(record, candidate_reboot_.record, arrival)))
    return true;
  has_stray_ = true;
  candidate_reboot_ = {record, arrival};
  stray_counted_ = ft_step < 0 && !in_recent_gap(record.ft_sequence) ? &Counters::duplicates : &Counters::late;
  return false;
}

/// A box far from where it was may count by another stride, too.
bool LossTracker::confirms(const Record& first, const Record& second, Instant arrival) const noexcept {
  if (second.rdt_sequence != first.rdt_sequence + 1) return false;
  const std::uint32_t advance = second.ft_sequence - first.ft_sequence;
  return advance == stride_ ||
         (advance >= 1 && advance <= kLargestStride && !plausible(step(last_ft_, first.ft_sequence), arrival));
}

bool LossTracker::accept_reboot(const Record& record, Instant arrival) noexcept {
  const StampedRecord newest{record, arrival};
  const bool swapped = step(record.rdt_sequence, candidate_reboot_.record.rdt_sequence) > 0;
  const StampedRecord first = swapped ? newest : candidate_reboot_, second = swapped ? candidate_reboot_ : newest;
  confirmed_ = candidate_reboot_;
  counters_.reordered += swapped;
  --(counters_.*stray_counted_);
  ++counters_.reboots;
  note_event(EventKind::rebooted, first.record, first.arrival, 0);
  leave_line();
  gap_count_ = 0;
  stall_run_ = 0;
  began_anew_stalled_ = false;
  forget_host_drops();
  accept_first(first.record, first.arrival);
  return accept_forward(second.record, second.arrival, 1, step(first.record.ft_sequence, second.record.ft_sequence));
}

std::optional<StampedRecord> LossTracker::take_confirmed() noexcept { return std::exchange(confirmed_, std::nullopt); }

void LossTracker::note_stall(const Record& record, Instant arrival) noexcept {
  if (stall_run_++ == 0) note_event(EventKind::stalled, record, arrival, 0);
  stall_rdt_ = record.rdt_sequence;
}

void LossTracker::note_event(EventKind kind, const Record& record, Instant at, std::uint64_t records) noexcept {
  events_.note({kind, at, record.rdt_sequence, record.ft_sequence, last_rdt_, last_ft_, records, record.status});
}

bool LossTracker::accept_first(const Record& record, Instant arrival) noexcept {
  has_last_ = true;
  remember(record, arrival);
  ++counters_.received;
  ++counters_.expected;
  return true;
}

bool LossTracker::accept_forward(const Record& record, Instant arrival, std::int32_t rdt_step,
                                 std::int32_t ft_step) noexcept {
  const auto advance = static_cast<std::uint64_t>(ft_step);
  const std::uint64_t records = std::max<std::uint64_t>(1, (advance + stride_ / 2) / stride_);
  if (rdt_step <= 0 || began_anew_stalled_) {
    note_restart(record, arrival, records - 1);
  } else if (static_cast<std::uint64_t>(rdt_step) * stride_ != advance) {
    ++counters_.irregular;
  }
  if (stall_run_ > 0) note_event(EventKind::stall_ended, record, arrival, stall_run_);
  stall_run_ = 0;
  began_anew_stalled_ = false;
  if (line(record.rdt_sequence, record.ft_sequence) != line(last_rdt_, last_ft_)) leave_line();
  if (records > 1) count_lost(records - 1, {last_ft_, record.ft_sequence});
  counters_.expected += records;
  ++counters_.received;
  remember(record, arrival);
  return true;
}

void LossTracker::note_restart(const Record& record, Instant arrival, std::uint64_t missing) noexcept {
  if (renewals_expected_ > 0) {
    --renewals_expected_;
    ++counters_.renewals;
    counters_.lost_at_renewals += missing;
    return;
  }
  ++counters_.restarts;
  note_event(EventKind::restarted, record, arrival, missing);
}

bool LossTracker::plausible(std::int32_t ft_step, Instant arrival) const noexcept {
  const double device_seconds = ft_step / device_rate_hz_;
  const double host_seconds = std::max(0.0, to_seconds(arrival - last_arrival_));
  return device_seconds > -kLongestDelaySeconds && device_seconds < 2 * host_seconds + kLongestDelaySeconds;
}

bool LossTracker::counted_since_last(std::uint32_t ft, Instant arrival) const noexcept {
  const double host_seconds = to_seconds(arrival - last_arrival_);
  return ft / device_rate_hz_ < kUsualDelaySeconds + (1 + kLargestSkew) * host_seconds;
}

bool LossTracker::in_time(std::int32_t ft_step, Instant arrival) const noexcept {
  const double host_seconds = to_seconds(arrival - last_arrival_);
  return std::abs(ft_step / device_rate_hz_ - host_seconds) < kUsualDelaySeconds + kLargestSkew * host_seconds;
}

bool LossTracker::sent_since_last(std::int32_t rdt_step, Instant arrival) const noexcept {
  const double device_seconds = static_cast<double>(rdt_step) * stride_ / device_rate_hz_;
  return device_seconds < kUsualDelaySeconds + (1 + kLargestSkew) * to_seconds(arrival - last_arrival_);
}

void LossTracker::add_host_drops(std::uint64_t datagrams, std::uint64_t records_per_datagram) noexcept {
  counters_.host_drops += datagrams;
  host_credit_ += datagrams * records_per_datagram;
}

void LossTracker::count_lost(std::uint64_t records, const Gap& gap) noexcept {
  const std::uint64_t at_host = std::min(records, host_credit_);
  host_credit_ -= at_host;
  counters_.lost_host += at_host;
  counters_.lost_network += records - at_host;
  gaps_[gap_count_++ % gaps_.size()] = gap;
}

bool LossTracker::in_recent_gap(std::uint32_t ft) const noexcept {
  const auto known = static_cast<std::ptrdiff_t>(std::min<std::uint64_t>(gap_count_, gaps_.size()));
  return std::any_of(gaps_.begin(), gaps_.begin() + known,
                     [&](const Gap& gap) { return step(gap.after_ft, ft) > 0 && step(ft, gap.before_ft) > 0; });
}

}  // namespace kphi::netbox
