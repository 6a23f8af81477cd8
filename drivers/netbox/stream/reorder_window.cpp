#include "drivers/netbox/stream/reorder_window.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

namespace kphi::netbox {
namespace {

// No datagram travels for longer: an ft_sequence further back than this, or ahead of the time that has passed, comes
// from a box that has booted.
constexpr double kLongestDelaySeconds = 5.0;
constexpr std::uint32_t kLargestStride = 7000;
constexpr double kUsualDelaySeconds = 0.05, kLargestSkew = 0.01;

std::int32_t step(std::uint32_t from, std::uint32_t to) noexcept { return static_cast<std::int32_t>(to - from); }

// A stream begins with this; one box reportedly begins with 0.
constexpr std::uint32_t kFirstRdt = 1;

/// Order in which the box took and sent them.
bool before(const LoadCellRecord& a, const LoadCellRecord& b) noexcept {
  const std::int32_t advance = step(a.ft_sequence, b.ft_sequence);
  return advance != 0 ? advance > 0 : step(a.rdt_sequence, b.rdt_sequence) > 0;
}

bool deliver(const LoadCellRecord& record, LossTracker& account, std::vector<LoadCellRecord>& out) {
  if (!account.accept(record)) return false;
  out.push_back(record);
  const auto other = account.take_confirmed();
  if (other) out.insert(before(*other, record) ? out.end() - 1 : out.end(), *other);
  return true;
}

}  // namespace

void LossTracker::begin_segment() noexcept {
  has_last_ = has_stray_ = began_anew_stalled_ = false;
  stall_run_ = 0;
  former_lines_.clear();
}

void LossTracker::change_stride(unsigned stride, double device_rate_hz) noexcept {
  if (stride == stride_ && device_rate_hz == device_rate_hz_) return;
  stride_ = stride;
  device_rate_hz_ = device_rate_hz;
  former_lines_.clear();
}

bool LossTracker::accept(const LoadCellRecord& record) noexcept {
  if (accept_run({&record, 1})) return true;
  if (!has_last_) {
    has_last_ = true;
    accept_sound(record);
    return true;
  }
  const std::int32_t rdt_step = step(last_rdt(), record.rdt_sequence);
  const std::int32_t ft_step = step(last_ft_, record.ft_sequence);
  if (ft_step == 0) {
    if (rdt_step == 0) return refuse(&Counters::duplicates);
    // Within one stream a repeated measurement follows its first record, never precedes it.
    began_anew_stalled_ |= step(last_rdt_, record.rdt_sequence) < 0;
    if (stall_run_++ == 0) note_event(EventKind::stalled, record, 0);
    stall_rdt_ = record.rdt_sequence;
    return refuse(&Counters::stalled);
  }
  if (looks_rebooted(record)) {
    if (note_stray(record, ft_step)) return accept_reboot(record);
    return refuse(stray_counted_);
  }
  if (ft_step > 0 && !on_former_line(record)) return accept_forward(record, rdt_step, ft_step);
  return refuse(ft_step < 0 && !in_recent_gap(record.ft_sequence) ? &Counters::duplicates : &Counters::late);
}

bool LossTracker::looks_rebooted(const LoadCellRecord& record) const noexcept {
  if (!has_last_) return false;
  const std::int32_t ft_step = step(last_ft_, record.ft_sequence), rdt_step = step(last_rdt(), record.rdt_sequence);
  if (!plausible(ft_step, record.arrival())) return true;
  // How far a box that booted, or a stream that began, after the last accepted record can have counted.
  const double host_seconds = to_seconds(record.arrival() - last_arrival_);
  const double most_seconds = kUsualDelaySeconds + (1 + kLargestSkew) * host_seconds;
  if (ft_step > 0) {
    // Near the wrap a boot looks like a step forward; the time that has passed tells them apart.
    const bool in_time =
        std::abs(ft_step / device_rate_hz_ - host_seconds) < kUsualDelaySeconds + kLargestSkew * host_seconds;
    return rdt_step <= 0 && record.ft_sequence / device_rate_hz_ < most_seconds && !in_time;
  }
  // A copy from a stream of an earlier session can still arrive. A late or duplicated record lies on the line of this
  // stream or of an earlier one.
  return ft_step < 0 && static_cast<double>(rdt_step) * stride_ / device_rate_hz_ < most_seconds &&
         line(record.rdt_sequence, record.ft_sequence) != line(last_rdt_, last_ft_) && !on_former_line(record);
}

bool LossTracker::on_former_line(const LoadCellRecord& record) const noexcept {
  const std::uint32_t its_line = line(record.rdt_sequence, record.ft_sequence);
  return its_line != line(last_rdt_, last_ft_) && std::ranges::find(former_lines_, its_line) != former_lines_.end();
}

bool LossTracker::note_stray(const LoadCellRecord& record, std::int32_t ft_step) noexcept {
  if (has_stray_ && (confirms(candidate_reboot_, record) || confirms(record, candidate_reboot_))) return true;
  has_stray_ = true;
  candidate_reboot_ = record;
  stray_counted_ = ft_step < 0 && !in_recent_gap(record.ft_sequence) ? &Counters::duplicates : &Counters::late;
  return false;
}

/// After a reboot the box may also count by another stride.
bool LossTracker::confirms(const LoadCellRecord& first, const LoadCellRecord& second) const noexcept {
  if (second.rdt_sequence != first.rdt_sequence + 1) return false;
  const Instant newest = std::max(first.arrival(), second.arrival());
  const std::uint32_t advance = second.ft_sequence - first.ft_sequence;
  return advance == stride_ ||
         (advance >= 1 && advance <= kLargestStride && !plausible(step(last_ft_, first.ft_sequence), newest));
}

bool LossTracker::accept_reboot(const LoadCellRecord& record) noexcept {
  const bool swapped = step(record.rdt_sequence, candidate_reboot_.rdt_sequence) > 0;
  const LoadCellRecord first = swapped ? record : candidate_reboot_, second = swapped ? candidate_reboot_ : record;
  confirmed_ = candidate_reboot_;
  counters_.reordered += swapped;
  --(counters_.*stray_counted_);
  ++counters_.reboots;
  note_event(EventKind::rebooted, first, 0);
  leave_line();
  gaps_.clear();
  stall_run_ = 0;
  began_anew_stalled_ = false;
  forget_host_drops();
  accept_sound(first);
  return accept_forward(second, 1, step(first.ft_sequence, second.ft_sequence));
}

std::optional<LoadCellRecord> LossTracker::take_confirmed() noexcept { return std::exchange(confirmed_, std::nullopt); }

void LossTracker::note_event(EventKind kind, const LoadCellRecord& record, std::uint64_t records) noexcept {
  events_.push_back(
      {kind, record.arrival(), record.rdt_sequence, record.ft_sequence, last_rdt_, last_ft_, records, record.status});
}

bool LossTracker::accept_forward(const LoadCellRecord& record, std::int32_t rdt_step, std::int32_t ft_step) noexcept {
  const auto advance = static_cast<std::uint64_t>(ft_step);
  const std::uint64_t records = std::max<std::uint64_t>(1, (advance + stride_ / 2) / stride_);
  if (rdt_step <= 0 || began_anew_stalled_) {
    ++counters_.restarts;
    note_event(EventKind::restarted, record, records - 1);
  } else if (static_cast<std::uint64_t>(rdt_step) * stride_ != advance) {
    ++counters_.irregular;
  }
  if (stall_run_ > 0) note_event(EventKind::stall_ended, record, stall_run_);
  stall_run_ = 0;
  began_anew_stalled_ = false;
  if (line(record.rdt_sequence, record.ft_sequence) != line(last_rdt_, last_ft_)) leave_line();
  if (records > 1) count_lost(records - 1, {last_ft_, record.ft_sequence});
  counters_.expected += records;
  ++counters_.received;
  remember(record);
  return true;
}

bool LossTracker::plausible(std::int32_t ft_step, Instant arrival) const noexcept {
  const double device_seconds = ft_step / device_rate_hz_;
  const double host_seconds = std::max(0.0, to_seconds(arrival - last_arrival_));
  return device_seconds > -kLongestDelaySeconds && device_seconds < 2 * host_seconds + kLongestDelaySeconds;
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
  gaps_.push_back(gap);
}

bool LossTracker::in_recent_gap(std::uint32_t ft) const noexcept {
  return std::ranges::any_of(gaps_,
                             [&](const Gap& gap) { return step(gap.after_ft, ft) > 0 && step(ft, gap.before_ft) > 0; });
}

ReorderWindow::ReorderWindow(std::size_t records, Duration patience, unsigned stride)
    : records_(records), patience_(patience), stride_(stride) {
  held_.reserve(records_ + 1);
}

bool ReorderWindow::receive(const LoadCellRecord& record, LossTracker& account, std::vector<LoadCellRecord>& out) {
  if (held_.empty() && !account.has_last()) account.forget_host_drops();
  expire(record.arrival(), account, out);
  const bool rebooted = account.looks_rebooted(record);
  if (!rebooted && may_have_overtaken(record, account)) {
    if (!hold(record, account)) return false;
    const bool begins = !account.has_last() && held_.front().rdt_sequence <= kFirstRdt;
    if (begins || held_.size() >= records_) release(run_length(0), account, out);
    return true;
  }
  if (rebooted) flush(account, out);
  const bool delivered = deliver(record, account, out);
  if (!delivered || held_.empty()) return delivered;
  ++account.counters().reordered;
  if (follows(account.last_rdt(), account.last_ft(), held_.front())) release(run_length(0), account, out);
  return true;
}

bool ReorderWindow::may_have_overtaken(const LoadCellRecord& record, const LossTracker& account) const noexcept {
  const bool behind_held = !held_.empty() && before(held_.front(), record);
  if (!account.has_last()) return record.rdt_sequence > kFirstRdt || behind_held;
  if (step(account.last_ft(), record.ft_sequence) <= 0) return false;
  return behind_held || !follows(account.last_rdt(), account.last_ft(), record);
}

bool ReorderWindow::follows(std::uint32_t rdt, std::uint32_t ft, const LoadCellRecord& record) const noexcept {
  // rdt one further alone: the box itself has left samples out. ft alone: it has begun a stream anew in between.
  return record.rdt_sequence == rdt + 1 || record.ft_sequence == ft + stride_;
}

void ReorderWindow::expire(Instant now, LossTracker& account, std::vector<LoadCellRecord>& out) {
  if (held_.empty() || now < oldest_arrival_ + patience_) return;
  // A gap is as old as the oldest record behind it.
  const auto last = std::find_if(held_.rbegin(), held_.rend(),
                                 [&](const LoadCellRecord& held) { return now >= held.arrival() + patience_; });
  const auto through = static_cast<std::size_t>(held_.rend() - last) - 1;
  release(through + run_length(through), account, out);
}

void ReorderWindow::flush(LossTracker& account, std::vector<LoadCellRecord>& out) {
  if (!held_.empty()) release(held_.size(), account, out);
}

bool ReorderWindow::hold(const LoadCellRecord& record, LossTracker& account) {
  const auto behind = std::find_if(held_.rbegin(), held_.rend(), [&](const LoadCellRecord& held) {
                        return !before(record, held);
                      }).base();
  if (behind != held_.begin() && !before(*std::prev(behind), record)) {
    ++account.counters().duplicates;
    return false;
  }
  if (behind != held_.end()) ++account.counters().reordered;
  held_.insert(behind, record);
  oldest_arrival_ = held_.size() == 1 ? record.arrival() : std::min(oldest_arrival_, record.arrival());
  return true;
}

void ReorderWindow::release(std::size_t count, LossTracker& account, std::vector<LoadCellRecord>& out) {
  const auto end = held_.begin() + static_cast<std::ptrdiff_t>(count);
  for (auto held = held_.begin(); held != end; ++held) deliver(*held, account, out);
  held_.erase(held_.begin(), end);
  oldest_arrival_ = kNever;
  for (const LoadCellRecord& held : held_) oldest_arrival_ = std::min(oldest_arrival_, held.arrival());
}

std::size_t ReorderWindow::run_length(std::size_t from) const noexcept {
  std::size_t end = from + 1;
  const auto last = [&]() -> const LoadCellRecord& { return held_[end - 1]; };
  while (end < held_.size() && follows(last().rdt_sequence, last().ft_sequence, held_[end])) ++end;
  return end - from;
}

}  // namespace kphi::netbox
