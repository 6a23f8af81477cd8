#include "drivers/sim/iq/control.hpp"

#include <algorithm>
#include <cmath>

#include "compensation/units.hpp"
#include "drivers/iq/wire/codes.hpp"

namespace kphi::sim {
namespace {

constexpr double kIntegralMax = 3.0;        // V
constexpr double kBusCapacitance = 270e-6;  // F: the capacitor that the vendor supplies
constexpr double kApproach = 0.5;           // of the way to the voltage limit, per tick
constexpr double kShortOfVoltage = 1e-3;    // V

/// A current at which regeneration lifts the bus no further than it may within one tick; the firmware's own tick is
/// much shorter, so it can wait and see. `emf` and the result are of the turning direction.
double least_amps(double emf, double volts, const IqLimits& limits) noexcept {
  const double from = std::max(limits.volts_start, volts);
  const double room = std::max(0.0, from - volts + kApproach * (limits.volts_limit - from));
  const double watts = room * kBusCapacitance * kTicksPerSecond * volts;
  const double root = emf * emf - 4 * limits.resistance * watts;
  if (root <= 0) return -1e9;  // even the most that this motor can give is not too much
  return (std::sqrt(root) - emf) / (2 * limits.resistance);
}

double softened(double amps, const IqLimits& limits) noexcept {
  const double width = limits.amps_soft_end - limits.amps_soft_start;
  const double over = std::abs(amps) - limits.amps_soft_start;
  double magnitude = std::abs(amps);
  if (over > 0 && width > 0) magnitude = limits.amps_soft_start + width * (1 - std::exp(-over / width));
  return sign_of(amps) * std::min(magnitude, limits.amps_max);
}

// Of the song.
constexpr double kSongVolts = 0.12;
constexpr Duration kHalfWave = std::chrono::microseconds(570);  // a note of 877 Hz
constexpr Duration kSong = std::chrono::milliseconds(600);      // three beeps
constexpr Duration kBeep = std::chrono::milliseconds(100);

double note(Duration since_begin) noexcept {
  if (since_begin / kBeep % 2 != 0) return 0;
  return since_begin / kHalfWave % 2 == 0 ? kSongVolts : -kSongVolts;
}

// Of power_safety.
constexpr std::uint8_t kPowerSafety = 84;
constexpr double kReferenceVolts = 1.2;
constexpr double kDetectorVolts = 3.6;  // of the input, when the module's own 3.3 V fall to 2.8 V

constexpr std::uint8_t bit(iq::FaultBit fault) noexcept {
  return static_cast<std::uint8_t>(1u << static_cast<unsigned>(fault));
}

}  // namespace

double derate_between(double start, double end, double x) noexcept {
  if (!(end > start)) return x < end ? 1 : 0;
  return std::clamp((end - x) / (end - start), 0.0, 1.0);
}

PowerStage IqControl::step(const MotorDrive& drive, const IqLimits& limits, const IqSensed& sensed) noexcept {
  derate_ = limits.thermal * derate_between(limits.redline_start, limits.redline_end, std::abs(sensed.speed));
  if (drive.mode == MotorDrive::Mode::coast && drive.addition != 0) {  // the song
    volts_ = limits.emf_constant * sensed.speed + drive.addition;
    return {PowerStage::Mode::drive, std::clamp(volts_ / std::max(sensed.supply_volts, 0.1), -1.0, 1.0)};
  }
  if (drive.mode == MotorDrive::Mode::coast || drive.mode == MotorDrive::Mode::brake) {
    filtered_target_ = sensed.speed;
    last_speed_ = sensed.speed;
    integral_ = 0;
    const bool coasts = drive.mode == MotorDrive::Mode::coast;
    volts_ = coasts ? limits.emf_constant * sensed.speed : 0;
    return {coasts ? PowerStage::Mode::coast : PowerStage::Mode::brake, 0};
  }
  const double wanted = demanded(drive, sensed);
  double volts = limited(wanted * derate_ + drive.addition, limits, sensed);
  if (limits.slew > 0) volts = std::clamp(volts, volts_ - limits.slew * kTick, volts_ + limits.slew * kTick);
  integrate(drive, wanted, volts);
  volts_ = volts;
  const double supply = std::max(sensed.supply_volts, 0.1);
  return {PowerStage::Mode::drive, std::clamp(volts / supply, -1.0, 1.0)};
}

double IqControl::demanded(const MotorDrive& drive, const IqSensed& sensed) noexcept {
  if (drive.mode != MotorDrive::Mode::velocity) {
    filtered_target_ = last_speed_ = sensed.speed;
    integral_ = error_ = 0;
    return drive.mode == MotorDrive::Mode::pwm ? drive.target * sensed.supply_volts : drive.target;
  }
  const double filter = std::min(1.0, 2 * kPi * drive.input_filter_hz * kTick);
  filtered_target_ += filter * (drive.target - filtered_target_);
  error_ = filtered_target_ - sensed.speed;
  const double feed_forward = drive.ff0 * sign_of(filtered_target_) + drive.ff1 * filtered_target_ +
                              drive.ff2 * filtered_target_ * std::abs(filtered_target_);
  const double damping = drive.kd * (sensed.speed - last_speed_) * kTicksPerSecond;
  last_speed_ = sensed.speed;
  return feed_forward + drive.kp * error_ + integral_ - damping;
}

double IqControl::limited(double volts, const IqLimits& limits, const IqSensed& sensed) const noexcept {
  const double emf = limits.emf_constant * sensed.speed;
  volts = std::clamp(volts, -sensed.supply_volts, sensed.supply_volts);
  if (limits.resistance <= 0) return volts;
  double amps = softened((volts - emf) / limits.resistance, limits);
  const double turn = sign_of(emf != 0 ? emf : volts);
  volts = emf + limits.resistance * amps;
  if (turn * amps < 0 && turn * volts > 0)
    amps = turn * std::max(turn * amps, least_amps(std::abs(emf), sensed.supply_volts, limits));
  volts = emf + limits.resistance * amps;
  // Over its limit the module burns what the supply has too much of: with a limit below the supply it runs away.
  const double excess = sensed.supply_volts - limits.volts_limit;
  if (excess > 0 && turn * (volts - emf) < excess) volts = emf + turn * excess;
  return std::clamp(volts, -sensed.supply_volts, sensed.supply_volts);
}

/// No winding up while anything limits.
void IqControl::integrate(const MotorDrive& drive, double demanded, double given) noexcept {
  if (drive.mode != MotorDrive::Mode::velocity) return;
  const double short_by = demanded - given;
  if (std::abs(short_by) > kShortOfVoltage && short_by * error_ > 0) return;
  integral_ = std::clamp(integral_ + drive.ki * error_ * kTick, -kIntegralMax, kIntegralMax);
}

// --- how a motion ends

void IqEnding::begin(const Plan& plan, Instant now) noexcept {
  plan_ = plan;
  since_ = now;
  slow_since_ = kNever;
  phase_ = plan.behavior == 0 ? Phase::singing : Phase::slowing;
}

void IqEnding::step(double speed, Instant now, MotorDrive& drive) noexcept {
  drive.addition = 0;
  if (phase_ == Phase::slowing) slow_down(speed, now);
  if (phase_ == Phase::slowing) {
    drive.mode = MotorDrive::Mode::volts;
    drive.target = 0;
    return;
  }
  drive.mode = MotorDrive::Mode::coast;
  drive.target = 0;
  if (plan_.song == 2 || (plan_.song == 1 && now - since_ < kSong)) {
    drive.addition = note(now - since_);
    return;
  }
  phase_ = Phase::none;
  if (plan_.behavior == 2) drive.mode = MotorDrive::Mode::brake;
}

void IqEnding::slow_down(double speed, Instant now) noexcept {
  if (std::abs(speed) >= plan_.stopped_speed) {
    slow_since_ = kNever;
    return;
  }
  if (slow_since_ == kNever) slow_since_ = now;
  if (now - slow_since_ < from_seconds(plan_.stopped_time)) return;
  phase_ = Phase::singing;
  since_ = now;
}

// --- power_safety

bool IqSafety::check(const IqMemory& memory, const IqReadings& readings) noexcept {
  struct Watched {
    iq::FaultBit fault;
    double value;
    std::uint8_t low;  ///< row of the lower limit; the upper follows
  };
  const Watched watched[] = {
      {iq::FaultBit::input_voltage, readings.volts, 3},
      {iq::FaultBit::reference_voltage, kReferenceVolts, 5},
      {iq::FaultBit::supply_current, readings.amps, 7},
      {iq::FaultBit::motor_current, readings.motor_amps, 9},
      {iq::FaultBit::controller_temperature, readings.controller_celsius, 11},
      {iq::FaultBit::coil_temperature, readings.coil_celsius, 13},
  };
  now_ = readings.volts < kDetectorVolts ? bit(iq::FaultBit::under_voltage) : 0;
  for (const Watched& w : watched) {
    const double low = memory.value(kPowerSafety, w.low);
    const double high = memory.value(kPowerSafety, static_cast<std::uint8_t>(w.low + 1));
    if (w.value < low || w.value > high) now_ |= bit(w.fault);
  }
  ever_ |= now_;
  const bool latching = memory.value(kPowerSafety, 2) != 0;
  const bool was = safe_;
  safe_ = latching ? ever_ != 0 : now_ != 0;
  return safe_ && !was;
}

}  // namespace kphi::sim
