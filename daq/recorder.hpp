// Empties the streams into the run file and remembers the newest of everything.
#pragma once

#include <array>
#include <atomic>
#include <boost/lockfree/spsc_queue.hpp>
#include <exception>
#include <string>
#include <vector>

#include "daq/bench.hpp"
#include "daq/interlock.hpp"
#include "daq/mounting.hpp"
#include "daq/streams.hpp"
#include "drivers/netbox/bias.hpp"
#include "drivers/netbox/published.hpp"
#include "drivers/netbox/range_watch.hpp"

namespace kphi::daq {

/// Two threads: drain() belongs to one, all else to the runner. Neither waits for the other.
class Recorder {
 public:
  Recorder(Bench& bench, Streams& streams, results::RunWriter& writer, const Mounting& mounting,
           const results::LoadCellScale& scale);

  /// Takes all that waits, appends it, secures the file when it is time. Keeps the first error for check_failure and
  /// does nothing after it.
  void drain() noexcept;
  /// Begins a phase.
  void mark(const results::PhaseMark& mark);
  /// What happened to load cell and motor since the last call; all of it is in the file already.
  [[nodiscard]] std::vector<results::StreamEvent> take_events();
  /// For what the runner found out by itself, once nobody drains any more.
  void note(const results::StreamEvent& event);
  /// Mean and standard deviation of all axes over the present phase, which measures a bias or the zero before.
  [[nodiscard]] netbox::ZeroMeasurement measured() const noexcept { return measured_.read(); }
  /// The mean thrust of the current phase becomes the zero of observe().
  void take_zero() noexcept;
  /// The newest of everything at bench time `now`.
  [[nodiscard]] Observation observe(Instant now) const noexcept;
  /// Share of the supply voltage that drives the motor, -1..1, as read last.
  [[nodiscard]] double drive_pwm() const noexcept { return drive_pwm_; }
  /// What the bench supply showed last; time 0: nothing yet.
  [[nodiscard]] results::SupplyReading supply() const noexcept { return supply_.read(); }
  /// Rethrows what drain() ran into.
  void check_failure();

 private:
  void drain_load_cell();
  void drain_motor();
  void drain_supply();
  void drain_marks();
  void drain_events();
  void look_at(std::span<const results::LoadCellRecord> batch);
  void note_range(netbox::RangeVerdict verdict, results::Nanoseconds at);

  Bench& bench_;
  Streams& streams_;
  results::RunWriter& writer_;
  Mounting mounting_;
  const netbox::Configuration scale_;
  netbox::RangeWatch watch_;
  netbox::RangeVerdict worst_ = netbox::RangeVerdict::inside;
  bool measuring_ = false;
  netbox::ZeroEstimate estimate_;
  const Duration fresh_load_cell_, fresh_motor_;
  Instant next_sync_;
  std::vector<results::LoadCellRecord> records_;
  std::vector<results::MotorReading> readings_;
  std::array<results::SupplyReading, 16> supply_readings_;
  boost::lockfree::spsc_queue<results::PhaseMark, boost::lockfree::capacity<1024>> marks_;
  // To the runner. Sized at run time: Boost 1.74's queue of fixed capacity never destroys what is left in it.
  boost::lockfree::spsc_queue<results::StreamEvent> events_{256};
  double phase_sum_n_ = 0;
  double phase_sum_nm_ = 0;
  std::uint64_t phase_count_ = 0;

  std::atomic<double> thrust_n_{0}, phase_mean_n_{0}, zero_n_{0};
  std::atomic<double> speed_rad_s_{0}, supply_current_a_{0}, coil_temperature_degc_{0};
  std::atomic<double> torque_nm_{0}, phase_mean_nm_{0}, zero_nm_{0};
  std::atomic<double> module_voltage_v_{0}, motor_current_a_{0}, drive_pwm_{0}, derate_{1};
  std::atomic<unsigned> fault_bits_{0};
  std::atomic<std::int64_t> load_cell_ns_, motor_ns_;
  netbox::Published<netbox::ZeroMeasurement> measured_;
  netbox::Published<results::SupplyReading> supply_;
  netbox::Published<std::array<double, 6>> loads_;
  std::atomic<bool> failed_{false};
  std::exception_ptr failure_;  // written before failed_, read after it
};

}  // namespace kphi::daq
