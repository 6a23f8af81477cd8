// What the bench shows at one moment, worked out in one place from every sample and reading: the guard judges it, and
// terminal, live page and replay show what was judged.
#pragma once

#include <array>
#include <atomic>
#include <functional>
#include <limits>

#include "base/clock.hpp"
#include "compensation/units.hpp"
#include "daq/guard/guard_limits.hpp"
#include "daq/guard/load_watch.hpp"
#include "daq/guard/speed_error.hpp"
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
  double thrust_n = 0;                                  ///< zero subtracted, signed; mean of 5 ms
  double torque_nm = 0;                                 ///< likewise, about the thrust axis
  double speed_rad_s = 0;                               ///< unsigned
  double drive_pwm = 0;                                 ///< share of the supply voltage that drives the motor, -1..1
  double derate = 1;                                    ///< share of its drive that the module allows itself; 1: all
  std::uint64_t fault_bits = 0;                         ///< of power_safety.fault_now
  results::Nanoseconds load_cell_ns = 0, motor_ns = 0;  ///< bench time of the newest
  results::SupplyReading supply{};                      ///< time 0: none yet, or there is no supply
};

struct Observation : Readings {
  Duration load_cell_age{}, motor_age{};  ///< bench time
  bool load_cell_is_fresh = true;         ///< no older than the stream's and this computer's delay
  bool motor_is_fresh = true;
  results::SampleAccount account{};  ///< of this run so far

  [[nodiscard]] RadPerSec speed() const noexcept { return RadPerSec(speed_rad_s); }
  [[nodiscard]] Newtons thrust() const noexcept { return Newtons(thrust_n); }
};

/// Oldest sample and reading that count as fresh, bench time.
struct Freshness {
  Duration load_cell{}, motor{};
};
/// `newest` at `now`: with its ages; stale values become kUnknown.
[[nodiscard]] Observation observe(const Readings& newest, Instant now, const Freshness& limit, const Clock& clock);

/// Turns samples and readings into guarded quantities. One thread, except take_zero.
class Observer {
 public:
  /// Called with each quantity of each sample and reading, NaN included.
  using Judge = std::function<void(Watched, double value, results::Nanoseconds at)>;

  Observer(const Mounting& mounting, const results::LoadCellScale& scale, const SpeedWatch& speed, Judge judge = {})
      : mounting_(mounting), load_(mounting, scale), speed_(speed), judge_(std::move(judge)) {}

  /// Ages count from `now` until the first sample and reading.
  void begin(Instant now) noexcept { newest_.load_cell_ns = newest_.motor_ns = now.count(); }
  void take(const results::LoadCellRecord& sample);
  void take(const results::MotorReading& reading);
  void take(const results::SupplyReading& reading);
  /// A step, a ramp or another phase begins.
  void take(const results::PhaseMark& mark) noexcept;
  /// Fx Fy Fz in N, Tx Ty Tz in N m. Thrust and torque are judged from then on. Any thread.
  void take_zero(const std::array<double, 6>& mean) noexcept;

  /// The newest readings; of each guarded quantity the value closest to its limit since the last call.
  [[nodiscard]] Readings readings() noexcept;
  [[nodiscard]] const SpeedError& speed_error() const noexcept { return speed_.error(); }

 private:
  void tell(Watched watched, double value, results::Nanoseconds at);

  const Mounting mounting_;
  LoadWatch load_;
  SpeedWatch speed_;
  Judge judge_;
  Readings newest_;
  std::array<bool, kWatchedCount> told_{};  ///< updated since readings() was called
  std::atomic<bool> has_zero_{false};
  std::atomic<double> thrust_zero_{0}, torque_zero_{0};
};

}  // namespace kphi::daq
