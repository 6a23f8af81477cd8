// The drone as a mechanism: a plate with 4 to 8 arms that move in its plane, each with a point mass at its hub.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "compensation/airframe.hpp"

namespace kphi::flight {

using compensation::Rotors;

/// The angle of each arm. Of a hub with a way of its own: where on the way it is, 0 at its beginning, 1 at its end.
using Angles = Rotors<Radians>;

/// Where a hub goes that is on no hinged arm: straight from one place to the other [m, body frame].
struct Way {
  compensation::HubPosition from, to;
};

/// What the vehicle is made of: the section `dynamics` of its file.
struct Build {
  double mass_kg = 0;        ///< all of it
  double hub_mass_kg = 0;    ///< motor, propeller and servo of one arm, a point at the hub
  double body_height_m = 0;  ///< the rest is a plate of the body's parts, this high, unless `body_inertia` is given
  std::optional<Eigen::Vector3d> body_inertia;  ///< kg m² of the body without hubs, about the middle of its outline
  double yaw_arm_m = 0;                         ///< κ: rotor torque per thrust without occlusion
  double rotor_lag_s = 0;                       ///< time constant of a rotor's speed
  double air_drag_per_s = 0;                    ///< force per mass and air speed
  double morph_s = 0;                           ///< from one shape to the next
  Rotors<int> spin;                             ///< sign of the torque on the body, about z (up): 1 or -1
};

enum class Shape { x, o };

struct Vehicle {
  compensation::Airframe airframe;
  Angles x;  ///< arm angles of the shape X
  Angles o;  ///< arm angles of the shape O
  Build build;
  Rotors<Way> ways{};  ///< of hubs without hinged arms, from X to O; none: all arms are those of the airframe

  [[nodiscard]] std::size_t rotors() const noexcept { return x.size(); }
  [[nodiscard]] const Angles& angles(Shape shape) const noexcept { return shape == Shape::x ? x : o; }
};

/// Calls `look` with each part of the body seen from above, square or not.
template <class Look>
void for_each_part(const compensation::Airframe& airframe, const Look& look) {
  look(airframe.polygon ? airframe.polygon->outline : compensation::ConvexPolygon::square(airframe.half_side));
  if (!airframe.polygon) return;
  for (const auto& part : airframe.polygon->more) {
    if (part) look(*part);
  }
}

/// In the body frame.
[[nodiscard]] compensation::HubPosition hub_of(const Vehicle& vehicle, std::size_t rotor, Radians at) noexcept;

/// The hub masses' motion is prescribed, so all that the arms do to the rigid-body equations is in these numbers.
struct MassProperties {
  double mass_kg = 0;
  Rotors<Eigen::Vector2d> hubs;    ///< m, in the body frame
  Eigen::Vector2d cog{0, 0};       ///< m, in the body frame
  Eigen::Vector2d cog_rate{0, 0};  ///< m/s, as the arms move
  Eigen::Matrix3d inertia;         ///< kg m², about the centre of gravity
  Eigen::Matrix3d inverse_inertia;
  double arm_momentum = 0;  ///< N m s about z: angular momentum of the arms' motion relative to the body
};

/// `rates` are the arms' angular speeds [rad/s], none: at rest; `plate_offset` [m] moves the body away from the middle
/// of its outline.
[[nodiscard]] MassProperties mass_properties(const Vehicle& vehicle, const Angles& arms,
                                             const Rotors<double>& rates = {},
                                             const Eigen::Vector2d& plate_offset = Eigen::Vector2d::Zero()) noexcept;

/// How the servos carry the arms from one shape to the next: a minimum-jerk course, all arms at once.
class ArmMotion {
 public:
  /// At rest. From one shape to the next it takes `seconds`, above 0.
  ArmMotion(const Angles& at, double seconds) noexcept : from_(at), to_(at), seconds_(seconds), began_(-seconds) {}

  /// From where the arms are at `now` [s], at rest, to `to`.
  void begin(const Angles& to, double now) noexcept {
    from_ = angles(now);
    to_ = to;
    began_ = now;
  }
  [[nodiscard]] bool moving(double now) const noexcept { return now < began_ + seconds_; }
  [[nodiscard]] Angles angles(double now) const noexcept {
    if (!moving(now)) return to_;
    const double s = (now - began_) / seconds_;
    const double share = s * s * s * (10 + s * (6 * s - 15));
    Angles at = from_;
    for (std::size_t i = 0; i < at.size(); ++i) at[i] = at[i] + share * (to_[i] - from_[i]);
    return at;
  }
  /// rad/s
  [[nodiscard]] Rotors<double> rates(double now) const noexcept {
    Rotors<double> found(to_.size());
    if (!moving(now)) return found;
    const double s = (now - began_) / seconds_;
    const double slope = 30 * s * s * (1 - s) * (1 - s) / seconds_;
    for (std::size_t i = 0; i < found.size(); ++i) found[i] = slope * (to_[i] - from_[i]).value();
    return found;
  }

 private:
  Angles from_;
  Angles to_;
  double seconds_;
  double began_;
};

}  // namespace kphi::flight
