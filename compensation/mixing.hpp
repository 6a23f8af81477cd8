// From collective thrust and body torques to the thrust of each rotor of a vehicle whose rotors move, and what to give
// up when the rotors cannot give it all: yaw first, then collective thrust, roll and pitch last (the iterative mixing
// and the saturation of Faessler et al. 2016, there for a vehicle of fixed symmetric shape and one limit for all
// rotors).
//
// The allocation A, in the body frame x forward, y left, z up, rotor positions relative to the centre of gravity:
//   [thrust; roll; pitch; yaw] = A f,   columns of A: [1; y_i; −x_i; s_i κ_i(f_i)],   f_i [N], κ_i [m].
//
// Real-time: no call allocates, throws, locks, or loops without a bound. Not synchronised: call from one thread, or
// copy the Mixer (trivially copyable) between threads. No NaN comes out whatever goes in.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <type_traits>

#include "compensation/airframe.hpp"
#include "compensation/flag_set.hpp"
#include "compensation/units.hpp"

namespace kphi::compensation {

/// Where the rotors stand and which way their drag turns the body, in the order of the rotors.
struct RotorLayout {
  std::array<HubPosition, 4> hubs{};         ///< relative to the centre of gravity, x forward, y left [m]
  std::array<int, 4> spins{{1, -1, 1, -1}};  ///< s_i: +1 where the drag torque points along +z, −1 else
};

/// How much a rotor turns the body. Torque follows the speed, and the uncovered thrust f⁰ = K_T ω² tells the speed:
/// torque = f⁰ (per_newton + per_square_newton f⁰), with f⁰ = drag_scale f, drag_scale = 1/k_i.
/// Torque per thrust, κ(f) = drag_scale (per_newton + per_square_newton drag_scale f), the bracket held within half and
/// twice per_newton.
struct DragTorque {
  Metres per_newton{0.0};          ///< N m per N, positive, e.g. 0.0133
  double per_square_newton = 0.0;  ///< N m per N²; how κ changes with the load; 0: κ is constant
};

/// Collective thrust [N] along +z and torques [N m] about x (roll), y (pitch) and z (yaw).
struct Wrench {
  Newtons thrust;
  NewtonMetres roll;
  NewtonMetres pitch;
  NewtonMetres yaw;
};

/// What each rotor can give: [0, Compensator::thrust_max()], or narrower.
struct ThrustLimits {
  std::array<Newtons, 4> smallest{};
  std::array<Newtons, 4> largest{};
};

/// What had to be given up. None of them is an error.
enum class Concession : std::uint8_t {
  yaw = 1,         ///< the yaw torque is smaller than demanded (never larger, never of the other sign)
  thrust = 2,      ///< the collective thrust was shifted along A⁻¹e_thrust, which leaves all three torques alone
  roll_pitch = 4,  ///< no thrust and yaw let roll and pitch be met: rotors were cut at their limits
  demand_nan = 8,  ///< a demand was NaN and counted as 0, or a rotor's limits were NaN or crossed and counted as closed
};

using Concessions = FlagSet<Concession>;

struct MixedThrusts {
  std::array<Newtons, 4> thrusts;  ///< within the limits; goes to Compensator::speeds_for
  Wrench achieved;                 ///< A f with κ(f) at these thrusts
  Concessions concessions;
};

class Mixer {
 public:
  /// Nothing if the layout cannot be flown (see set_layout), or `drag` is not finite or its per_newton not positive.
  [[nodiscard]] static std::optional<Mixer> build(const RotorLayout& layout, DragTorque drag) noexcept;

  /// At servo rate: new positions (relative to the centre of gravity of the new shape) and Compensator::drag_scale(),
  /// each at least 1. False, and the layout before is kept, if a number is not finite, a spin is neither +1 nor −1, a
  /// drag scale is not positive, or the rotors cannot make every torque (hubs on one line, or a yaw that no difference
  /// of thrusts gives).
  bool set_layout(const RotorLayout& layout, const std::array<double, 4>& drag_scale = {{1, 1, 1, 1}}) noexcept;

  /// At control rate. f = A⁻¹ demand, iterated for κ(f) from demand.thrust/4, if that is within the limits. Else, in
  /// this order, exactly and with the smallest change:
  /// 1. yaw goes down, no further than to `assured_yaw` [N m, absolute] (a demand below it is not touched);
  /// 2. the collective thrust moves, along A⁻¹e_thrust, by as little as yaw's freedom allows;
  /// 3. where roll and pitch cannot be met at all, each rotor is cut at its limits.
  /// Where one move of each kind is enough this is the scheme of the paper: "the worst rotor at its limit". Two rotors
  /// that break their limits on opposite sides of yaw cost it collective thrust that yaw could have given; here they do
  /// not.
  [[nodiscard]] MixedThrusts mix(const Wrench& demand, const ThrustLimits& limits,
                                 NewtonMetres assured_yaw = NewtonMetres(0.0)) const noexcept;

  /// A f, the wrench of these thrusts [N], with κ(f).
  [[nodiscard]] Wrench wrench_of(const std::array<Newtons, 4>& thrusts) const noexcept;

 private:
  explicit Mixer(DragTorque drag) noexcept : drag_(drag) {}
  using Four = std::array<double, 4>;
  [[nodiscard]] Four yaw_arms(const Four& thrusts) const noexcept;
  [[nodiscard]] Four without_yaw(double thrust, double roll, double pitch) const noexcept;

  DragTorque drag_;
  Four x_{}, y_{};                // hubs [m]
  Four spread_x_{}, spread_y_{};  // hubs about their mean [m]
  double mean_x_ = 0.0, mean_y_ = 0.0;
  double xx_ = 0.0, xy_ = 0.0, yy_ = 0.0;  // inverse of the hubs' second moments [1/m²]
  Four drag_scale_{{1, 1, 1, 1}};
  Four spins_{};
  Four torque_free_{};  // thrusts that make neither thrust, roll nor pitch: areas of the opposite triangles
};

static_assert(std::is_trivially_copyable<Mixer>::value, "a Mixer is copied between threads as bytes");

}  // namespace kphi::compensation
