#include "compensation/compensator.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace kphi::compensation {
namespace {

/// Shares that are only rounding: of a curve in its file, of a thrust that is just what a rotor can give.
constexpr Real kRounding = sizeof(Real) == sizeof(double) ? Real(1e-9) : Real(1e-6);
constexpr Real kUnknownAngle = std::numeric_limits<Real>::quiet_NaN();

bool positive(Real value) noexcept { return std::isfinite(value) && value > 0; }

bool one_corner_each(const std::array<int, 4>& turns) noexcept {
  unsigned seen = 0;
  for (const int turn : turns) {
    if (turn < 0 || turn > 3) return false;
    seen |= 1u << turn;
  }
  return seen == 0b1111u;
}

bool finite(const Hinge& hinge) noexcept {
  return std::isfinite(hinge.at.x.value()) && std::isfinite(hinge.at.y.value()) && std::isfinite(hinge.turn.value());
}

Refusal refusal_of_body(const Airframe& airframe) noexcept {
  if (!airframe.polygon) return one_corner_each(airframe.hinge_turns) ? Refusal::none : Refusal::hinge_turns;
  const auto& hinges = airframe.polygon->hinges;
  return std::all_of(hinges.begin(), hinges.end(), finite) ? Refusal::none : Refusal::hinges;
}

Refusal refusal_of(const Airframe& airframe, std::size_t curves) noexcept {
  const std::size_t rotors = rotors_of(airframe), radii = airframe.propeller_radii.size();
  if (rotors < kFewestRotors || curves != rotors || (radii != 0 && radii != rotors)) return Refusal::rotors;
  if ((!airframe.polygon && !positive(airframe.half_side.value())) || !positive(airframe.arm_length.value())) {
    return Refusal::sizes;
  }
  for (std::size_t i = 0; i < rotors; ++i) {
    if (!positive(radius_of(airframe, i).value())) return Refusal::sizes;
    if (airframe.arm_length <= radius_of(airframe, i)) return Refusal::arm_length;
  }
  const Real slowest = airframe.slowest_speed.value(), fastest = airframe.fastest_speed.value();
  if (!(slowest >= 0) || !(fastest > slowest) || !std::isfinite(fastest)) return Refusal::speeds;
  if (!(airframe.arms.from < airframe.arms.to) || !(airframe.arms.stale.value() > 0)) return Refusal::arm_limits;
  return refusal_of_body(airframe);
}

/// The window is known in closed form for the square alone.
ContactFreeWindow window_of(const Airframe& airframe, std::size_t rotor) noexcept {
  if (airframe.polygon) return {Radians(1), Radians(-1)};
  return contact_free_window(airframe.half_side, airframe.arm_length, radius_of(airframe, rotor));
}

Real thrust_of(const Rotors<Newtons>& thrusts, std::size_t rotor) noexcept {
  return rotor < thrusts.size() ? thrusts[rotor].value() : Real(0);
}

}  // namespace

CurveDoubts doubts_about(const ThrustCurve& curve, ScalingLaw law) noexcept {
  CurveDoubts doubts;
  doubts.gains_with_occlusion = curve.at(curve.largest_fitted()) >= curve.at(Radians(0));
  const Real offset = curve.at(Radians(0)) / curve.thrust_coefficient() - 1;
  doubts.steps_at_contact = offset < -kRounding || (law == ScalingLaw::published && offset > kRounding);
  return doubts;
}

const char* describe(Refusal refusal) noexcept {
  static constexpr const char* kSentences[] = {
      "nothing was refused",
      "half side, arm length and propeller radius must be positive and finite; check the vehicle's sizes [m]",
      "the arm is not longer than the propeller radius, so its own corner is always covered; "
      "check arm length and propeller radius [m]",
      "speed limits must satisfy 0 <= slowest < fastest; check the vehicle's speed limits",
      "each arm needs a corner of its own; give the hinge turns 0, 1, 2, 3 (times 90 degrees) in some order",
      "a hinge of the polygon body is not finite; check its place [m] and turn [rad]",
      "a curve was fitted with another overlap measure than the airframe flies with; fly the measure of the fit, "
      "or fit again",
      "a vehicle has 3 to 8 rotors, with a curve and a hinge for each; count them",
      "arm limits must satisfy from < to, and stale > 0; check them [rad]"};
  return refusal <= Refusal::arm_limits ? kSentences[static_cast<std::size_t>(refusal)] : "unknown refusal";
}

BuildOutcome Compensator::build(const Rotors<ThrustCurve>& curves, const Airframe& airframe, ScalingLaw law) noexcept {
  BuildOutcome outcome;
  outcome.refusal = refusal_of(airframe, curves.size());
  for (const ThrustCurve& curve : curves) {
    if (outcome.refusal == Refusal::none && curve.overlap() != airframe.overlap) outcome.refusal = Refusal::overlap;
  }
  if (outcome.refusal != Refusal::none) return outcome;
  outcome.doubts = Rotors<CurveDoubts>(curves.size());
  for (std::size_t i = 0; i < curves.size(); ++i) outcome.doubts[i] = doubts_about(curves[i], law);
  outcome.compensator = Compensator(curves, airframe, law);
  return outcome;
}

Compensator::Compensator(const Rotors<ThrustCurve>& curves, const Airframe& airframe, ScalingLaw law) noexcept
    : effective_coefficients_(curves.size()),
      slowest_(airframe.slowest_speed.value()),
      fastest_(airframe.fastest_speed.value()),
      arm_flags_(curves.size()),
      law_(law),
      arm_angles_(curves.size(), Radians(kUnknownAngle)),  // differs from every first angle
      occlusion_angles_(curves.size()),
      scaling_factors_(curves.size()),
      thrust_max_(curves.size()),
      drag_scale_(curves.size()),
      curves_(curves),
      airframe_(airframe),
      contact_free_(curves.size()) {
  for (const ThrustCurve& curve : curves) speed_trends_ = speed_trends_ || std::fabs(curve.speed_trend().per_rad_s) > 0;
  for (std::size_t i = 0; i < rotors(); ++i) {
    contact_free_[i] = window_of(airframe, i);
    apply_occlusion(i);
  }
}

Compensator::Arm Compensator::take(std::size_t i, Radians angle) noexcept {
  const bool unknown = !std::isfinite(angle.value());
  const bool beyond = !unknown && (angle < airframe_.arms.from || angle > airframe_.arms.to);
  arm_flags_[i] = arm_flags_[i].with(Flag::arm_angle_unknown, unknown).with(Flag::arm_angle_beyond, beyond);
  if (unknown || beyond || angle == arm_angles_[i]) return Arm::at_rest;
  arm_angles_[i] = angle;
  if (!contact_free_[i].contains(angle)) return Arm::near_body;
  return occlusion_angles_[i].value() > 0 ? Arm::left_body : Arm::at_rest;
}

void Compensator::set_arms(const Rotors<Radians>& arm_angles, const ArmFeedback& feedback) noexcept {
  // In passes over all arms: the long calls of one pass do not wait for each other.
  Arm arms[kMostRotors];
  bool all_at_rest = true;
  const Real age = feedback.age.value();
  for (std::size_t i = 0; i < rotors(); ++i) {
    arms[i] = take(i, i < arm_angles.size() ? arm_angles[i] : Radians(kUnknownAngle));
    all_at_rest = all_at_rest && arms[i] == Arm::at_rest;
    const Real rate = i < feedback.rates.size() ? feedback.rates[i].value() : Real(0);
    const bool fresh = std::fabs(rate) * age <= airframe_.arms.stale.value();
    arm_flags_[i] = arm_flags_[i].with(Flag::arm_angle_stale, !fresh);
  }
  if (all_at_rest) return;
  HubPosition hubs[kMostRotors];
  for (std::size_t i = 0; i < rotors(); ++i) {
    if (arms[i] == Arm::near_body) hubs[i] = hub_beside_body(airframe_, i, arm_angles_[i]);
  }
  for (std::size_t i = 0; i < rotors(); ++i) {
    if (arms[i] == Arm::near_body) occlusion_angles_[i] = occlusion_beside_body(airframe_, i, hubs[i]);
    if (arms[i] == Arm::left_body) occlusion_angles_[i] = Radians(0);
  }
  for (std::size_t i = 0; i < rotors(); ++i) {
    if (arms[i] != Arm::at_rest) apply_occlusion(i);
  }
}

void Compensator::enable(bool on) noexcept {
  enabled_ = on;
  for (std::size_t i = 0; i < rotors(); ++i) apply_occlusion(i);
}

bool Compensator::set_air_density_ratio(Real ratio) noexcept {
  if (!(ratio > Real(0.1) && ratio < 10)) return false;
  density_ratio_ = ratio;
  for (std::size_t i = 0; i < rotors(); ++i) apply_occlusion(i);
  return true;
}

void Compensator::resume_from(const Compensator& before) noexcept {
  enabled_ = before.enabled_;
  density_ratio_ = before.density_ratio_;
  set_arms(before.arm_angles_);
  for (std::size_t i = 0; i < rotors(); ++i) apply_occlusion(i);
}

void Compensator::apply_occlusion(std::size_t rotor) noexcept {
  const ThrustCurve& curve = curves_[rotor];
  const Radians phi = occlusion_angles_[rotor];
  const bool covered = enabled_ && phi.value() > 0;
  const Real scaling = covered ? curve.scaling_factor(phi, law_) : Real(1);
  // The published law reaches 0 and below: divide by next to nothing then, and the fastest speed holds.
  const Real effective =
      std::max(curve.thrust_coefficient().value() * scaling * density_ratio_, std::numeric_limits<Real>::min());
  scaling_factors_[rotor] = scaling;
  effective_coefficients_[rotor] = effective;
  const Real at_fastest = follows_trends() ? curve.speed_trend().factor_at(fastest_) : Real(1);
  thrust_max_[rotor] = Newtons(effective * (fastest_ * fastest_) * at_fastest);
  drag_scale_[rotor] = (covered ? curve.torque_share_at(phi) : Real(1)) / std::max(scaling, kScalingFloor);
  arm_flags_[rotor] =
      arm_flags_[rotor]
          .with(Flag::beyond_fit, phi > curve.largest_fitted())
          .with(Flag::at_floor, scaling <= kScalingFloor)
          .with(Flag::at_ceiling, covered && law_ == ScalingLaw::clamped && curve.at(phi) > curve.thrust_coefficient());
}

SpeedCommand Compensator::speeds_for(const Rotors<Newtons>& thrusts) const noexcept {
  SpeedCommand command{Rotors<RadPerSec>(rotors()), arm_flags_};
  // In passes over all rotors: the compiler makes vector instructions of them. Flags are for what was changed alone.
  const auto in_passes = [&](auto count) {
    Real asked[kMostRotors], possible[kMostRotors], wanted[kMostRotors], held[kMostRotors], changed = 0;
    for (std::size_t i = 0; i < count; ++i) asked[i] = thrusts[i].value();
    for (std::size_t i = thrusts.size(); i < count; ++i) asked[i] = 0;
    for (std::size_t i = 0; i < count; ++i) {
      possible[i] = asked[i] > 0 ? asked[i] : Real(0);  // NaN compares false
      wanted[i] = std::sqrt(possible[i] / effective_coefficients_[i]);
    }
    if (follows_trends()) follow_trends(wanted);
    for (std::size_t i = 0; i < count; ++i) {
      const Real raised = wanted[i] < slowest_ ? slowest_ : wanted[i];
      held[i] = raised > fastest_ ? fastest_ : raised;
    }
    for (std::size_t i = 0; i < count; ++i)
      changed += std::fabs(held[i] - wanted[i]) + std::fabs(possible[i] - asked[i]);
    for (std::size_t i = 0; i < count; ++i) command.speeds[i] = RadPerSec(held[i]);
    if (!(changed <= 0)) flag(asked, wanted, command.flags);
  };
  // A microcontroller has no vectors, and little room for code.
  constexpr bool kVectors = sizeof(Real) == sizeof(double);
  kVectors&& rotors() == 4 ? in_passes(std::integral_constant<std::size_t, 4>()) : in_passes(rotors());
  return command;
}

void Compensator::follow_trends(Real (&speeds)[kMostRotors]) const noexcept {
  for (std::size_t i = 0; i < rotors(); ++i) speeds[i] = curves_[i].speed_trend().speed_for(speeds[i]);
}

void Compensator::flag(const Real (&asked)[kMostRotors], const Real (&wanted)[kMostRotors],
                       Rotors<Flags>& flags) const noexcept {
  for (std::size_t i = 0; i < rotors(); ++i) {
    flags[i] = flags[i]
                   .with(Flag::thrust_nan, std::isnan(asked[i]))
                   .with(Flag::thrust_negative, asked[i] < 0)
                   .with(Flag::speed_at_slowest, wanted[i] < slowest_ * (1 - kRounding))
                   .with(Flag::speed_at_fastest, wanted[i] > fastest_ * (1 + kRounding));
  }
}

Rotors<Newtons> Compensator::uncovered_thrusts(const Rotors<Newtons>& thrusts) const noexcept {
  Rotors<Newtons> uncovered(rotors());
  for (std::size_t i = 0; i < rotors(); ++i) {
    const Real asked = thrust_of(thrusts, i), possible = asked > 0 ? asked : Real(0);
    const Real coefficient = curves_[i].thrust_coefficient().value() * density_ratio_;
    uncovered[i] = std::min(Newtons(possible), thrust_max_[i]) * (coefficient / effective_coefficients_[i]);
  }
  return uncovered;
}

Rotors<RadPerSec> Compensator::speed_uncertainties(const Rotors<Newtons>& thrusts,
                                                   Radians arm_angle_uncertainty) const noexcept {
  constexpr Real kUnknown = std::numeric_limits<Real>::infinity();
  const SpeedCommand command = speeds_for(thrusts);
  Rotors<RadPerSec> uncertainties(rotors(), RadPerSec(kUnknown));
  if (!std::isfinite(arm_angle_uncertainty.value())) return uncertainties;
  for (std::size_t i = 0; i < rotors(); ++i) {
    const Radians angle = arm_angles_[i], phi = enabled_ ? occlusion_angles_[i] : Radians(0);
    if (arm_flags_[i].has(Flag::arm_angle_unknown) || arm_flags_[i].has(Flag::arm_angle_beyond)) continue;
    Radians spread(0);
    if (enabled_ && std::isfinite(angle.value())) {
      const Radians above = occlusion_of_arm(airframe_, i, angle + arm_angle_uncertainty);
      const Radians below = occlusion_of_arm(airframe_, i, angle - arm_angle_uncertainty);
      spread = Radians(std::fabs((above - below).value()) / 2);
    }
    const Real relative = curves_[i].relative_uncertainty(phi, spread, phi.value() > 0 ? law_ : ScalingLaw::clamped);
    // Zero times infinity would be NaN.
    if (relative < kUnknown) uncertainties[i] = RadPerSec(relative / 2 * command.speeds[i].value());
  }
  return uncertainties;
}

}  // namespace kphi::compensation
