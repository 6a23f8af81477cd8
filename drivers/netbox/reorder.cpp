#include "drivers/netbox/reorder.hpp"

#include <algorithm>

namespace kphi::netbox {
namespace {

std::int32_t step(std::uint32_t from, std::uint32_t to) noexcept { return static_cast<std::int32_t>(to - from); }

std::int32_t ahead(const Record& record, const SequenceAccount& account) noexcept {
  return account.has_last() ? step(account.last_ft(), record.ft_sequence) : 0;
}

bool deliver(const StampedRecord& stamped, SequenceAccount& account, std::vector<StampedRecord>& out) {
  if (!account.accept(stamped.record, stamped.arrival)) return false;
  if (const auto first = account.take_confirmed()) out.push_back(*first);
  out.push_back(stamped);
  return true;
}

}  // namespace

ReorderWindow::ReorderWindow(std::size_t records, Duration patience, unsigned stride)
    : records_(records), patience_(patience), stride_(stride), reach_(static_cast<std::int32_t>(records * stride)) {
  held_.reserve(records_ + 1);
}

bool ReorderWindow::receive(const Record& record, Instant arrival, SequenceAccount& account,
                            std::vector<StampedRecord>& out) {
  const StampedRecord stamped{record, arrival};
  if (held_.empty() && account.is_next(record)) return deliver(stamped, account, out);
  expire(arrival, account, out);
  while (!held_.empty() && ahead(record, account) > reach_) release(run_length(0), account, out);
  const std::int32_t distance = ahead(record, account);
  // rdt one further: nothing is on its way, the box itself has left samples out.
  const bool follows = record.rdt_sequence == account.last_rdt() + 1;
  if (distance > 0 && distance <= reach_ && !follows && static_cast<std::uint32_t>(distance) != stride_) {
    if (!hold(stamped, account)) return false;
    if (held_.size() >= records_) release(run_length(0), account, out);
    return true;
  }
  if (account.looks_rebooted(record, arrival)) flush(account, out);
  const bool delivered = deliver(stamped, account, out);
  if (!delivered || held_.empty()) return delivered;
  ++account.counters().reordered;
  if (account.is_next(held_.front().record)) release(run_length(0), account, out);
  return true;
}

void ReorderWindow::expire(Instant now, SequenceAccount& account, std::vector<StampedRecord>& out) {
  if (held_.empty() || now < oldest_arrival_ + patience_) return;
  // A gap is as old as the oldest record behind it.
  const auto last = std::find_if(held_.rbegin(), held_.rend(),
                                 [&](const StampedRecord& held) { return now >= held.arrival + patience_; });
  const auto through = static_cast<std::size_t>(held_.rend() - last) - 1;
  release(through + run_length(through), account, out);
}

void ReorderWindow::flush(SequenceAccount& account, std::vector<StampedRecord>& out) {
  if (!held_.empty()) release(held_.size(), account, out);
}

bool ReorderWindow::hold(const StampedRecord& stamped, SequenceAccount& account) {
  const auto place = std::find_if(held_.rbegin(), held_.rend(), [&](const StampedRecord& held) {
    return step(held.record.ft_sequence, stamped.record.ft_sequence) >= 0;
  });
  if (place != held_.rend() && place->record.ft_sequence == stamped.record.ft_sequence) {
    ++account.counters().duplicates;
    return false;
  }
  if (place != held_.rbegin()) ++account.counters().reordered;
  held_.insert(place.base(), stamped);
  oldest_arrival_ = held_.size() == 1 ? stamped.arrival : std::min(oldest_arrival_, stamped.arrival);
  return true;
}

void ReorderWindow::release(std::size_t count, SequenceAccount& account, std::vector<StampedRecord>& out) {
  const auto end = held_.begin() + static_cast<std::ptrdiff_t>(count);
  for (auto held = held_.begin(); held != end; ++held) deliver(*held, account, out);
  held_.erase(held_.begin(), end);
  oldest_arrival_ = kNever;
  for (const StampedRecord& held : held_) oldest_arrival_ = std::min(oldest_arrival_, held.arrival);
}

std::size_t ReorderWindow::run_length(std::size_t from) const noexcept {
  std::size_t end = from + 1;
  while (end < held_.size() && held_[end].record.ft_sequence == held_[end - 1].record.ft_sequence + stride_) ++end;
  return end - from;
}

}  // namespace kphi::netbox
