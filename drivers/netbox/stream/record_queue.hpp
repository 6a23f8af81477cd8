// Records on their way from the receiving thread to the consumer: decoded where they wait, copied once, by the
// consumer. No lock; touches its memory at construction and allocates nothing afterwards.
#pragma once

#include <algorithm>
#include <atomic>
#include <bit>
#include <cstdint>
#include <span>
#include <vector>

#include "base/device_data.hpp"
#include "base/huge_pages.hpp"

namespace kphi::netbox {

/// One writing thread, one reading thread.
class RecordQueue {
 public:
  /// Holds at least `records`.
  explicit RecordQueue(std::size_t records) : slots_(std::bit_ceil(records), LoadCellRecord{}) {}

  /// Writer: the slots of the next `count` records; empty when they do not fit in one piece: push() them.
  [[nodiscard]] std::span<LoadCellRecord> slots(std::size_t count) noexcept {
    const std::size_t first = written_ & (slots_.size() - 1);
    const bool fit = count <= slots_.size() - first && count <= slots_.size() - waiting();
    return {&slots_[first], fit ? count : 0};
  }
  /// Writer: the next `count` slots are filled.
  void fill(std::size_t count) noexcept { written_ += count; }
  /// Writer: copies as many of `records` as fit, oldest first; returns how many.
  std::size_t push(std::span<const LoadCellRecord> records) noexcept {
    records = records.first(std::min(records.size(), slots_.size() - waiting()));
    for (const LoadCellRecord& record : records) slots_[written_++ & (slots_.size() - 1)] = record;
    return records.size();
  }
  /// Writer: what has been written can be taken; true if there is more than last time.
  bool publish() noexcept { return published_.exchange(written_, std::memory_order_acq_rel) != written_; }
  /// Writer: written and not taken.
  [[nodiscard]] std::size_t waiting() const noexcept { return written_ - taken_.load(std::memory_order_acquire); }

  /// Reader: oldest first; returns how many.
  std::size_t take(std::span<LoadCellRecord> out) noexcept {
    const std::uint64_t taken = taken_.load(std::memory_order_relaxed);
    const std::size_t count = std::min<std::size_t>(out.size(), published_.load(std::memory_order_acquire) - taken);
    for (std::size_t i = 0; i < count; ++i) out[i] = slots_[(taken + i) & (slots_.size() - 1)];
    taken_.store(taken + count, std::memory_order_release);
    return count;
  }
  /// Reader: nothing can be taken.
  [[nodiscard]] bool empty() const noexcept {
    return published_.load(std::memory_order_acquire) == taken_.load(std::memory_order_relaxed);
  }

 private:
  std::vector<LoadCellRecord, HugePages<LoadCellRecord>> slots_;  // their number is a power of two
  alignas(64) std::uint64_t written_ = 0;                         // this and the others count since construction
  alignas(64) std::atomic<std::uint64_t> published_{0};
  alignas(64) std::atomic<std::uint64_t> taken_{0};
};

}  // namespace kphi::netbox
