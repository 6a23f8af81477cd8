// A morphing multirotor seen from above: its body, three to eight arms that turn about their hinges, a propeller at the
// end of each.
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "compensation/convex_polygon.hpp"
#include "compensation/rotors.hpp"
#include "compensation/units.hpp"

namespace kphi::compensation {

using HubPosition = Position;

/// Where an arm is hinged on a body that is no square. Its hub is at `at` + arm_length (cos β, sin β), β = turn + θ, or
/// turn − θ where mirrored.
struct Hinge {
  Position at;
  Radians turn;
  bool mirrored = false;
};

/// A body in general: any convex outline, 3 to 8 hinges anywhere, one for each rotor. Where a body is of several parts,
/// or not convex, `more` has the others; parts that overlap count twice, so Compensator::build refuses them.
struct PolygonBody {
  static constexpr std::size_t kMostMore = 2;
  explicit PolygonBody(const ConvexPolygon& of, const Rotors<Hinge>& at = {}) noexcept : outline(of), hinges(at) {}
  ConvexPolygon outline;
  Rotors<Hinge> hinges;
  std::array<std::optional<ConvexPolygon>, kMostMore> more{};
};

/// What an arm can do, and how well its angle must be known.
struct ArmLimits {
  Radians from{-100 * kPi / 180};  ///< an angle below this, or above `to`, is not believed: degrees, or a broken sensor
  Radians to{190 * kPi / 180};
  Radians stale{2 * kPi / 180};   ///< how far an arm may have moved since its angle was measured
  Seconds oldest{Real(0.5)};      ///< an angle older than this is stale whatever its rate
  Metres stale_hub{Real(0.004)};  ///< as `stale`, of hubs that are told by themselves (set_hubs)
};

/// Plain data; Compensator::build says whether it makes sense. The body is the square |x|, |y| <= half_side with an arm
/// hinged at each corner, a quadrotor, unless `polygon` gives another one.
struct Airframe {
  Metres half_side;
  Metres arm_length;  ///< hinge to hub; on the square longer than the propeller radius
  Metres propeller_radius;
  RadPerSec slowest_speed;  ///< speeds are held between these two
  RadPerSec fastest_speed;
  std::array<int, 4> hinge_turns{{0, 1, 2, 3}};  ///< corner of each arm: (half_side, half_side) turned by so many 90°
  std::array<bool, 4> mirrored{};                ///< arms that fold the other way round: θ counts clockwise
  OverlapMeasure overlap = OverlapMeasure::rim_arc;  ///< how φ is measured; the curves must be fitted with the same
  std::optional<PolygonBody> polygon =
      std::nullopt;                  ///< instead of the square: half_side, hinge_turns and mirrored do not count then
  Rotors<Metres> propeller_radii{};  ///< instead of propeller_radius, where the propellers differ
  ArmLimits arms{};
};

[[nodiscard]] inline std::size_t rotors_of(const Airframe& airframe) noexcept {
  return airframe.polygon ? airframe.polygon->hinges.size() : 4;
}

[[nodiscard]] inline Metres radius_of(const Airframe& airframe, std::size_t rotor) noexcept {
  return airframe.propeller_radii.size() == 0 ? airframe.propeller_radius : airframe.propeller_radii[rotor];
}

/// Where the hub of an arm stands beside the outline that covers it: in the body frame; on a square body in the frame
/// turned (and mirrored) with the hinge, as the square looks alike from each of its corners: θ = 45° points away from
/// the body (X), 180° along the next edge (O).
[[nodiscard]] HubPosition hub_beside_body(const Airframe& airframe, std::size_t arm, Radians arm_angle) noexcept;

/// Hub of an arm in the body frame: c_i = Rot(90° turn_i) (a + L cos θ_i, a + L sin θ_i) on the square.
[[nodiscard]] HubPosition hub_in_body(const Airframe& airframe, std::size_t arm, Radians arm_angle) noexcept;

}  // namespace kphi::compensation
