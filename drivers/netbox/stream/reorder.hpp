// Records that overtook others, also the first of a stream, wait here until those have come, or are given up. What
// follows its predecessor passes straight through. One thread; allocates at construction only.
#pragma once

#include <vector>

#include "base/clock.hpp"
#include "drivers/netbox/stream/sequence.hpp"

namespace kphi::netbox {

class ReorderWindow {
 public:
  /// At most `records` wait, however long the gap before them; none longer than `patience` (bench time) once time has
  /// been told. `stride`: ft_sequence per record.
  ReorderWindow(std::size_t records, Duration patience, unsigned stride);

  [[nodiscard]] bool empty() const noexcept { return held_.empty(); }
  /// Appends to `out` what can be delivered now: ascending in ft_sequence, counted by `account`. False: the record was
  /// refused and counted (duplicate, late, stalled).
  bool receive(const Record& record, Instant arrival, LossTracker& account, std::vector<StampedRecord>& out);
  /// Gives up the gaps known for longer than the patience.
  void expire(Instant now, LossTracker& account, std::vector<StampedRecord>& out);
  /// Gives up all gaps.
  void flush(LossTracker& account, std::vector<StampedRecord>& out);
  void forget() noexcept { held_.clear(); }
  /// When expire() will find something; kNever when nothing waits.
  [[nodiscard]] Instant deadline() const noexcept { return held_.empty() ? kNever : oldest_arrival_ + patience_; }

 private:
  [[nodiscard]] bool may_have_overtaken(const Record& record, const LossTracker& account) const noexcept;
  /// Nothing can be on its way between (rdt, ft) and `record`.
  [[nodiscard]] bool follows(std::uint32_t rdt, std::uint32_t ft, const Record& record) const noexcept;
  bool hold(const StampedRecord& stamped, LossTracker& account);
  void release(std::size_t count, LossTracker& account, std::vector<StampedRecord>& out);
  [[nodiscard]] std::size_t run_length(std::size_t from) const noexcept;

  const std::size_t records_;
  const Duration patience_;
  const std::uint32_t stride_;
  std::vector<StampedRecord> held_;  // ascending in ft_sequence, then rdt_sequence
  Instant oldest_arrival_ = kNever;
};

}  // namespace kphi::netbox
