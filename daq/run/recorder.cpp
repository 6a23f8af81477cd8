#include "daq/run/recorder.hpp"

#include <fmt/format.h>

#include "daq/bench/device_records.hpp"
#include "daq/guard/guard_limits.hpp"

namespace kphi::daq {
namespace {

constexpr std::size_t kRecordsAtOnce = 7000;
constexpr std::size_t kReadingsAtOnce = 512;
constexpr std::size_t kSupplyReadingsAtOnce = 16;

}  // namespace

Recorder::Recorder(Bench& bench, Guard& guard, results::RunWriter& writer)
    : bench_(bench),
      guard_(guard),
      writer_(writer),
      scale_(to_cell(bench.load_cell().scale())),
      range_(scale_),
      next_sync_(bench.clock().now() + bench.sync_interval()),
      records_(kRecordsAtOnce),
      readings_(kReadingsAtOnce),
      supply_readings_(kSupplyReadingsAtOnce) {}

void Recorder::drain() noexcept {
  if (failed_.load(std::memory_order_relaxed)) return;
  try {
    drain_marks();
    drain(records_);
    for (const StreamEvent& event : guard_.take_events()) note(event);
    drain(readings_);
    drain(supply_readings_);
    if (const Instant now = bench_.clock().now(); now >= next_sync_) {
      writer_.sync();
      next_sync_ = now + bench_.sync_interval();
    }
  } catch (...) {
    failure_ = std::current_exception();
    failed_.store(true, std::memory_order_release);
  }
}

void Recorder::drain_marks() {
  results::PhaseMark mark;
  while (marks_.pop(mark)) {
    writer_.mark(mark);
    measuring_ = mark.phase == results::Phase::bias_before || mark.phase == results::Phase::bias_after ||
                 mark.phase == results::Phase::zero_before || mark.phase == results::Phase::step;
    estimate_ = {};
  }
}

void Recorder::note(const StreamEvent& event) {
  writer_.note(event);
  events_.push(event);  // when the queue is full, the file still has it
}

void Recorder::inspect(std::span<const LoadCellRecord> batch) {
  for (const LoadCellRecord& record : batch) {
    // The guard judges whether the load endangers the cell.
    const netbox::RangeVerdict verdict = range_.look(record.counts);
    if (verdict > worst_) note_range(verdict, record.arrival_ns);
    if (measuring_) estimate_.add(record.counts, record.status);
  }
  if (measuring_) measured_.publish(estimate_.result(scale_));
}

void Recorder::note_range(netbox::RangeVerdict verdict, Nanoseconds at) {
  worst_ = verdict;
  const auto axis = static_cast<std::size_t>(range_.worst_axis());
  const GuardedQuantity& row = row_of(static_cast<Watched>(axis));
  note(event_at(Instant(at), verdict == netbox::RangeVerdict::near ? EventKind::near_range : EventKind::beyond_range,
                fmt::format("{} carries {:.0f} % of its range of {:g} {}", row.name, 100 * range_.largest_load(),
                            scale_.range[axis], row.unit)));
}

template <class T>
void Recorder::drain(std::vector<T>& buffer) {
  while (const std::size_t n = guard_.take(buffer)) {
    const auto batch = std::span<const T>(buffer).first(n);
    writer_.append(batch);
    if constexpr (std::is_same_v<T, LoadCellRecord>) inspect(batch);
  }
}

void Recorder::mark(const results::PhaseMark& mark) {
  // The queue holds more marks than a run has; it can only be full when nobody drains it.
  if (!marks_.push(mark)) throw std::runtime_error("recorder: stalled, its queue of marks is full");
}

void Recorder::check_failure() {
  if (failed_.load(std::memory_order_acquire)) std::rethrow_exception(failure_);
}

}  // namespace kphi::daq
