// The controller on board: position and attitude at 100 Hz, body rates, mixing and the compensation at 500 Hz. It knows
// the nominal vehicle, the arm angles that it commands and the bench's line, never the world's truth.
#pragma once

#include <array>
#include <optional>

#include "compensation/compensator.hpp"
#include "compensation/flight/control.hpp"
#include "compensation/flight/vehicle.hpp"
#include "compensation/mixing.hpp"

namespace kphi::flight {

inline constexpr double kStep = 0.002;   ///< s: body rates, mixing, integration
inline constexpr int kStepsPerTick = 5;  ///< position and attitude: every 10 ms

struct PilotSettings {
  Gains gains;
  double assured_yaw = 0;                      ///< N m that the saturation leaves to yaw
  std::array<int, 4> arm_order{{0, 1, 2, 3}};  ///< which arm's angle the compensation takes for rotor i's; else a fault
};

class Pilot {
 public:
  /// Nothing if the compensator refuses the vehicle, or the mixer its rotors in X or in O.
  [[nodiscard]] static std::optional<Pilot> build(const Vehicle& vehicle, const compensation::ThrustCurve& curve,
                                                  const PilotSettings& settings);

  void compensate(bool on) noexcept;
  /// Where the servos are told to be.
  void set_arms(const Angles& arms) noexcept;
  /// At 100 Hz.
  void look(const Reference& reference, const BodyMotion& estimate, const Eigen::Quaterniond& attitude) noexcept;
  /// At 500 Hz: rotor speeds [rad/s].
  [[nodiscard]] Eigen::Vector4d act(const Eigen::Vector3d& body_rates) noexcept;

  [[nodiscard]] const compensation::Compensator& compensator() const noexcept { return compensator_; }
  [[nodiscard]] const std::array<Newtons, 4>& thrusts() const noexcept { return thrusts_; }
  /// Steps in which the mixer gave something up.
  [[nodiscard]] int concessions() const noexcept { return concessions_; }

 private:
  Pilot(const Vehicle& vehicle, const PilotSettings& settings, const compensation::Compensator& compensator,
        const compensation::Mixer& mixer) noexcept;
  void allocate() noexcept;

  Vehicle vehicle_;
  PilotSettings settings_;
  compensation::Compensator compensator_;
  compensation::Mixer mixer_;
  RateControl rate_control_;
  MassProperties mass_;
  Angles arms_;
  double collective_ = kGravity;
  Eigen::Vector3d wanted_rates_{0, 0, 0};
  Eigen::Vector3d feedback_rates_{0, 0, 0};
  std::array<Newtons, 4> thrusts_{};
  int concessions_ = 0;
};

}  // namespace kphi::flight
