// Writes the streams into the run file.
#pragma once

#include <atomic>
#include <boost/lockfree/spsc_queue.hpp>
#include <exception>
#include <vector>

#include "base/published.hpp"
#include "daq/bench/bench.hpp"
#include "daq/guard/guard.hpp"
#include "drivers/netbox/receive/load.hpp"
#include "results/run_writer.hpp"

namespace kphi::daq {

/// Two threads, neither of which waits for the other: one calls drain(), the runner calls everything else.
class Recorder {
 public:
  Recorder(Bench& bench, Guard& guard, results::RunWriter& writer);

  /// Appends everything that has arrived, and syncs the file when it is due. Keeps the first error for check_failure()
  /// and does nothing after it.
  void drain() noexcept;
  /// Begins a phase.
  void mark(const results::PhaseMark& mark);
  /// Events of load cell and motor since the last call, already in the file.
  [[nodiscard]] std::vector<StreamEvent> take_events() { return take_all(events_); }
  /// Records an event of the runner. Call it only after the last drain().
  void note(const StreamEvent& event);
  /// Mean and standard deviation of all axes over the present phase, if it measures a bias or the zero before, or holds
  /// a step; of the phase before it until the first record of this one was drained.
  [[nodiscard]] netbox::ZeroMeasurement measured() const noexcept { return measured_.read(); }
  /// Rethrows the first error of drain().
  void check_failure();

 private:
  template <class T>
  void drain(std::vector<T>& buffer);
  void drain_marks();
  void inspect(std::span<const LoadCellRecord> batch);
  void note_range(netbox::RangeVerdict verdict, Nanoseconds at);

  Bench& bench_;
  Guard& guard_;
  results::RunWriter& writer_;
  const netbox::CellScale scale_;
  netbox::RangeWatch range_;
  netbox::RangeVerdict worst_ = netbox::RangeVerdict::inside;
  bool measuring_ = false;
  netbox::ZeroEstimate estimate_;
  Instant next_sync_;
  std::vector<LoadCellRecord> records_;
  std::vector<MotorReading> readings_;
  std::vector<SupplyReading> supply_readings_;
  boost::lockfree::spsc_queue<results::PhaseMark, boost::lockfree::capacity<1024>> marks_;
  // To the runner. Sized at run time: Boost 1.74's queue of fixed capacity never destroys what is left in it.
  boost::lockfree::spsc_queue<StreamEvent> events_{256};
  Published<netbox::ZeroMeasurement> measured_;
  std::atomic<bool> failed_{false};
  std::exception_ptr failure_;  // written before failed_, read after it
};

}  // namespace kphi::daq
