// The simulated world: a rigid body with six degrees of freedom whose arms move as prescribed, rotors that follow their
// commanded speed as a first-order lag, the true loss of thrust over the body, and linear drag. World z points
// up.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>

#include "compensation/flight/arms.hpp"
#include "compensation/flight/shadow.hpp"
#include "compensation/flight/simulated_vehicle.hpp"

namespace kphi::flight {

inline constexpr double kGravity = 9.80665;  // m/s²

/// The world, which the controller never reads: the air, and in what the vehicle differs from its file. Lists of rotors
/// have at least as many as the vehicle.
struct Truth {
  ThrustCoefficient thrust_coefficient = from_newtons_per_rpm2(1.7e-8);  ///< of an uncovered rotor without error
  LossLaw law = LossLaw::quadratic;
  double gamma = 1.4;                                     ///< loss in flight over loss on the bench
  double mass = 1;                                        ///< times the nominal mass
  Rotors<double> thrust{compensation::kMostRotors, 1.0};  ///< times K_T, per rotor
  Rotors<double> arm_error{compensation::kMostRotors};    ///< added to what the servos are told [rad, or as Angles]
  Eigen::Vector2d cog_error{0, 0};                        ///< m
  double drag = 0;                                        ///< 1/s: force per mass and air speed
  Eigen::Vector3d wind{0, 0, 0};                          ///< m/s
  ArmHardware arms{};
  double estimate_delay_s = 0;  ///< age of the position and velocity that the controller is told
  double gyro_delay_s = 0;      ///< age of the body rates that it is told, at most kLongestGyroDelay
  double motor_noise = 0;       ///< deviation of a rotor's speed from what it is told, as a share of it
  Rotors<std::size_t> wiring{0, 1, 2, 3, 4, 5, 6, 7};  ///< which arm's angle the controller takes for arm i's

  [[nodiscard]] bool wired_crosswise() const noexcept {
    for (std::size_t i = 0; i < wiring.size(); ++i)
      if (wiring[i] != i) return true;
    return false;
  }
};

inline constexpr double kLongestGyroDelay = 0.05;  // s
inline constexpr double kMotorNoiseMemory = 0.02;  // s: how long a motor's deviation lasts

inline constexpr int kMostRotors = compensation::kMostRotors;
using RotorSpeeds = Eigen::Matrix<double, kMostRotors, 1>;  ///< rad/s; 0 of rotors that are not there

/// Position and velocity of the centre of gravity [m, m/s], attitude quaternion (w, x, y, z) body to world, angular
/// momentum about the centre of gravity in the body frame [N m s], rotor speeds [rad/s], 0 of rotors that are not
/// there.
struct AircraftState {
  using Vector = Eigen::Matrix<double, 13 + kMostRotors, 1>;
  Vector y = Vector::Zero();

  [[nodiscard]] auto position() { return y.segment<3>(0); }
  [[nodiscard]] auto velocity() { return y.segment<3>(3); }
  [[nodiscard]] auto momentum() { return y.segment<3>(10); }
  [[nodiscard]] auto rotors() { return y.segment<kMostRotors>(13); }
  [[nodiscard]] auto position() const { return y.segment<3>(0); }
  [[nodiscard]] auto velocity() const { return y.segment<3>(3); }
  [[nodiscard]] auto momentum() const { return y.segment<3>(10); }
  [[nodiscard]] auto rotors() const { return y.segment<kMostRotors>(13); }
  [[nodiscard]] Eigen::Quaterniond attitude() const { return {y[6], y[7], y[8], y[9]}; }
};

/// What the arms' place and speed make of the plant: masses, and the thrust per squared speed of each rotor.
struct Configuration {
  MassProperties mass;
  Rotors<double> thrust_per_square;  ///< N/(rad/s)², with the loss
  Rotors<double> torque_per_square;  ///< N m/(rad/s)², signed about body z; the blockage leaves it alone
};

class Aircraft {
 public:
  /// Keeps a reference to `shadow`.
  Aircraft(const Vehicle& vehicle, const Truth& truth, const Shadow& shadow) noexcept;

  /// With the arms where the servos are told to be (the truth's errors come on top), moving at `rates` [rad/s],
  /// none: at rest.
  [[nodiscard]] Configuration configuration(const Angles& arms, const Rotors<double>& rates) const noexcept;

  /// One step of `width` [s] with constant commanded rotor speeds; `stages` are the configurations at its beginning,
  /// middle and end. The quaternion is brought back to unit length.
  [[nodiscard]] AircraftState step(const AircraftState& state, double width,
                                   const std::array<const Configuration*, 3>& stages,
                                   const RotorSpeeds& commanded_speeds) const noexcept;

  /// dy/dt
  [[nodiscard]] AircraftState::Vector slope(const AircraftState::Vector& y, const Configuration& configuration,
                                            const RotorSpeeds& commanded_speeds) const noexcept;

 private:
  Vehicle vehicle_;
  Truth truth_;
  const Shadow* shadow_;
};

/// Angular velocity [rad/s] of the body, in the body frame.
[[nodiscard]] inline Eigen::Vector3d body_rates(const AircraftState& state, const MassProperties& mass) noexcept {
  return mass.inverse_inertia * (state.momentum() - Eigen::Vector3d(0, 0, mass.arm_momentum));
}

/// Position and velocity of the middle of the body, where the estimator sits.
struct BodyMotion {
  Eigen::Vector3d position;
  Eigen::Vector3d velocity;
};
[[nodiscard]] BodyMotion body_motion(const AircraftState& state, const MassProperties& mass) noexcept;
/// The inverse: a state at rest relative to a body at `motion`, level, with so many rotors at `speed` [rad/s].
[[nodiscard]] AircraftState level_state(const BodyMotion& motion, const MassProperties& mass, double speed) noexcept;

/// One classical fourth-order Runge-Kutta step; `slope(stage, y)` is dy/dt; `stage` 0, 1, 2 stands for the step's
/// beginning, middle and end.
template <class State, class Slope>
[[nodiscard]] State runge_kutta_step(const State& y, double width, const Slope& slope) {
  const State first = slope(0, y);
  const State second = slope(1, State(y + width / 2 * first));
  const State third = slope(1, State(y + width / 2 * second));
  const State fourth = slope(2, State(y + width * third));
  return y + width / 6 * (first + 2 * second + 2 * third + fourth);
}

}  // namespace kphi::flight
