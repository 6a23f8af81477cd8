// What the bench shows at one moment, worked out in one place from every sample and reading: the guard judges it, and
// terminal, live page and replay show what was judged.
#pragma once

#include <array>
#include <atomic>
#include <functional>
#include <limits>
#include <vector>

#include "base/clock.hpp"
#include "compensation/units.hpp"
#include "daq/guard/guard_limits.hpp"
#include "daq/guard/speed_error.hpp"
#include "daq/guard/vibration.hpp"
#include "results/records.hpp"

namespace kphi::daq {

inline constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

/// One value per guarded quantity, in the order and unit of its row; kUnknown: not known, too old, or not judged now.
struct GuardedValues {
  std::array<double, kWatchedCount> values;
  GuardedValues() noexcept { values.fill(kUnknown); }
  [[nodiscard]] double operator[](Watched watched) const noexcept { return values[static_cast<std::size_t>(watched)]; }
  [[nodiscard]] double& operator[](Watched watched) noexcept { return values[static_cast<std::size_t>(watched)]; }
};

/// The newest of everything. Members are eight bytes or multiples: the guard publishes it as a whole.
struct Readings {
  GuardedValues judged;
  double thrust_n = kUnknown;                  ///< zero subtracted, signed; mean of 5 ms; kUnknown before a zero
  double torque_nm = kUnknown;                 ///< likewise, about the thrust axis
  double speed_rad_s = 0;                      ///< unsigned
  double drive_pwm = 0;                        ///< share of the supply voltage that drives the motor, -1..1
  double derate = 1;                           ///< share of its drive that the module allows itself; 1: all
  std::uint64_t fault_bits = 0;                ///< of power_safety.fault_now
  Nanoseconds load_cell_ns = 0, motor_ns = 0;  ///< bench time of the newest
  SupplyReading supply{};                      ///< time 0: none yet, or there is no supply
  Vibration vibration{};                       ///< of the newest half second
};

/// Oldest sample and reading that count as fresh, bench time: the stream's and this computer's delay.
struct Freshness {
  Duration load_cell{}, motor{};
};

struct Observation : Readings {
  Freshness fresh{};
  Duration load_cell_age{}, motor_age{};  ///< bench time
  SampleAccount account{};                ///< of this run so far

  [[nodiscard]] bool load_cell_is_fresh() const noexcept { return load_cell_age <= fresh.load_cell; }
  [[nodiscard]] bool motor_is_fresh() const noexcept { return motor_age <= fresh.motor; }
  [[nodiscard]] RadPerSec speed() const noexcept { return RadPerSec(speed_rad_s); }
  [[nodiscard]] Newtons thrust() const noexcept { return Newtons(thrust_n); }
};

/// `newest` at `now`: with its ages; stale values become kUnknown.
[[nodiscard]] Observation observe(const Readings& newest, Instant now, const Freshness& limit, const Clock& clock);

/// How thrust is read off the six axes, and which way the motor turns.
struct Mounting {
  int axis = 2;    ///< 0..2 = Fx, Fy, Fz
  int sign = +1;   ///< of the axis when the propeller pulls
  int spin = +1;   ///< +1 counter-clockwise
  int blades = 0;  ///< 0: unknown
};

/// The load on the cell from every sample; a single outlier is rejected: each axis goes through a median of three,
/// which delays a true value by one sample. The load of an axis is that median: a peak of two samples counts, since
/// it strains the cell. Thrust and the torque about the shaft are means of the median over 5 ms, one turn at 12,000
/// RPM: the blades' beat, up to 8 % of the thrust, averages out, and noise shrinks sixfold at 7 kHz. A jump from a
/// third of a limit to 1.5 times the limit is seen within 4 ms; below 200 Hz the window is one sample.
class LoadWatch {
 public:
  static constexpr double kWindow = 0.005;  ///< s; at least one sample

  LoadWatch(const Mounting& mounting, const results::LoadCellScale& scale);

  void add(const LoadCellRecord& record) noexcept;
  /// Axis 0..5 = Fx..Tz, N or N m, unsigned, as the box shows it; 0 before the third sample.
  [[nodiscard]] double load(std::size_t axis) const noexcept;
  /// The means are known: a window has passed.
  [[nodiscard]] bool full() const noexcept { return medians_ >= sums_.size(); }
  /// N, positive when the propeller pulls; its zero included.
  [[nodiscard]] double thrust() const noexcept;
  /// N m about the thrust axis; its zero included.
  [[nodiscard]] double shaft_torque() const noexcept;

 private:
  struct Pair {
    std::int64_t thrust = 0, torque = 0;  ///< counts
  };
  Mounting mounting_;
  double counts_per_newton_, counts_per_newton_metre_;
  std::array<std::array<std::int32_t, 6>, 3> last_{};
  std::array<std::int32_t, 6> median_{};
  std::uint64_t samples_ = 0, medians_ = 0;
  std::vector<Pair> sums_;  ///< the medians of the window
  Pair total_;
};

/// Turns samples and readings into guarded quantities. One thread, except take_zero.
class Observer {
 public:
  /// Called with each quantity of each sample and reading, NaN included.
  using Judge = std::function<void(Watched, double value)>;

  Observer(const Mounting& mounting, const results::LoadCellScale& scale, const SpeedWatch& speed, Judge judge = {})
      : mounting_(mounting),
        load_(mounting, scale),
        vibration_(mounting.axis, mounting.blades, scale.sample_rate_hz, scale.counts_per_newton,
                   scale.counts_per_newton_metre),
        speed_(speed),
        judge_(std::move(judge)) {}

  /// Ages count from `now` until the first sample and reading.
  void begin(Instant now) noexcept { newest_.load_cell_ns = newest_.motor_ns = now.count(); }
  void take(const LoadCellRecord& sample);
  void take(const MotorReading& reading);
  void take(const SupplyReading& reading);
  /// A step, a ramp or another phase begins.
  void take(const results::PhaseMark& mark) noexcept;
  /// Fx Fy Fz in N, Tx Ty Tz in N m. Thrust and torque are judged from then on. Any thread.
  void take_zero(const std::array<double, 6>& mean) noexcept;
  /// Until then the speed is changing, and what a change brings is excused. Any thread.
  void settles_until(Instant when) noexcept { settled_from_ = when.count(); }
  /// Of the newest sample, mean of 5 ms, zero subtracted.
  [[nodiscard]] double thrust_n() const noexcept { return newest_.thrust_n; }
  [[nodiscard]] double torque_nm() const noexcept { return newest_.torque_nm; }
  [[nodiscard]] bool is_settled(Nanoseconds at) const noexcept { return at >= settled_from_; }

  /// The newest readings; of each guarded quantity the value closest to its limit since the last call.
  [[nodiscard]] Readings readings() noexcept;
  [[nodiscard]] const SpeedError& speed_error() const noexcept { return speed_.error(); }

 private:
  void tell(Watched watched, double value);
  void tell_motor(MotorChannel channel, double value);

  const Mounting mounting_;
  LoadWatch load_;
  VibrationMeter vibration_;
  SpeedWatch speed_;
  Judge judge_;
  Readings newest_;
  std::array<bool, kWatchedCount> told_{};  ///< updated since readings() was called
  std::atomic<bool> has_zero_{false};
  std::atomic<double> thrust_zero_{0}, torque_zero_{0};
  std::atomic<std::int64_t> settled_from_{0};
};

}  // namespace kphi::daq
