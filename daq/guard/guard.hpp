// Watches the bench in a thread of its own, between the devices and the recorder, and coasts the motor by itself.
//
// Every sample and reading passes through it before it is recorded: neither a runner that hangs nor a disk that does
// not answer keeps it from seeing one. What it judges:
//   load cell   every sample against the ranges, 5 ms means of thrust and shaft torque (see LoadWatch);
//               the box's status word (status_watch.hpp), also at rest: zeros are taken then
//   motor       every reading by itself: a checksum protects it, and the module has filtered it
//   supply      every reading: its state, its settings, its meters
//   silence     the age of each stream's newest element; twice, so that what waits in this computer's sockets is taken
//   the runner  its heartbeat, first; the runner in turn checks the guard's
//   the recorder its heartbeat; no disk keeps the motor turning while nothing is written
//
// From the sample that exceeds a limit to the order to coast: 5 ms of its own on a live bench, plus the window of the
// means. Silence is found 25 ms after its patience, a rotor that does not follow after the times in speed_error.hpp.
// The first trip holds. It is latched before the motor is coasted, and a MotorEnable checks the latch after each
// command: in whichever order the two threads come, the motor coasts.
#pragma once

#include <array>
#include <atomic>
#include <deque>
#include <optional>
#include <vector>

#include "base/published.hpp"
#include "daq/bench/bench.hpp"
#include "daq/guard/cell_trust.hpp"
#include "daq/guard/interlock.hpp"
#include "daq/guard/observation.hpp"
#include "daq/guard/relay.hpp"
#include "daq/guard/status_watch.hpp"

namespace kphi::daq {

class Guard final {
 public:
  /// Discards readings from before this run. The devices stream already. `blades` of the propeller; 0: unknown.
  Guard(Bench& bench, const profiles::BenchConfig& config, const results::LoadCellScale& scale,
        const std::vector<GuardLimit>& limits, int blades = 0);

  /// Takes what the devices have, judges and publishes it; coasts the motor after a trip. The guard's thread calls it
  /// periodically.
  void poll() noexcept;
  /// Takes, judges and passes on what the devices have. True: something moved. The guard's thread, or after its end the
  /// runner's.
  bool relay();

  // The recorder's thread.
  /// Also the recorder's heartbeat.
  std::size_t take(std::span<LoadCellRecord> out);
  std::size_t take(std::span<MotorReading> out) { return readings_.take(out); }
  std::size_t take(std::span<SupplyReading> out) { return supply_readings_.take(out); }
  /// Events of load cell and motor.
  [[nodiscard]] std::vector<StreamEvent> take_events() { return take_all(events_); }

  // The runner's thread.
  /// A step or another phase begins. Throws SafetyStop when the guard has stalled and takes no more marks.
  void mark(const results::PhaseMark& mark);
  /// Mean of each axis without load, N and N m. Thrust and torque are judged from then on.
  void take_zero(const std::array<double, 6>& mean) noexcept { observer_.take_zero(mean); }
  /// From then on a step without it stops the motor.
  void expect_thrust(const ThrustExpectation& expected) noexcept { expected_.publish(expected); }
  /// Until then sag, rise and current limit of the supply are excused: the speed is changing.
  void settles_until(Instant when) noexcept { observer_.settles_until(when); }
  /// Heartbeat of the run thread; to be called before every order that turns the motor. Throws SafetyStop after a trip,
  /// if the guard has stalled, or if runner or computer were away for so long that the module may have coasted the
  /// motor.
  void check(bool spinning);
  /// What the guard saw last, with its age at bench time `now`.
  [[nodiscard]] Observation observe(Instant now) const;
  /// Trips when this computer has slept. Any thread.
  void notice_sleep() noexcept;
  /// From now on nothing trips: the motor coasts for another reason, and the supply is switched off.
  void stand_down() noexcept { judging_ = false; }

  [[nodiscard]] const Latch& latch() const noexcept { return latch_; }
  /// The trip for the run file; nullopt without one.
  [[nodiscard]] std::optional<StreamEvent> event() const;

 private:
  struct Stream {
    const GuardLimit* limit = nullptr;  ///< nullptr: there is no such stream
    Instant newest{0};
    Instant stale_since = kNever;
  };
  [[nodiscard]] const GuardLimit* limit_of(Watched watched) const noexcept {
    return limits_[static_cast<std::size_t>(watched)];
  }
  /// The computer did not run the guard's thread, or one that serves it.
  struct Absence {
    Instant ended{0};
    double lasted_s = 0;
    std::uint64_t of_serial = 0;  ///< 1: it ran the guard, but not what hands on the bytes of serial ports
  };
  void trip(Trip trip) noexcept;
  void hold(Watched watched, double value);
  void take_marks();
  void judge(const LoadCellRecord& sample);
  void judge(const MotorReading& reading);
  void judge(const SupplyReading& reading);
  void judge_silence(Stream& stream, Instant now, bool spinning);
  void judge_status(const LoadCellRecord& sample);
  void judge_links();
  void notice_absence(Instant now) noexcept;
  void name_absence(Trip& trip) const;
  void judge_pause(Instant now);
  void judge_recorder(Instant now);
  void judge_gap(const LoadCellRecord& sample);
  void judge_trust(const LoadCellRecord& sample);
  [[nodiscard]] double wall_seconds_since(std::int64_t at_ns, Instant now) const;

  Bench& bench_;
  const std::optional<profiles::SupplyConfig> supply_;
  const std::vector<GuardLimit> table_;
  std::array<const GuardLimit*, kWatchedCount> limits_{};
  Observer observer_;
  StatusWatch status_watch_;
  const double device_rate_hz_;
  const std::uint32_t saturation_bits_;
  const int spin_;
  FrozenWatch frozen_watch_;
  ThrustWatch thrust_watch_;
  Published<ThrustExpectation> expected_;
  const Freshness fresh_;
  std::optional<std::uint32_t> last_sequence_;  ///< of the load cell
  Stream load_cell_stream_, motor_stream_, supply_stream_;
  Relay<LoadCellRecord> samples_;
  Relay<MotorReading> readings_;
  Relay<SupplyReading> supply_readings_;
  boost::lockfree::spsc_queue<StreamEvent> events_{1024};
  std::deque<StreamEvent> pending_events_;  ///< for which there is no room yet
  boost::lockfree::spsc_queue<results::PhaseMark, boost::lockfree::capacity<1024>> marks_;

  Latch latch_;
  Published<Readings> shown_;
  std::atomic<bool> judging_{true}, spinning_{false};
  std::atomic<int> step_{-1};
  std::atomic<std::int64_t> polled_ns_, beat_ns_, recorded_ns_;
  Published<Absence> absence_;
  std::atomic<double> pause_s_{kUnknown};  ///< between the last two heartbeats while the motor turns
};

/// The motor may turn while a MotorEnable lives. Its destructor coasts the motor at once, unless a stop of its own was
/// confirmed. After a trip the motor does not turn again.
class MotorEnable {
 public:
  /// `direction` +1 counter-clockwise, -1 clockwise.
  MotorEnable(MotorLink& motor, int direction, Guard& guard) noexcept
      : motor_(motor), direction_(direction), guard_(guard) {}
  ~MotorEnable() {
    if (!coasting_) motor_.emergency_stop();
  }
  MotorEnable(const MotorEnable&) = delete;
  MotorEnable& operator=(const MotorEnable&) = delete;

  /// Unsigned speed. Throws SafetyStop if the guard does not allow it now. A trip during this call is seen afterwards:
  /// the last order is then its order to coast, or the destructor's.
  void at(RadPerSec speed) {
    guard_.check(true);
    coasting_ = stopping_ = false;
    try {
      motor_.spin_at(RadPerSec(direction_ * speed.value()));
    } catch (const DeviceError& error) {
      throw SafetyStop(StopWords{.cause = error.what(), .motor_failure = MotorFailure::event_to_come});
    }
    guard_.latch().check();
  }
  /// Renews the lease without which the driver coasts the motor: the runner is here, and the guard has seen progress of
  /// streams and recorder. Throws as at() does.
  void renew() {
    guard_.check(true);
    motor_.renew();
  }
  /// Coasts, after a ramp if the settings ask for one; returns at once.
  void begin_stop(const iq::StopSettings& settings = {}) {
    motor_.begin_stop(settings);
    stopping_ = true;
  }
  /// How the stop ended; nullopt while it is under way.
  [[nodiscard]] std::optional<iq::StopReport> stopped() {
    auto report = stopping_ ? motor_.stop_report() : std::nullopt;
    coasting_ = report && report->safe();
    return report;
  }

 private:
  MotorLink& motor_;
  int direction_;
  Guard& guard_;
  bool stopping_ = false;
  bool coasting_ = false;  ///< the module has confirmed that it coasts
};

}  // namespace kphi::daq
