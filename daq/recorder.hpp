// Empties the devices' queues into the run file and remembers the newest of everything.
#pragma once

#include <atomic>
#include <boost/lockfree/spsc_queue.hpp>
#include <exception>
#include <vector>

#include "daq/bench.hpp"
#include "daq/interlock.hpp"

namespace kphi::daq {

/// How thrust is read off the six axes.
struct ThrustAxis {
  int axis = 2;  ///< 0..2 = Fx, Fy, Fz
  int sign = +1;
  double counts_per_newton = 1e6;
};

/// Two threads: drain() belongs to one, all else to the runner. Neither waits for the other.
class Recorder {
 public:
  Recorder(Bench& bench, results::RunWriter& writer, ThrustAxis axis);

  /// Takes all that waits, appends it, secures the file when it is time. Keeps the first error for check_failure and
  /// does nothing after it.
  void drain() noexcept;
  /// Begins a phase now.
  void mark(results::Phase phase, int step, RadPerSec commanded);
  /// The mean thrust of the current phase becomes the zero of observe().
  void take_zero() noexcept;
  /// The newest of everything at bench time `now`.
  [[nodiscard]] Observation observe(Instant now) const noexcept;
  /// Rethrows what drain() ran into.
  void check_failure();

 private:
  void drain_load_cell();
  void drain_motor();
  void drain_marks();

  Bench& bench_;
  results::RunWriter& writer_;
  ThrustAxis axis_;
  Instant next_sync_;
  std::vector<results::LoadCellRecord> records_;
  std::vector<results::MotorReading> readings_;
  boost::lockfree::spsc_queue<results::PhaseMark, boost::lockfree::capacity<1024>> marks_;
  double phase_sum_n_ = 0;
  std::uint64_t phase_count_ = 0;

  std::atomic<double> thrust_n_{0}, phase_mean_n_{0}, zero_n_{0};
  std::atomic<double> speed_rad_s_{0}, supply_current_a_{0}, coil_temperature_degc_{0};
  std::atomic<std::int64_t> load_cell_ns_, motor_ns_;
  std::atomic<bool> failed_{false};
  std::exception_ptr failure_;  // written before failed_, read after it
};

}  // namespace kphi::daq
