// Position, attitude and body-rate control as in the paper's lab (Faessler et al.), without any integral: pure laws.
// And the controller on board that flies by them: position and attitude at 100 Hz, body rates, mixing and the
// compensation at 500 Hz. It knows the nominal vehicle, the arm angles that it commands and the bench's line, never the
// world's truth.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <optional>

#include "compensation/compensator.hpp"
#include "compensation/flight/aircraft.hpp"
#include "compensation/flight/experiment.hpp"
#include "compensation/mixing.hpp"

namespace kphi::flight {

/// The section `control` of the vehicle file; x, y, z or roll, pitch, yaw.
struct Gains {
  Eigen::Vector3d position{0, 0, 0};            ///< 1/s²
  Eigen::Vector3d velocity{0, 0, 0};            ///< 1/s
  Eigen::Vector3d attitude{0, 0, 0};            ///< 1/s
  Eigen::Vector3d rate{0, 0, 0};                ///< 1/s: steady torque per rate error and inertia
  double torque_weight = 0;                     ///< of the body-rate LQR, with that of the input 1
  Eigen::Vector3d position_error_max{0, 0, 0};  ///< m
  Eigen::Vector3d velocity_error_max{0, 0, 0};  ///< m/s
  double smallest_collective = 0;               ///< m/s²
};

struct AccelerationDemand {
  Eigen::Vector3d acceleration;  ///< of the rotors, gravity already carried [m/s²]
  double collective = 0;         ///< its part along the actual body z [m/s²]
};

/// K_P (p_ref − p) + K_D (v_ref − v) + a_ref + g, each error held within its limit; the part of it that Table II calls
/// ë is pd_part.
[[nodiscard]] Eigen::Vector3d pd_part(const Gains& gains, const Reference& reference,
                                      const BodyMotion& estimate) noexcept;
[[nodiscard]] AccelerationDemand position_control(const Gains& gains, const Reference& reference,
                                                  const BodyMotion& estimate,
                                                  const Eigen::Quaterniond& attitude) noexcept;

/// Body z along the demanded acceleration, yaw as told. The demand must not be zero nor along world y turned by yaw.
[[nodiscard]] Eigen::Quaterniond attitude_along(const Eigen::Vector3d& acceleration, double yaw) noexcept;

/// ±2 K (q_e.x, q_e.y, q_e.z) of q_e = q⁻¹ q_des, the short way round [rad/s].
[[nodiscard]] Eigen::Vector3d attitude_control(const Gains& gains, const Eigen::Quaterniond& attitude,
                                               const Eigen::Quaterniond& wanted) noexcept;

/// Roll and pitch rate that the reference's jerk needs, in the frame `attitude` [rad/s].
[[nodiscard]] Eigen::Vector3d rates_along(const Eigen::Vector3d& jerk, double collective,
                                          const Eigen::Quaterniond& attitude) noexcept;

/// The LQR of each axis for J ω̇ = τ, α τ̇ = τ_des − τ with cost p ω² + d τ² + τ_des². Its Riccati equation has a closed
/// form: with the weight p that gives a steady stiffness of J·rate, K = (J·rate·s, s − 1), where
/// s = α·rate + sqrt((α·rate)² + 1 + d).
class RateControl {
 public:
  RateControl(const Gains& gains, double rotor_lag) noexcept;
  /// 1 + the gain on torque, per axis.
  [[nodiscard]] const Eigen::Vector3d& stiffening() const noexcept { return stiffening_; }
  /// τ_des [N m]; the reference torque ω × Jω of the wanted rates is included.
  [[nodiscard]] Eigen::Vector3d torque(const Eigen::Vector3d& wanted_rates, const Eigen::Vector3d& feedback_rates,
                                       const Eigen::Vector3d& rates, const Eigen::Matrix3d& inertia) const noexcept;
  /// Once per step of `width` [s]: the rotors follow `torque` [N m] with their lag.
  void applied(const Eigen::Vector3d& torque, double width) noexcept;

 private:
  Eigen::Vector3d rate_;
  Eigen::Vector3d stiffening_;
  double lag_;
  Eigen::Vector3d rotor_torque_{0, 0, 0};
};

inline constexpr double kStep = 0.002;   ///< s: body rates, mixing, integration
inline constexpr int kStepsPerTick = 5;  ///< position and attitude: every 10 ms

struct PilotSettings {
  Gains gains;
  double assured_yaw = 0;           ///< N m that the saturation leaves to yaw
  Rotors<std::size_t> arm_order{};  ///< which arm's angle the compensation takes for rotor i's, a fault; none: its own
};

class Pilot {
 public:
  /// Nothing if the compensator refuses the vehicle, or the mixer its rotors in X or in O.
  [[nodiscard]] static std::optional<Pilot> build(const Vehicle& vehicle,
                                                  const compensation::Rotors<compensation::ThrustCurve>& curves,
                                                  const PilotSettings& settings);

  void compensate(bool on) noexcept;
  /// Where the servos are told to be.
  void set_arms(const Angles& arms) noexcept;
  /// At 100 Hz.
  void look(const Reference& reference, const BodyMotion& estimate, const Eigen::Quaterniond& attitude) noexcept;
  /// At 500 Hz: rotor speeds [rad/s].
  [[nodiscard]] RotorSpeeds act(const Eigen::Vector3d& body_rates) noexcept;

  [[nodiscard]] const compensation::Compensator& compensator() const noexcept { return compensator_; }
  [[nodiscard]] const compensation::Rotors<Newtons>& thrusts() const noexcept { return thrusts_; }
  /// Steps in which the mixer gave something up.
  [[nodiscard]] int concessions() const noexcept { return concessions_; }

 private:
  Pilot(const Vehicle& vehicle, const PilotSettings& settings, const compensation::Compensator& compensator,
        const compensation::Mixer& mixer) noexcept;
  void tell(const Angles& arms) noexcept;
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
  compensation::Rotors<Newtons> thrusts_;
  int concessions_ = 0;
};

}  // namespace kphi::flight
