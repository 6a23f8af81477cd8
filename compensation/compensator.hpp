// From the thrust a controller wants of each rotor to the speed that gives it, although the body covers part of the
// disk (paper, section "Geometry-Aware Compensation Scheme"). Stands after mixing and saturation.
//
// Real-time: no call allocates, throws, locks or loops beyond the eight arms. Not synchronised: call from one thread,
// or copy the Compensator (trivially copyable) between threads.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <type_traits>

#include "compensation/airframe.hpp"
#include "compensation/balance.hpp"
#include "compensation/flag_set.hpp"
#include "compensation/flown_curves.hpp"
#include "compensation/occlusion.hpp"
#include "compensation/rotors.hpp"
#include "compensation/thrust_curve.hpp"
#include "compensation/units.hpp"

namespace kphi::compensation {

/// What had to be done to one rotor's command. None of them is an error; each says the number is not the plain
/// formula's.
enum class Flag : std::uint16_t {
  thrust_nan = 1,          ///< the thrust asked for was NaN and counted as 0
  thrust_negative = 2,     ///< the thrust asked for was negative and counted as 0
  speed_at_slowest = 4,    ///< raised to the slowest speed
  speed_at_fastest = 8,    ///< cut to the fastest speed: the thrust will be missed
  arm_angle_unknown = 16,  ///< the last arm angle was not finite: the occlusion before it is kept
  beyond_fit = 32,         ///< φ is larger than the largest fitted occlusion: the curve is a guess there
  at_floor = 64,           ///< k_i is at kScalingFloor or (published law) below
  at_ceiling = 128,        ///< covered, yet the curve lies above K_T there: k_i is held at 1 (clamped law)
  arm_angle_beyond = 256,  ///< the last arm angle was outside the arm's limits: the occlusion before it is kept
  arm_angle_stale = 512,   ///< the arm has moved by more than ArmLimits::stale since its angle was measured
};

/// One rotor's.
using Flags = FlagSet<Flag>;

struct SpeedCommand {
  Rotors<RadPerSec> speeds;  ///< rad/s, never NaN, within the airframe's speed limits
  Rotors<Flags> flags;
};

/// How the arms moved when their angles were measured, and how long ago that was.
struct ArmFeedback {
  Seconds age{0};             ///< not negative; NaN counts as for ever
  Rotors<RadPerSec> rates{};  ///< of each arm; missing ones count as 0
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
  rotors,       ///< as many curves as arms, 3 to 8; propeller radii for all of them or none
  arm_limits,   ///< from < to; stale, stale_hub and oldest above 0
  curve,        ///< a curve must be sound(): of build_at() alone
  body,         ///< parts of a body must not overlap
  knots,        ///< the tables of all rotors that differ have more than FlownCurves::kMostKnots knots together
};

/// One sentence, with the next move.
[[nodiscard]] const char* describe(Refusal refusal) noexcept;

/// How fast hubs moved when their places were measured, and how long ago that was.
struct HubFeedback {
  Seconds age{0};         ///< as in ArmFeedback
  Rotors<Real> speeds{};  ///< [m/s] of each hub; missing ones count as 0
};

struct BuildOutcome;

class Compensator {
 public:
  /// Of no rotors.
  Compensator() noexcept = default;
  /// The only place that refuses, with build_at(). `curves` and `airframe` in the order of the rotors.
  [[nodiscard]] static BuildOutcome build(const Rotors<ThrustCurve>& curves, const Airframe& airframe,
                                          ScalingLaw law = ScalingLaw::clamped) noexcept;

  /// What build_at() builds of, wherever it is.
  struct Parts {
    std::size_t rotors;
    const void* curves;
    CurveParts (*curve_of)(const void* curves, std::size_t rotor);
    const void* airframe;
    void (*put_airframe)(const void* airframe, Airframe& to);  ///< into one that has its defaults
    ScalingLaw law = ScalingLaw::clamped;
  };
  /// The same in place, for stacks too small for a BuildOutcome: into `place`, which has room for a Compensator. Where
  /// it is refused, there is one of no rotors, whose calls do nothing.
  [[nodiscard]] static Refusal build_at(void* place, const Parts& parts) noexcept;

  /// At servo rate. Recomputes φ and k_i of the arms that moved; an angle that is not finite, or outside the arm's
  /// limits, keeps the last φ. With `feedback` an arm that may have gone on moving by more than ArmLimits::stale is
  /// flagged. Before the first call no propeller is taken to be covered.
  void set_arms(const Rotors<Radians>& arm_angles, const ArmFeedback& feedback = {}) noexcept;

  /// At servo rate, instead of set_arms: for arms that get longer, of several joints, or measured by where their hubs
  /// are [m, body frame]. The same φ and k_i as of arms whose hubs are there, to rounding; the same flags: one that is
  /// not finite, or is further from the origin than 100 m, keeps the last φ.
  void set_hubs(const Rotors<HubPosition>& hubs, const HubFeedback& feedback = {}) noexcept;

  /// At control rate. ω = sqrt(max(T, 0) / (K_T k_i)) (equation 4), held between slowest and fastest; never NaN.
  /// Where nothing is covered this is sqrt(T / K_T) bit for bit, unless the curve changes with the speed (SpeedTrend).
  /// Missing thrusts count as 0.
  [[nodiscard]] SpeedCommand speeds_for(const Rotors<Newtons>& thrusts) const noexcept;

  /// The way in without a speed loop: the thrusts T/k_i [N] that a map of the uncovered propeller, such as the flight
  /// stack's own thrust curve or ThrottleCurve, must be asked for, held within [0, K_T ω_fastest²]. NaN counts as 0.
  [[nodiscard]] Rotors<Newtons> uncovered_thrusts(const Rotors<Newtons>& thrusts) const noexcept;

  /// Standard uncertainty [rad/s] of the speeds that speeds_for gives for these thrusts, from that of `curves`, the
  /// ones it was built of, which it does not keep, and of the arm angles [rad], which moves φ. +∞ where none can be
  /// given: a curve carries none or is missing, k_i is at its floor, the arm angle is not known. Costs up to eight
  /// times a set_arms: for logs and planning.
  [[nodiscard]] Rotors<RadPerSec> speed_uncertainties(const Rotors<ThrustCurve>& curves, const Rotors<Newtons>& thrusts,
                                                      Radians arm_angle_uncertainty = Radians(0)) const noexcept;

  /// The same of one rotor at this speed.
  [[nodiscard]] RadPerSec speed_uncertainty(std::size_t rotor, const ThrustCurve& curve, RadPerSec speed,
                                            Radians arm_angle_uncertainty = Radians(0)) const noexcept;

  /// Compensated or not. When off every k_i is 1, no curve changes with the speed, and speeds_for is the plain map bit
  /// for bit; φ is followed all the same.
  void enable(bool on) noexcept;
  /// Whether it compensates; it does from the beginning.
  [[nodiscard]] bool enabled() const noexcept { return enabled_; }

  /// The air's density now over that of the fit (`air_density_kg_m3` of its file): thrust and torque per ω² go with it.
  /// 1 from the beginning; at 1000 m in standard air 0.91. False, and the ratio before is kept, unless it is in (0.1,
  /// 10).
  bool set_air_density_ratio(Real ratio) noexcept;
  [[nodiscard]] Real air_density_ratio() const noexcept { return density_ratio_; }

  /// New coefficients in flight: this one, just built, goes on from where `before` is: its arms, whether it
  /// compensates, its air. Then copy it over `before` between two control steps. Arms that `before` does not know stay
  /// uncovered.
  void resume_from(const Compensator& before) noexcept;

  /// 3 to 8.
  [[nodiscard]] std::size_t rotors() const noexcept { return curves_.size(); }
  /// φ of each rotor [rad], in [0, 2π].
  [[nodiscard]] const Rotors<Radians>& occlusion_angles() const noexcept { return occlusion_angles_; }
  /// k_i.
  [[nodiscard]] const Rotors<Real>& scaling_factors() const noexcept { return scaling_factors_; }
  /// K_T k_i ω_fastest², in the air of now: what each rotor can give, for the saturation before this map.
  [[nodiscard]] const Rotors<Newtons>& thrust_max() const noexcept { return thrust_max_; }
  /// 1/k_i times the curve's torque share at φ: by this the torque per thrust grows; for the allocation. In
  /// [1/kMostTorque, kMostTorque/kScalingFloor].
  [[nodiscard]] const Rotors<Real>& drag_scale() const noexcept { return drag_scale_; }
  /// Of the shape that the last set_arms or set_hubs told, for Mixer::set_layout, which refuses it where no angle is
  /// known yet.
  [[nodiscard]] RotorLayout layout(const Masses& masses, const Rotors<int>& spins) const noexcept;
  /// What the last set_arms found; speeds_for repeats it in its flags.
  [[nodiscard]] const Rotors<Flags>& arm_flags() const noexcept { return arm_flags_; }

 private:
  inline void begin() noexcept;
  /// What a new angle means for φ: nothing, that it is 0 again, or that it must be computed.
  enum class Arm : std::uint8_t { at_rest, left_body, near_body };
  [[nodiscard]] inline Arm take(std::size_t i, Radians angle) noexcept;
  void apply_occlusion(std::size_t rotor) noexcept;
  [[nodiscard]] bool follows_trends() const noexcept { return enabled_ && speed_trends_; }
  inline void follow_trends(Real (&speeds)[kMostRotors]) const noexcept;
  /// Adds what was done to these thrusts and to the speeds that they want.
  inline void flag(const Real (&asked)[kMostRotors], const Real (&wanted)[kMostRotors],
                   Rotors<Flags>& flags) const noexcept;

  Rotors<Real> effective_coefficients_;  // K_T k_i with the air's density, positive: what speeds_for divides by
  Real density_ratio_ = 1;
  Real slowest_ = 0;
  Real fastest_ = 0;
  Rotors<Flags> arm_flags_;
  bool enabled_ = true;
  bool speed_trends_ = false;  // of any curve
  ScalingLaw law_ = ScalingLaw::clamped;
  Rotors<Radians> arm_angles_;
  Rotors<HubPosition> hubs_;  // those of set_hubs(), where it was the last; else none
  Rotors<Radians> occlusion_angles_;
  Rotors<Real> scaling_factors_;
  Rotors<Newtons> thrust_max_;
  Rotors<Real> drag_scale_;
  Airframe airframe_{};
  Rotors<ContactFreeWindow> contact_free_;
  FlownCurves curves_;  // last: what is near the beginning costs a microcontroller less code
};

static_assert(std::is_trivially_copyable<Compensator>::value, "a Compensator is copied between threads as bytes");

/// Of curves that can be flown but deserve a look. For the ground.
struct CurveDoubts {
  bool gains_with_occlusion = false;  ///< k does not fall: the file may be of another propeller or sign
  bool steps_at_contact = false;      ///< k_i jumps at first contact: k(0) below K_T, or not equal (published law)
};

[[nodiscard]] CurveDoubts doubts_about(const ThrustCurve& curve, ScalingLaw law) noexcept;

struct BuildOutcome {
  std::optional<Compensator> compensator;  ///< there unless refused
  Refusal refusal = Refusal::none;
};

}  // namespace kphi::compensation
