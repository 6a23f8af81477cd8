// Puts records in order, decides which of them to accept, and counts the missing ones. Both sequence numbers are
// compared as signed differences modulo 2^32. No bytes, no I/O; one thread.
#pragma once

#include <boost/circular_buffer.hpp>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "base/clock.hpp"
#include "base/device_data.hpp"
#include "drivers/netbox/stream/events.hpp"

namespace kphi::netbox {

/// Accepted records and those missing before them. expected = received + lost_network + lost_host, always.
struct Counters : SampleAccount {
  std::uint64_t datagrams = 0;        ///< of any kind
  std::uint64_t drained = 0;          ///< datagrams that arrived while no stream was requested
  std::uint64_t host_drops = 0;       ///< datagrams that the socket dropped (SO_RXQ_OVFL)
  std::uint64_t reconnects = 0;       ///< times the stream was started again after it had ended
  std::uint64_t queue_overflows = 0;  ///< accepted, then lost because the consumer did not take them in time

  /// Of the records that reached the consumer: those lost by a full queue count as lost in this computer.
  [[nodiscard]] SampleAccount account() const noexcept {
    SampleAccount account = *this;
    account.received -= queue_overflows;
    account.lost_host += queue_overflows;
    return account;
  }
};

class LossTracker {
 public:
  /// `stride`: ft_sequence per record, 1..7000. `device_rate_hz`: ft_sequence per second.
  LossTracker(unsigned stride, double device_rate_hz) : stride_(stride), device_rate_hz_(device_rate_hz) {}

  /// The next record is the first of a requested stream: no record is missing before it.
  void begin_segment() noexcept;
  /// True: deliver it. False: counted and to be discarded.
  [[nodiscard]] bool accept(const LoadCellRecord& record) noexcept;
  /// True if they follow the last accepted record and each other in both numbers: deliver them. False: none is counted.
  [[nodiscard]] bool accept_run(std::span<const LoadCellRecord> records) noexcept {
    std::uint32_t rdt = last_rdt_, ft = last_ft_, deviation = !has_last_;
    for (const LoadCellRecord& record : records)
      deviation |= (record.rdt_sequence ^ ++rdt) | (record.ft_sequence ^ (ft += stride_));
    if (deviation != 0) return false;
    accept_sound(records.back(), records.size());
    return true;
  }
  /// From now on the box streams by another stride: what is missing until its next record counts by the new one.
  void change_stride(unsigned stride, double device_rate_hz) noexcept;
  /// The first record of a stream has arrived: earlier drops explain no later gap.
  void forget_host_drops() noexcept { host_credit_ = 0; }
  /// The first of the two records that proved a reboot, after accept() has taken the second: deliver both, in the order
  /// of their numbers.
  [[nodiscard]] std::optional<LoadCellRecord> take_confirmed() noexcept;
  /// Judging by this record alone, the box has booted.
  [[nodiscard]] bool looks_rebooted(const LoadCellRecord& record) const noexcept;
  [[nodiscard]] bool has_last() const noexcept { return has_last_; }
  [[nodiscard]] std::uint32_t last_ft() const noexcept { return last_ft_; }
  [[nodiscard]] std::uint32_t last_rdt() const noexcept { return stall_run_ > 0 ? stall_rdt_ : last_rdt_; }
  /// More datagrams were dropped by this computer's socket: they explain the gaps seen from now on.
  void add_host_drops(std::uint64_t datagrams, std::uint64_t records_per_datagram) noexcept;

  [[nodiscard]] const Counters& counters() const noexcept { return counters_; }
  [[nodiscard]] Counters& counters() noexcept { return counters_; }
  /// Restarts, reboots and stalls.
  [[nodiscard]] std::vector<Event>& events() noexcept { return events_; }

 private:
  struct Gap {
    std::uint32_t after_ft = 0, before_ft = 0;  // both were received
  };

  void remember(const LoadCellRecord& record) noexcept {
    last_rdt_ = record.rdt_sequence;
    last_ft_ = record.ft_sequence;
    last_arrival_ = record.arrival();
    has_stray_ = false;
  }
  /// No record is missing before the last of `count`.
  void accept_sound(const LoadCellRecord& record, std::uint64_t count = 1) noexcept {
    remember(record);
    counters_.received += count;
    counters_.expected += count;
  }
  bool accept_forward(const LoadCellRecord& record, std::int32_t rdt_step, std::int32_t ft_step) noexcept;
  bool refuse(std::uint64_t Counters::*as) noexcept {
    ++(counters_.*as);
    return false;
  }
  bool plausible(std::int32_t ft_step, Instant arrival) const noexcept;
  bool accept_reboot(const LoadCellRecord& record) noexcept;
  bool note_stray(const LoadCellRecord& record, std::int32_t ft_step) noexcept;
  bool confirms(const LoadCellRecord& first, const LoadCellRecord& second) const noexcept;
  void note_event(EventKind kind, const LoadCellRecord& record, std::uint64_t records) noexcept;
  /// The same for all records of one stream: they lie on one line of rdt over ft.
  std::uint32_t line(std::uint32_t rdt, std::uint32_t ft) const noexcept { return rdt * stride_ - ft; }
  bool on_former_line(const LoadCellRecord& record) const noexcept;
  void leave_line() noexcept { former_lines_.push_back(line(last_rdt_, last_ft_)); }
  void count_lost(std::uint64_t records, const Gap& gap) noexcept;
  bool in_recent_gap(std::uint32_t ft) const noexcept;

  std::uint32_t stride_;
  double device_rate_hz_;
  bool has_last_ = false;
  std::uint32_t last_rdt_ = 0, last_ft_ = 0;
  Instant last_arrival_{0};
  std::uint64_t host_credit_ = 0;         // records dropped by the socket and not yet found missing
  boost::circular_buffer<Gap> gaps_{16};  // the newest
  boost::circular_buffer<std::uint32_t> former_lines_{4};
  std::uint64_t stall_run_ = 0;  // records since the measurement stands still
  std::uint32_t stall_rdt_ = 0;
  bool began_anew_stalled_ = false;  // the stream did, while the measurement stood still
  bool has_stray_ = false;           // the last record was one that only a rebooted box can have sent
  LoadCellRecord candidate_reboot_;
  std::uint64_t Counters::*stray_counted_ = nullptr;  // as what it was discarded
  std::optional<LoadCellRecord> confirmed_;
  Counters counters_;
  std::vector<Event> events_;
};

/// Holds records that overtook others until those arrive or are given up, also at the start of a stream. Records in
/// order pass straight through. One thread; allocates at construction only.
class ReorderWindow {
 public:
  /// Holds at most `records`, each for at most `patience` (bench time) after its arrival. `stride`: ft_sequence per
  /// record.
  ReorderWindow(std::size_t records, Duration patience, unsigned stride);

  [[nodiscard]] bool empty() const noexcept { return held_.empty(); }
  /// Appends to `out` the records that can be delivered now, ascending in ft_sequence, counted by `account`. False if
  /// the record was refused and counted (duplicate, late, stalled).
  bool receive(const LoadCellRecord& record, LossTracker& account, std::vector<LoadCellRecord>& out);
  /// Counts the records of one datagram as accepted if none is missing and none is held: nearly always. False: nothing
  /// was counted.
  [[nodiscard]] bool accept_run(std::span<const LoadCellRecord> records, LossTracker& account) const noexcept {
    return held_.empty() && account.accept_run(records);
  }
  /// Gives up the gaps older than the patience.
  void expire(Instant now, LossTracker& account, std::vector<LoadCellRecord>& out);
  /// Gives up all gaps.
  void flush(LossTracker& account, std::vector<LoadCellRecord>& out);
  void forget() noexcept { held_.clear(); }
  /// When expire() will deliver; kNever if no record is held.
  [[nodiscard]] Instant deadline() const noexcept { return held_.empty() ? kNever : oldest_arrival_ + patience_; }

 private:
  [[nodiscard]] bool may_have_overtaken(const LoadCellRecord& record, const LossTracker& account) const noexcept;
  /// No record can be missing between (rdt, ft) and `record`.
  [[nodiscard]] bool follows(std::uint32_t rdt, std::uint32_t ft, const LoadCellRecord& record) const noexcept;
  bool hold(const LoadCellRecord& record, LossTracker& account);
  void release(std::size_t count, LossTracker& account, std::vector<LoadCellRecord>& out);
  [[nodiscard]] std::size_t run_length(std::size_t from) const noexcept;

  std::size_t records_;
  Duration patience_;
  std::uint32_t stride_;
  std::vector<LoadCellRecord> held_;  // ascending in ft_sequence, then rdt_sequence
  Instant oldest_arrival_ = kNever;
};

}  // namespace kphi::netbox
