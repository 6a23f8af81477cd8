// From the thrust a controller wants of each rotor to the speed that gives it, although the body covers part of the
// disk (paper, section "Geometry-Aware Compensation Scheme"). Stands after mixing and saturation.
//
// Real-time: no call allocates, throws, locks or loops beyond the four arms. Not synchronised: call from one thread, or
// copy the Compensator (trivially copyable) between threads.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <type_traits>

#include "compensation/airframe.hpp"
#include "compensation/flag_set.hpp"
#include "compensation/occlusion.hpp"
#include "compensation/thrust_curve.hpp"
#include "compensation/units.hpp"

namespace kphi::compensation {

/// What had to be done to one rotor's command. None of them is an error; each says the number is not the plain
/// formula's.
enum class Flag : std::uint8_t {
  thrust_nan = 1,          ///< the thrust asked for was NaN and counted as 0
  thrust_negative = 2,     ///< the thrust asked for was negative and counted as 0
  speed_at_slowest = 4,    ///< raised to the slowest speed
  speed_at_fastest = 8,    ///< cut to the fastest speed: the thrust will be missed
  arm_angle_unknown = 16,  ///< the last arm angle was not finite: the occlusion before it is kept
  beyond_fit = 32,         ///< φ is larger than the largest fitted occlusion: the curve is a guess there
  at_floor = 64,           ///< k_i is at kScalingFloor or (published law) below
  at_ceiling = 128,        ///< covered, yet the curve lies above K_T there: k_i is held at 1 (clamped law)
};

/// One rotor's.
using Flags = FlagSet<Flag>;

struct SpeedCommand {
  std::array<RadPerSec, 4> speeds;  ///< rad/s, never NaN, within the airframe's speed limits
  std::array<Flags, 4> flags;
};

/// Why Compensator::build refused.
enum class Refusal : std::uint8_t {
  none,
  sizes,        ///< half side, arm length and propeller radius must be finite and positive
  arm_length,   ///< the arm must be longer than the propeller radius
  speeds,       ///< 0 <= slowest < fastest, both finite
  hinge_turns,  ///< each arm has a corner of its own: 0, 1, 2, 3 in any order
  hinges,       ///< hinges of a polygon body must be finite
  overlap,      ///< every curve must be fitted with the overlap measure that the airframe flies with
};

/// One sentence, with the next move.
[[nodiscard]] const char* describe(Refusal refusal) noexcept;

struct BuildOutcome;

class Compensator {
 public:
  /// The only place that refuses. `curves` and `airframe` in the order of the rotors.
  [[nodiscard]] static BuildOutcome build(const std::array<ThrustCurve, 4>& curves, const Airframe& airframe,
                                          ScalingLaw law = ScalingLaw::clamped) noexcept;

  /// At servo rate. Recomputes φ and k_i of the arms that moved; an angle that is not finite keeps the last φ.
  /// Before the first call no propeller is taken to be covered.
  void set_arms(const std::array<Radians, 4>& arm_angles) noexcept;

  /// At control rate. ω = sqrt(max(T, 0) / (K_T k_i)) (equation 4), held between slowest and fastest; never NaN.
  /// Where nothing is covered this is sqrt(T / K_T) bit for bit.
  [[nodiscard]] SpeedCommand speeds_for(const std::array<Newtons, 4>& thrusts) const noexcept;

  /// Standard uncertainty [rad/s] of the speeds that speeds_for gives for these thrusts, from the curves' own and
  /// that of the arm angles [rad], which moves φ. +∞ where none can be given: the curve carries
  /// none, k_i is at its floor, the arm angle is not known. Costs up to eight times a set_arms: for logs and planning.
  [[nodiscard]] std::array<RadPerSec, 4> speed_uncertainties(
      const std::array<Newtons, 4>& thrusts, Radians arm_angle_uncertainty = Radians(0.0)) const noexcept;

  /// Compensated or not. When off every k_i is 1 and speeds_for is the plain map bit for bit; φ is followed all the
  /// same.
  void enable(bool on) noexcept;
  /// Whether it compensates; it does from the beginning.
  [[nodiscard]] bool enabled() const noexcept { return enabled_; }

  /// φ of each rotor [rad], in [0, 2π].
  [[nodiscard]] const std::array<Radians, 4>& occlusion_angles() const noexcept { return occlusion_angles_; }
  /// k_i.
  [[nodiscard]] const std::array<double, 4>& scaling_factors() const noexcept { return scaling_factors_; }
  /// K_T k_i ω_fastest²: what each rotor can give now, for the saturation before this map.
  [[nodiscard]] const std::array<Newtons, 4>& thrust_max() const noexcept { return thrust_max_; }
  /// 1/k_i: torque follows ω², so torque per thrust grows by this; for the allocation. At most 1/kScalingFloor.
  [[nodiscard]] const std::array<double, 4>& drag_scale() const noexcept { return drag_scale_; }
  /// What the last set_arms found; speeds_for repeats it in its flags.
  [[nodiscard]] const std::array<Flags, 4>& arm_flags() const noexcept { return arm_flags_; }

 private:
  Compensator(const std::array<ThrustCurve, 4>& curves, const Airframe& airframe, ScalingLaw law) noexcept;
  /// What a new angle means for φ: nothing, that it is 0 again, or that it must be computed.
  enum class Arm : std::uint8_t { at_rest, left_body, near_body };
  [[nodiscard]] Arm take(std::size_t i, Radians angle) noexcept;
  void apply_occlusion(std::size_t rotor) noexcept;
  /// Adds what was done to these thrusts and to the speeds that they want.
  void flag(const std::array<Newtons, 4>& thrusts, const double (&wanted)[4],
            std::array<Flags, 4>& flags) const noexcept;

  std::array<double, 4> effective_coefficients_{};  // K_T k_i, positive: what speeds_for divides by
  double slowest_;
  double fastest_;
  std::array<Flags, 4> arm_flags_{};
  bool enabled_ = true;
  ScalingLaw law_;
  std::array<Radians, 4> arm_angles_;
  std::array<Radians, 4> occlusion_angles_{};
  std::array<double, 4> scaling_factors_{};
  std::array<Newtons, 4> thrust_max_{};
  std::array<double, 4> drag_scale_{};
  std::array<ThrustCurve, 4> curves_;
  Airframe airframe_;
  ContactFreeWindow contact_free_;
};

static_assert(std::is_trivially_copyable<Compensator>::value, "a Compensator is copied between threads as bytes");

/// Of curves that can be flown but deserve a look.
struct CurveDoubts {
  bool gains_with_occlusion = false;  ///< k does not fall: the file may be of another propeller or sign
  bool steps_at_contact = false;      ///< k_i jumps at first contact: k(0) below K_T, or not equal (published law)
};

struct BuildOutcome {
  std::optional<Compensator> compensator;  ///< there unless refused
  Refusal refusal = Refusal::none;
  std::array<CurveDoubts, 4> doubts{};
};

}  // namespace kphi::compensation
