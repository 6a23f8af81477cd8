// Records on their way from the receive thread to the consumer: decoded where they are stored, copied once at most, by
// the consumer. No lock; touches all its memory at construction and allocates nothing afterwards.
#pragma once

#include <algorithm>
#include <atomic>
#include <bit>
#include <cstdint>
#include <span>
#include <vector>

#include "drivers/netbox/stream/sequence.hpp"

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
  /// Writer: copies the oldest of `records` as far as they fit; how many did.
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
  /// Writer: the newest written record.
  [[nodiscard]] const StampedRecord& newest() const noexcept { return slots_[(written_ - 1) & (capacity_ - 1)]; }
  /// Writer: false when there is nothing new.
  bool publish() noexcept {
    if (published_.load(std::memory_order_relaxed) == written_) return false;
    published_.store(written_, std::memory_order_release);
    return true;
  }
  /// Writer: records that the reader has not taken yet.
  [[nodiscard]] std::size_t waiting() const noexcept { return written_ - taken_.load(std::memory_order_relaxed); }

  /// Reader: `sink` is called with spans of the oldest, in place; `most` in all. They are gone when it returns, and not
  /// when it throws. How many.
  template <class Sink>
  std::size_t consume(Sink&& sink, std::size_t most = SIZE_MAX) {
    const std::uint64_t taken = taken_.load(std::memory_order_relaxed);
    const std::size_t count = std::min<std::size_t>(most, published_.load(std::memory_order_acquire) - taken);
    const std::size_t from = taken & (capacity_ - 1), before_end = std::min(count, capacity_ - from);
    if (before_end > 0) sink(std::span<const StampedRecord>(&slots_[from], before_end));
    if (count > before_end) sink(std::span<const StampedRecord>(slots_.data(), count - before_end));
    taken_.store(taken + count, std::memory_order_release);
    return count;
  }
  /// Reader: oldest first; how many.
  std::size_t take(std::span<StampedRecord> out) noexcept {
    auto to = out.begin();
    return consume([&](std::span<const StampedRecord> some) { to = std::copy(some.begin(), some.end(), to); },
                   out.size());
  }
  /// Reader.
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
