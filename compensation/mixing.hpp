// From collective thrust and body torques to the thrust of each rotor of a vehicle whose rotors move, and what to give
// up when the rotors cannot give it all: yaw first, then collective thrust, roll and pitch last: these keep the vehicle
// up (the iterative mixing and the order of Faessler et al. 2016, there for a quadrotor of fixed symmetric shape and
// one limit for all rotors).
//
// The allocation A, in the body frame x forward, y left, z up, rotor positions relative to the centre of gravity:
//   [thrust; roll; pitch; yaw] = A f,   columns of A: [1; y_i; −x_i; s_i κ_i(f_i)],   f_i [N], κ_i [m].
//
// Real-time: no call allocates, throws, locks, or loops without a bound. Not synchronised: call from one thread, or
// copy the Mixer (trivially copyable) between threads. No NaN comes out whatever goes in.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <type_traits>

#include "compensation/balance.hpp"
#include "compensation/flag_set.hpp"
#include "compensation/priorities.hpp"
#include "compensation/rotors.hpp"
#include "compensation/units.hpp"

namespace kphi::compensation {

/// How much a rotor turns the body. Torque follows the speed, and the uncovered thrust f⁰ = K_T ω² tells the speed:
/// torque = f⁰ (per_newton + per_square_newton f⁰), with f⁰ = drag_scale f, drag_scale = 1/k_i.
/// Torque per thrust, κ(f) = drag_scale (per_newton + per_square_newton drag_scale f), the bracket held within half and
/// twice per_newton.
struct DragTorque {
  Metres per_newton{0};        ///< N m per N, above 1e-9, e.g. 0.0133
  Real per_square_newton = 0;  ///< N m per N²; how κ changes with the load; 0: κ is constant
};

/// Collective thrust [N] along +z and torques [N m] about x (roll), y (pitch) and z (yaw).
struct Wrench {
  Newtons thrust;
  NewtonMetres roll;
  NewtonMetres pitch;
  NewtonMetres yaw;
};

/// What each rotor can give: [0, Compensator::thrust_max()], or narrower. Missing ones count as 0.
struct ThrustLimits {
  Rotors<Newtons> smallest;
  Rotors<Newtons> largest;
};

/// What had to be given up. None of them is an error.
enum class Concession : std::uint8_t {
  yaw = 1,         ///< the yaw torque is smaller than demanded: larger, or of the other sign, only where roll and pitch
                   ///< leave no other
  thrust = 2,      ///< the collective thrust is another one than demanded
  roll_pitch = 4,  ///< no thrust and yaw let roll and pitch be met: they miss their demand by as little as can be
  demand_nan = 8,  ///< a demand was NaN and counted as 0, or a rotor's limits were NaN or crossed and counted as closed
  unfinished = 16,  ///< the search within the limits ended at its bound of steps: it may have given up too much
};

using Concessions = FlagSet<Concession>;

struct MixedThrusts {
  Rotors<Newtons> thrusts;  ///< within the limits; goes to Compensator::speeds_for
  Wrench achieved;          ///< A f with κ(f) at these thrusts
  Concessions concessions;
  int steps = 0;  ///< of the search within the limits: 0 where the demand could be met
};

class Mixer {
 public:
  /// Of no rotors: rebuild() makes one of it.
  Mixer() noexcept = default;
  /// In place, for small stacks. False, and nothing is changed, where build() gives none.
  bool rebuild(const RotorLayout& layout, DragTorque drag) noexcept;
  /// Nothing if the layout cannot be flown (see set_layout), or `drag` is not finite or its per_newton not above 1e-9.
  [[nodiscard]] static std::optional<Mixer> build(const RotorLayout& layout, DragTorque drag) noexcept;

  /// At servo rate: new positions (relative to the centre of gravity of the new shape) and Compensator::drag_scale(),
  /// each above 1e-6; none: 1 for every rotor. False, and the layout before is kept, if it has not 3 to 8 hubs and as
  /// many spins, a number is not finite, a spin is neither +1 nor −1, a drag scale is not positive, or the rotors
  /// cannot make every torque (hubs on one line, or a yaw that no difference of thrusts gives). Three rotors never make
  /// a yaw of their own: there it comes as it comes, and a tail servo must answer for it.
  bool set_layout(const RotorLayout& layout, const Rotors<Real>& drag_scale = {}) noexcept;

  /// At control rate. The smallest thrusts f (least squares) with A f = demand, iterated for κ(f), if they are within
  /// the limits. Else these, in this order; none may make one before it worse:
  /// 1. roll and pitch miss their demand by as little as can be (least squares);
  /// 2. yaw stays between 0 and its demand, and keeps `assured_yaw` [N m, absolute] of it, or comes as near to that as
  ///    it can;
  /// 3. the collective thrust comes as near as it can;
  /// 4. and so does yaw.
  /// Of the thrusts that do this, nearly the smallest. Where κ depends on the thrust, 2 to 4 come as near as two
  /// searches along its tangents bring them.
  [[nodiscard]] MixedThrusts mix(const Wrench& demand, const ThrustLimits& limits,
                                 NewtonMetres assured_yaw = NewtonMetres(0)) const noexcept;

  /// The same on arrays, with a limit [N] for each rotor.
  [[nodiscard]] MixedThrusts mix(const Wrench& demand, const Real* smallest, const Real* largest,
                                 NewtonMetres assured_yaw) const noexcept;

  /// A f, the wrench of these thrusts [N], with κ(f).
  [[nodiscard]] Wrench wrench_of(const Rotors<Newtons>& thrusts) const noexcept;
  /// 3 to 8.
  [[nodiscard]] std::size_t rotors() const noexcept { return x_.size(); }
  /// Whether differences of thrusts make yaw: not with three rotors.
  [[nodiscard]] bool yaws() const noexcept { return yaws_; }

 private:
  Mixer(std::size_t count, DragTorque drag) noexcept
      : drag_(drag),
        x_(count),
        y_(count),
        per_thrust_(count),
        per_roll_(count),
        per_pitch_(count),
        arms_(count),
        free_(count),
        drag_scale_(count),
        spins_(count),
        yaws_(count > kFewestRotors) {}
  bool set(const RotorLayout& layout, const Rotors<Real>& drag_scale, DragTorque drag) noexcept;
  /// Of these thrusts, and by how much it changes with each [m].
  [[nodiscard]] Real yaw_of(const Row& thrusts, Row& slopes) const noexcept;
  [[nodiscard]] Wrench wrench_of(const Row& thrusts) const noexcept;
  [[nodiscard]] bool bends() const noexcept { return drag_.per_square_newton > 0 || drag_.per_square_newton < 0; }
  /// The part of `arms` that makes neither thrust, roll nor pitch: the least thrusts for yaw are along it.
  [[nodiscard]] Row torque_free(const Row& arms) const noexcept;
  /// Adds to `thrusts` what they lack of yaw; not to the last digit where that is beyond the limits.
  void add_yaw(Row& thrusts, Real yaw, const WithinLimits::Limits& limits) const noexcept;

  // `asked`: thrust, roll, pitch, yaw [N, N m].
  void search_yaw_and_thrust(WithinLimits& search, const Real (&asked)[4], Real assured, Row& thrusts) const noexcept;
  /// Brings `thrusts` within the limits by the order of mix(). Tells `mixed` of the search; narrows the limits.
  void give_up(Row& thrusts, const Real (&asked)[4], WithinLimits::Limits& held, Real assured,
               MixedThrusts& mixed) const noexcept;

  DragTorque drag_{};
  Row x_, y_;                              // hubs [m]
  Row per_thrust_, per_roll_, per_pitch_;  // the least thrusts for one newton or newton metre of each
  Row arms_, free_;                        // by what yaw changes with each thrust at rest, and its torque_free()
  Row drag_scale_;
  Row spins_;
  Real reach_ = 0, arm_ = 0;  // the largest of x_ and y_, of arms_ [m]
  bool yaws_ = true;
};

/// How far a shape is from rotors that do the same as others: one over the smallest determinant, which is not rounding,
/// of two, three or four columns of A, each row of it in shares of its largest. Some 2 in X. Below 1e5 the wrench of a
/// Mixer in float is within 1e-4 of the demand of that in double. For the ground: it looks at up to 210 of them.
[[nodiscard]] Real condition_of(const RotorLayout& layout, const Rotors<Real>& drag_scale = {}) noexcept;

static_assert(std::is_trivially_copyable<Mixer>::value, "a Mixer is copied between threads as bytes");

}  // namespace kphi::compensation
