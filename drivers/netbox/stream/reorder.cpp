#include "drivers/netbox/stream/reorder.hpp"

#include <algorithm>
#include <iterator>

namespace kphi::netbox {
namespace {

// A stream begins with it; one box is said to begin with 0.
constexpr std::uint32_t kFirstRdt = 1;

std::int32_t step(std::uint32_t from, std::uint32_t to) noexcept { return static_cast<std::int32_t>(to - from); }

/// Order in which the box took and sent them.
bool before(const Record& a, const Record& b) noexcept {
  const std::int32_t advance = step(a.ft_sequence, b.ft_sequence);
  return advance != 0 ? advance > 0 : step(a.rdt_sequence, b.rdt_sequence) > 0;
}

bool deliver(const StampedRecord& stamped, LossTracker& account, std::vector<StampedRecord>& out) {
  if (!account.accept(stamped.record, stamped.arrival)) return false;
  out.push_back(stamped);
  const auto other = account.take_confirmed();
  if (other) out.insert(before(other->record, stamped.record) ? out.end() - 1 : out.end(), *other);
  return true;
}

}  // namespace

ReorderWindow::ReorderWindow(std::size_t records, Duration patience, unsigned stride)
    : records_(records), patience_(patience), stride_(stride) {
  held_.reserve(records_ + 1);
}

bool ReorderWindow::receive(const Record& record, Instant arrival, LossTracker& account,
                            std::vector<StampedRecord>& out) {
  const StampedRecord stamped{record, arrival};
  if (held_.empty() && account.is_next(record)) return deliver(stamped, account, out);
  if (held_.empty() && !account.has_last()) account.forget_host_drops();
  expire(arrival, account, out);
  const bool rebooted = account.looks_rebooted(record, arrival);
  if (!rebooted && may_have_overtaken(record, account)) {
    if (!hold(stamped, account)) return false;
    const bool begins = !account.has_last() && held_.front().record.rdt_sequence <= kFirstRdt;
    if (begins || held_.size() >= records_) release(run_length(0), account, out);
    return true;
  }
  if (rebooted) flush(account, out);
  const bool delivered = deliver(stamped, account, out);
  if (!delivered || held_.empty()) return delivered;
  ++account.counters().reordered;
  if (follows(account.last_rdt(), account.last_ft(), held_.front().record)) release(run_length(0), account, out);
  return true;
}

bool ReorderWindow::may_have_overtaken(const Record& record, const LossTracker& account) const noexcept {
  const bool behind_held = !held_.empty() && before(held_.front().record, record);
  if (!account.has_last()) return record.rdt_sequence > kFirstRdt || behind_held;
  if (step(account.last_ft(), record.ft_sequence) <= 0) return false;
  return behind_held || !follows(account.last_rdt(), account.last_ft(), record);
}

bool ReorderWindow::follows(std::uint32_t rdt, std::uint32_t ft, const Record& record) const noexcept {
  // rdt one further alone: the box itself has left samples out. ft alone: it has begun a stream anew in between.
  return record.rdt_sequence == rdt + 1 || record.ft_sequence == ft + stride_;
}

void ReorderWindow::expire(Instant now, LossTracker& account, std::vector<StampedRecord>& out) {
  if (held_.empty() || now < oldest_arrival_ + patience_) return;
  // A gap is as old as the oldest record behind it.
  const auto last = std::find_if(held_.rbegin(), held_.rend(),
                                 [&](const StampedRecord& held) { return now >= held.arrival + patience_; });
  const auto through = static_cast<std::size_t>(held_.rend() - last) - 1;
  release(through + run_length(through), account, out);
}

void ReorderWindow::flush(LossTracker& account, std::vector<StampedRecord>& out) {
  if (!held_.empty()) release(held_.size(), account, out);
}

bool ReorderWindow::hold(const StampedRecord& stamped, LossTracker& account) {
  const auto behind = std::find_if(held_.rbegin(), held_.rend(), [&](const StampedRecord& held) {
                        return !before(stamped.record, held.record);
                      }).base();
  if (behind != held_.begin() && !before(std::prev(behind)->record, stamped.record)) {
    ++account.counters().duplicates;
    return false;
  }
  if (behind != held_.end()) ++account.counters().reordered;
  held_.insert(behind, stamped);
  oldest_arrival_ = held_.size() == 1 ? stamped.arrival : std::min(oldest_arrival_, stamped.arrival);
  return true;
}

void ReorderWindow::release(std::size_t count, LossTracker& account, std::vector<StampedRecord>& out) {
  const auto end = held_.begin() + static_cast<std::ptrdiff_t>(count);
  for (auto held = held_.begin(); held != end; ++held) deliver(*held, account, out);
  held_.erase(held_.begin(), end);
  oldest_arrival_ = kNever;
  for (const StampedRecord& held : held_) oldest_arrival_ = std::min(oldest_arrival_, held.arrival);
}

std::size_t ReorderWindow::run_length(std::size_t from) const noexcept {
  std::size_t end = from + 1;
  const auto last = [&]() -> const Record& { return held_[end - 1].record; };
  while (end < held_.size() && follows(last().rdt_sequence, last().ft_sequence, held_[end].record)) ++end;
  return end - from;
}

}  // namespace kphi::netbox
