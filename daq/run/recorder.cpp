#include "daq/run/recorder.hpp"

#include <fmt/format.h>

#include <cmath>

#include "daq/bench/device_records.hpp"

namespace kphi::daq {
namespace {

constexpr std::size_t kRecordsAtOnce = 7000;
constexpr std::size_t kReadingsAtOnce = 512;
constexpr std::array kAxes{"Fx", "Fy", "Fz", "Tx", "Ty", "Tz"};

results::EventKind kind_of(netbox::RangeVerdict verdict) {
  return verdict == netbox::RangeVerdict::near ? results::EventKind::near_range : results::EventKind::beyond_range;
}

}  // namespace

Recorder::Recorder(Bench& bench, Streams& streams, results::RunWriter& writer, const results::LoadCellScale& scale)
    : bench_(bench),
      streams_(streams),
      writer_(writer),
      scale_(to_configuration(scale)),
      range_(scale_),
      next_sync_(bench.clock().now() + bench.sync_interval()),
      records_(kRecordsAtOnce),
      readings_(kReadingsAtOnce) {}

void Recorder::drain() noexcept {
  if (failed_.load(std::memory_order_relaxed)) return;
  try {
    drain_marks();
    drain_load_cell();
    drain_events();
    drain_motor();
    drain_supply();
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
                 mark.phase == results::Phase::zero_before;
    estimate_ = {};
  }
}

void Recorder::drain_events() {
  for (const results::StreamEvent& event : streams_.take_events()) note(event);
}

void Recorder::note(const results::StreamEvent& event) {
  writer_.note(event);
  events_.push(event);  // when the queue is full, the file still has it
}

void Recorder::inspect(std::span<const results::LoadCellRecord> batch) {
  for (const results::LoadCellRecord& record : batch) {
    const netbox::StampedRecord stamped = to_stamped(record);
    // The guard judges whether the load endangers the cell.
    const netbox::RangeVerdict verdict = std::min(range_.look(stamped.record), netbox::RangeVerdict::beyond);
    if (verdict > worst_) note_range(verdict, record.arrival_ns);
    if (measuring_) estimate_.add(stamped);
  }
  if (measuring_) measured_.publish(estimate_.result(scale_));
}

void Recorder::note_range(netbox::RangeVerdict verdict, results::Nanoseconds at) {
  worst_ = verdict;
  const auto axis = static_cast<std::size_t>(range_.worst_axis());
  const std::string load = fmt::format("{} carries {:.0f} % of its range of {:g} {}", kAxes[axis],
                                       100 * range_.largest_load(), scale_.range[axis], axis < 3 ? "N" : "N m");
  note({kind_of(verdict), at, 0, fmt::format("{:.3f} s: {}", 1e-9 * static_cast<double>(at), load)});
}

void Recorder::drain_load_cell() {
  while (const std::size_t n = streams_.take(records_)) {
    const std::span<const results::LoadCellRecord> batch(records_.data(), n);
    writer_.append(batch);
    inspect(batch);
  }
}

void Recorder::drain_motor() {
  while (const std::size_t n = streams_.take(readings_))
    writer_.append(std::span<const results::MotorReading>(readings_.data(), n));
}

void Recorder::drain_supply() {
  while (const std::size_t n = streams_.take(supply_readings_))
    writer_.append(std::span<const results::SupplyReading>(supply_readings_.data(), n));
}

void Recorder::mark(const results::PhaseMark& mark) {
  // The queue holds more marks than a run has; it can only be full when nobody drains it.
  if (!marks_.push(mark)) throw std::runtime_error("recorder: stalled, its queue of marks is full");
}

std::vector<results::StreamEvent> Recorder::take_events() {
  std::vector<results::StreamEvent> taken;
  events_.consume_all([&](const results::StreamEvent& event) { taken.push_back(event); });
  return taken;
}

void Recorder::check_failure() {
  if (failed_.load(std::memory_order_acquire)) std::rethrow_exception(failure_);
}

}  // namespace kphi::daq
