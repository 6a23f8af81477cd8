// Queue of records between the receive thread and the consumer. The receive thread decodes into it. No lock; touches
// all its memory at construction and allocates nothing afterwards.
#pragma once

#include <algorithm>
#include <atomic>
#include <bit>
#include <cstdint>
#include <span>
#include <vector>

#include "drivers/netbox/stream/reorder_window.hpp"

namespace kphi::netbox {

/// One writing thread, one reading thread.
class RecordRing {
 public:
  /// Holds at least `records`.
  explicit RecordRing(std::size_t records)
      : capacity_(std::bit_ceil(std::max(records, kMaxRecords))), slots_(capacity_ + kMaxRecords) {}

  [[nodiscard]] std::size_t capacity() const noexcept { return capacity_; }

  /// Writer: where the next `count` records (at most kMaxRecords) go; empty when they do not fit.
  [[nodiscard]] std::span<StampedRecord> room(std::size_t count) noexcept {
    if (capacity_ - (written_ - taken_seen_) < count) {
      taken_seen_ = taken_.load(std::memory_order_acquire);
      if (capacity_ - (written_ - taken_seen_) < count) return {};
    }
    return {&slots_[written_ & (capacity_ - 1)], count};
  }
  /// Writer: the first `count` slots of room() are filled. The reader sees them after publish().
  void fill(std::size_t count) noexcept {
    const std::size_t end = (written_ & (capacity_ - 1)) + count;
    if (end > capacity_) std::copy_n(&slots_[capacity_], end - capacity_, slots_.data());
    written_ += count;
  }
  /// Writer: copies as many of `records` as fit, oldest first; returns how many.
  std::size_t push(std::span<const StampedRecord> records) noexcept {
    std::size_t pushed = 0;
    for (; pushed < records.size(); ++pushed) {
      const std::span<StampedRecord> slot = room(1);
      if (slot.empty()) break;
      slot[0] = records[pushed];
      fill(1);
    }
    return pushed;
  }
  /// Writer: shows the reader all records written; false if there are no new ones.
  bool publish() noexcept {
    if (published_.load(std::memory_order_relaxed) == written_) return false;
    published_.store(written_, std::memory_order_release);
    return true;
  }
  /// Writer: records not taken yet.
  [[nodiscard]] std::size_t waiting() const noexcept { return written_ - taken_.load(std::memory_order_relaxed); }

  /// Reader: copies the oldest records; returns how many.
  std::size_t take(std::span<StampedRecord> out) noexcept {
    const std::uint64_t taken = taken_.load(std::memory_order_relaxed);
    const std::size_t count = std::min<std::size_t>(out.size(), published_.load(std::memory_order_acquire) - taken);
    const std::size_t from = taken & (capacity_ - 1), before_end = std::min(count, capacity_ - from);
    std::copy_n(&slots_[from], before_end, out.begin());
    std::copy_n(slots_.data(), count - before_end, out.begin() + static_cast<std::ptrdiff_t>(before_end));
    taken_.store(taken + count, std::memory_order_release);
    return count;
  }
  /// Reader: no record is waiting.
  [[nodiscard]] bool empty() const noexcept {
    return published_.load(std::memory_order_acquire) == taken_.load(std::memory_order_relaxed);
  }

 private:
  const std::size_t capacity_;             // a power of two
  std::vector<StampedRecord> slots_;       // beyond capacity_: so that room() need not be cut at the end
  alignas(64) std::uint64_t written_ = 0;  // the writer's own, like taken_seen_; all count since construction
  std::uint64_t taken_seen_ = 0;
  alignas(64) std::atomic<std::uint64_t> published_{0};
  alignas(64) std::atomic<std::uint64_t> taken_{0};
};

}  // namespace kphi::netbox
