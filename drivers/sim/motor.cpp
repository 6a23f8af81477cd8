#include "drivers/sim/motor.hpp"

#include <algorithm>
#include <cmath>

#include "compensation/units.hpp"

namespace kphi::sim {
namespace {

constexpr int kTicksPerWarming = 70;  // heat is slow: every 10 ms
constexpr double kIntegralMax = 3.0;  // V

double sign_of(double x) noexcept { return x > 0 ? 1.0 : (x < 0 ? -1.0 : 0.0); }

}  // namespace

Motor::Motor(const MotorParameters& parameters) noexcept : parameters_(parameters) {
  state_.supply_volts = parameters.supply_volts - parameters.idle_current * parameters.source_resistance;
  state_.supply_amps = parameters.idle_current;
  state_.coil_celsius = parameters.ambient_celsius;
  state_.controller_celsius = parameters.ambient_celsius + 5;
}

void Motor::step(const MotorDrive& drive, Random& random) noexcept {
  const double emf = parameters_.torque_constant * state_.speed;
  if (drive.mode == MotorDrive::Mode::coast) {
    state_.drive_volts = emf;
    state_.motor_amps = 0;
  } else if (drive.mode == MotorDrive::Mode::brake) {
    state_.drive_volts = 0;
    state_.motor_amps = -emf / parameters_.winding_resistance;
  } else {
    drive_with(demanded_volts(drive));
  }
  if (drive.mode != MotorDrive::Mode::velocity) {
    filtered_target_ = state_.speed;
    integral_ = 0;
  }
  const double motor_watts = std::max(0.0, state_.drive_volts * state_.motor_amps);
  state_.supply_amps = motor_watts / state_.supply_volts + parameters_.idle_current;
  state_.supply_joules += state_.supply_volts * state_.supply_amps * kTick;
  state_.supply_volts = parameters_.supply_volts - state_.supply_amps * parameters_.source_resistance;
  turn(random);
  if (++ticks_to_warming_ == kTicksPerWarming) {
    ticks_to_warming_ = 0;
    warm();
  }
}

double Motor::demanded_volts(const MotorDrive& drive) noexcept {
  if (drive.mode == MotorDrive::Mode::volts) return drive.target;
  if (drive.mode == MotorDrive::Mode::pwm) return drive.target * state_.supply_volts;
  const double filter = std::min(1.0, 2 * kPi * drive.input_filter_hz * kTick);
  filtered_target_ += filter * (drive.target - filtered_target_);
  const double error = filtered_target_ - state_.speed;
  const double feed_forward = drive.ff0 * sign_of(filtered_target_) + drive.ff1 * filtered_target_ +
                              drive.ff2 * filtered_target_ * std::abs(filtered_target_);
  const double damping = drive.kd * (state_.speed - last_speed_) * kTicksPerSecond;
  const double volts = feed_forward + drive.kp * error + integral_ - damping;
  // No winding up while the current, the supply or the ban on regeneration is the limit.
  const double emf = parameters_.torque_constant * state_.speed;
  const double swing = parameters_.current_max * parameters_.resistance;
  const bool at_limit =
      std::abs(volts) > state_.supply_volts || std::abs(volts - emf) > swing || volts * (volts - emf) < 0;
  if (!at_limit) integral_ = std::clamp(integral_ + drive.ki * error * kTick, -kIntegralMax, kIntegralMax);
  return volts;
}

void Motor::drive_with(double volts) noexcept {
  const double emf = parameters_.torque_constant * state_.speed;
  const double swing = parameters_.current_max * parameters_.resistance;
  volts = std::clamp(volts, -state_.supply_volts, state_.supply_volts);
  volts = std::clamp(volts, emf - swing, emf + swing);
  double amps = (volts - emf) / parameters_.resistance;
  if (volts * amps < 0) {  // would feed the supply, which cannot sink: the regeneration limiter lets the shaft run free
    volts = emf;
    amps = 0;
  }
  const double watts_max = parameters_.supply_current_max * state_.supply_volts;
  if (volts * amps > watts_max) {
    const double magnitude = 0.5 * (std::abs(emf) + std::sqrt(emf * emf + 4 * parameters_.resistance * watts_max));
    volts = sign_of(volts) * magnitude;
    amps = (volts - emf) / parameters_.resistance;
  }
  state_.drive_volts = volts;
  state_.motor_amps = amps;
}

void Motor::turn(Random& random) noexcept {
  const double speed = state_.speed;
  const double drag = load_.drag * speed * std::abs(speed) * (1 + parameters_.turbulence * random.normal());
  const double inertia = parameters_.rotor_inertia + load_.inertia;
  const double pull = parameters_.torque_constant * state_.motor_amps - drag;
  const double friction_change = parameters_.friction_torque / inertia * kTick;
  double next = speed + pull / inertia * kTick;
  next = std::abs(next) <= friction_change ? 0.0 : next - sign_of(next) * friction_change;
  reaction_torque_ = -(inertia * (next - speed) * kTicksPerSecond + drag);
  last_speed_ = speed;
  state_.speed = next;
  state_.angle += next * kTick;
  if (state_.angle >= 2 * kPi) state_.angle -= 2 * kPi;
  if (state_.angle < 0) state_.angle += 2 * kPi;
}

void Motor::warm() noexcept {
  constexpr double kInterval = kTicksPerWarming * kTick;
  const double heat = state_.motor_amps * state_.motor_amps * parameters_.winding_resistance;
  const double convection =
      parameters_.coil_free_convection + parameters_.coil_forced_convection * std::sqrt(std::abs(state_.speed));
  const double above_ambient = state_.coil_celsius - parameters_.ambient_celsius;
  state_.coil_celsius += (heat - convection * above_ambient) / parameters_.coil_capacity * kInterval;
  // The controller follows its own 7 mohm, slowly.
  const double controller_target =
      parameters_.ambient_celsius + 5 + 1.5 * 0.007 * state_.motor_amps * state_.motor_amps;
  state_.controller_celsius += (controller_target - state_.controller_celsius) * kInterval / 60.0;
}

}  // namespace kphi::sim
