#include "compensation/compensator.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <new>

#include "compensation/strict_math.hpp"

namespace kphi::compensation {
namespace {

/// Shares that are only rounding: of a curve in its file, of a thrust that is just what a rotor can give.
constexpr Real kRounding = sizeof(Real) == sizeof(double) ? Real(1e-9) : Real(1e-6);
constexpr Real kUnknown = std::numeric_limits<Real>::infinity();
constexpr Real kUnknownAngle = std::numeric_limits<Real>::quiet_NaN();

bool one_corner_each(const std::array<int, 4>& turns) noexcept {
  unsigned seen = 0;
  for (const int turn : turns) {
    if (turn < 0 || turn > 3) return false;
    seen |= 1u << turn;
  }
  return seen == 0b1111u;
}

Refusal refusal_of_body(const Airframe& airframe) noexcept {
  if (!airframe.polygon) return one_corner_each(airframe.hinge_turns) ? Refusal::none : Refusal::hinge_turns;
  const PolygonBody& body = *airframe.polygon;
  for (const Hinge& hinge : body.hinges) {
    for (const Real number : {hinge.at.x.value(), hinge.at.y.value(), hinge.turn.value()})
      if (!is_finite(number)) return Refusal::hinges;
  }
  for (std::size_t i = 0; i < body.more.size(); ++i) {
    if (!body.more[i]) continue;
    if (overlap(body.outline, *body.more[i])) return Refusal::body;
    for (std::size_t j = 0; j < i; ++j) {
      if (body.more[j] && overlap(*body.more[i], *body.more[j])) return Refusal::body;
    }
  }
  return Refusal::none;
}

Refusal refusal_of(const Airframe& airframe, std::size_t curves) noexcept {
  const std::size_t rotors = rotors_of(airframe), radii = airframe.propeller_radii.size();
  if (rotors < kFewestRotors || curves != rotors || (radii != 0 && radii != rotors)) return Refusal::rotors;
  if ((!airframe.polygon && !is_positive(airframe.half_side.value())) || !is_positive(airframe.arm_length.value())) {
    return Refusal::sizes;
  }
  for (std::size_t i = 0; i < rotors; ++i) {
    if (!is_positive(radius_of(airframe, i).value())) return Refusal::sizes;
    if (!airframe.polygon && airframe.arm_length <= radius_of(airframe, i)) return Refusal::arm_length;
  }
  const Real slowest = airframe.slowest_speed.value(), fastest = airframe.fastest_speed.value();
  if (!(slowest >= 0) || !(fastest > slowest) || !is_finite(fastest)) return Refusal::speeds;
  const ArmLimits& arms = airframe.arms;
  if (!(arms.from < arms.to) || !(arms.stale.value() > 0) || !(arms.stale_hub.value() > 0) ||
      !(arms.oldest.value() > 0)) {
    return Refusal::arm_limits;
  }
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
      "arm limits must satisfy from < to, and stale, stale_hub and oldest > 0; check them [rad, m, s]",
      "a curve needs K_T > 0, intercept > 0, a finite slope, a largest angle in (0, 2 pi]; check it",
      "parts of the body overlap; give convex parts that meet at an edge at most",
      "the tables of k and torque of all rotors have more than 96 knots together; give rotors with like propellers the "
      "same table, or fit fewer knots"};
  return refusal <= Refusal::knots ? kSentences[static_cast<std::size_t>(refusal)] : "unknown refusal";
}

BuildOutcome Compensator::build(const Rotors<ThrustCurve>& curves, const Airframe& airframe, ScalingLaw law) noexcept {
  BuildOutcome outcome;
  Parts parts{curves.size(),
              &curves,
              [](const void* all, std::size_t rotor) noexcept {
                return (*static_cast<const Rotors<ThrustCurve>*>(all))[rotor].parts();
              },
              &airframe,
              [](const void* from, Airframe& to) noexcept { to = *static_cast<const Airframe*>(from); },
              law};
  outcome.refusal = build_at(&outcome.compensator.emplace(), parts);
  if (outcome.refusal != Refusal::none) outcome.compensator.reset();
  return outcome;
}

Refusal Compensator::build_at(void* place, const Parts& parts) noexcept {
  Compensator& built = *::new (place) Compensator;
  parts.put_airframe(parts.airframe, built.airframe_);
  built.law_ = parts.law;
  Refusal refusal = refusal_of(built.airframe_, parts.rotors);
  for (std::size_t i = 0; refusal == Refusal::none && i < parts.rotors; ++i) {
    const CurveParts curve = parts.curve_of(parts.curves, i);
    built.speed_trends_ = built.speed_trends_ || std::fabs(curve.speed_trend.per_rad_s) > 0;
    if (!sound(curve)) {
      refusal = Refusal::curve;
    } else if (curve.overlap != built.airframe_.overlap) {
      refusal = Refusal::overlap;
    } else if (!built.curves_.add(curve)) {
      refusal = Refusal::knots;
    }
  }
  if (refusal != Refusal::none) built.curves_.clear();
  built.begin();
  return refusal;
}

void Compensator::begin() noexcept {
  const std::size_t count = curves_.size();
  slowest_ = airframe_.slowest_speed.value();
  fastest_ = airframe_.fastest_speed.value();
  for (Rotors<Real>* each : {&effective_coefficients_, &scaling_factors_, &drag_scale_}) each->resize(count);
  for (Rotors<Radians>* each : {&arm_angles_, &occlusion_angles_}) each->resize(count);
  arm_flags_.resize(count);
  thrust_max_.resize(count);
  contact_free_.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    arm_angles_[i] = Radians(kUnknownAngle);  // differs from every first angle
    contact_free_[i] = window_of(airframe_, i);
    apply_occlusion(i);
  }
}

Compensator::Arm Compensator::take(std::size_t i, Radians angle) noexcept {
  const bool unknown = !is_finite(angle.value());
  const bool beyond = !unknown && (angle < airframe_.arms.from || angle > airframe_.arms.to);
  arm_flags_[i] = arm_flags_[i].with(Flag::arm_angle_unknown, unknown).with(Flag::arm_angle_beyond, beyond);
  if (unknown || beyond || angle == arm_angles_[i]) return Arm::at_rest;
  arm_angles_[i] = angle;
  if (!contact_free_[i].contains(angle)) return Arm::near_body;
  return occlusion_angles_[i].value() > 0 ? Arm::left_body : Arm::at_rest;
}

void Compensator::set_arms(const Rotors<Radians>& arm_angles, const ArmFeedback& feedback) noexcept {
  hubs_.resize(0);
  // In passes over all arms: the long calls of one pass do not wait for each other.
  Arm arms[kMostRotors];
  bool all_at_rest = true;
  const Real age = feedback.age.value();
  const bool young = age <= airframe_.arms.oldest.value();
  for (std::size_t i = 0; i < rotors(); ++i) {
    arms[i] = take(i, i < arm_angles.size() ? arm_angles[i] : Radians(kUnknownAngle));
    all_at_rest = all_at_rest && arms[i] == Arm::at_rest;
    const Real rate = i < feedback.rates.size() ? feedback.rates[i].value() : Real(0);
    const bool fresh = young && std::fabs(rate) * age <= airframe_.arms.stale.value();
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

void Compensator::set_hubs(const Rotors<HubPosition>& hubs, const HubFeedback& feedback) noexcept {
  constexpr Real kFarthest = 100;
  if (hubs_.size() == 0) {
    for (std::size_t i = 0; i < rotors(); ++i) {
      arm_angles_[i] = Radians(kUnknownAngle);
      hubs_.add({Metres(kUnknownAngle), Metres(kUnknownAngle)});
    }
  }
  for (std::size_t i = 0; i < rotors(); ++i) {
    const HubPosition hub = i < hubs.size() ? hubs[i] : HubPosition{Metres(kUnknownAngle), Metres(kUnknownAngle)};
    const Real x = hub.x.value(), y = hub.y.value();
    const bool unknown = !is_finite(x) || !is_finite(y);
    const bool beyond = !unknown && (std::fabs(x) > kFarthest || std::fabs(y) > kFarthest);
    arm_flags_[i] = arm_flags_[i].with(Flag::arm_angle_unknown, unknown).with(Flag::arm_angle_beyond, beyond);
    const Real speed = i < feedback.speeds.size() ? feedback.speeds[i] : Real(0), age = feedback.age.value();
    const bool fresh =
        age <= airframe_.arms.oldest.value() && std::fabs(speed) * age <= airframe_.arms.stale_hub.value();
    arm_flags_[i] = arm_flags_[i].with(Flag::arm_angle_stale, !fresh);
    if (unknown || beyond) continue;
    hubs_[i] = hub;
    occlusion_angles_[i] = occlusion_beside_body(airframe_, i, hub);
    apply_occlusion(i);
  }
}

RotorLayout Compensator::layout(const Masses& masses, const Rotors<int>& spins) const noexcept {
  if (hubs_.size() == 0) return layout_of(airframe_, masses, arm_angles_, spins);
  return layout_of(hubs_, masses, spins);
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
  if (before.hubs_.size() != 0) {
    set_hubs(before.hubs_);
  } else {
    set_arms(before.arm_angles_);
  }
  for (std::size_t i = 0; i < rotors(); ++i) apply_occlusion(i);
}

void Compensator::apply_occlusion(std::size_t rotor) noexcept {
  const Radians phi = occlusion_angles_[rotor];
  const bool covered = enabled_ && phi.value() > 0;
  const Real thrust_coefficient = curves_.thrust_coefficient(rotor), k = curves_.k_at(rotor, phi);
  const Real scaling = covered ? scaling_factor_of(k, thrust_coefficient, phi, law_) : Real(1);
  // The published law reaches 0 and below: divide by next to nothing then, and the fastest speed holds.
  const Real effective = std::max(thrust_coefficient * scaling * density_ratio_, std::numeric_limits<Real>::min());
  scaling_factors_[rotor] = scaling;
  effective_coefficients_[rotor] = effective;
  const Real at_fastest = follows_trends() ? curves_.speed_trend(rotor).factor_at(fastest_) : Real(1);
  thrust_max_[rotor] = Newtons(effective * (fastest_ * fastest_) * at_fastest);
  drag_scale_[rotor] = (covered ? curves_.torque_share_at(rotor, phi) : Real(1)) / std::max(scaling, kScalingFloor);
  arm_flags_[rotor] = arm_flags_[rotor]
                          .with(Flag::beyond_fit, phi > curves_.largest_fitted(rotor))
                          .with(Flag::at_floor, scaling <= kScalingFloor)
                          .with(Flag::at_ceiling, covered && law_ == ScalingLaw::clamped && k > thrust_coefficient);
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
  for (std::size_t i = 0; i < rotors(); ++i) speeds[i] = curves_.speed_trend(i).speed_for(speeds[i]);
}

void Compensator::flag(const Real (&asked)[kMostRotors], const Real (&wanted)[kMostRotors],
                       Rotors<Flags>& flags) const noexcept {
  for (std::size_t i = 0; i < rotors(); ++i) {
    flags[i] = flags[i]
                   .with(Flag::thrust_nan, is_nan(asked[i]))
                   .with(Flag::thrust_negative, asked[i] < 0)
                   .with(Flag::speed_at_slowest, wanted[i] < slowest_ * (1 - kRounding))
                   .with(Flag::speed_at_fastest, wanted[i] > fastest_ * (1 + kRounding));
  }
}

Rotors<Newtons> Compensator::uncovered_thrusts(const Rotors<Newtons>& thrusts) const noexcept {
  Rotors<Newtons> uncovered(rotors());
  for (std::size_t i = 0; i < rotors(); ++i) {
    const Real asked = thrust_of(thrusts, i), possible = asked > 0 ? asked : Real(0);
    const Real coefficient = curves_.thrust_coefficient(i) * density_ratio_;
    uncovered[i] = std::min(Newtons(possible), thrust_max_[i]) * (coefficient / effective_coefficients_[i]);
  }
  return uncovered;
}

Rotors<RadPerSec> Compensator::speed_uncertainties(const Rotors<ThrustCurve>& curves, const Rotors<Newtons>& thrusts,
                                                   Radians arm_angle_uncertainty) const noexcept {
  const SpeedCommand command = speeds_for(thrusts);
  Rotors<RadPerSec> uncertainties(rotors(), RadPerSec(kUnknown));
  for (std::size_t i = 0; i < rotors() && i < curves.size(); ++i)
    uncertainties[i] = speed_uncertainty(i, curves[i], command.speeds[i], arm_angle_uncertainty);
  return uncertainties;
}

RadPerSec Compensator::speed_uncertainty(std::size_t rotor, const ThrustCurve& curve, RadPerSec speed,
                                         Radians arm_angle_uncertainty) const noexcept {
  const Flags flags = arm_flags_[rotor];
  const bool by_hub = hubs_.size() != 0 && arm_angle_uncertainty.value() > 0;  // of what angle?
  const bool known = is_finite(arm_angle_uncertainty.value()) && !by_hub && !flags.has(Flag::arm_angle_unknown) &&
                     !flags.has(Flag::arm_angle_beyond);
  if (!known) return RadPerSec(kUnknown);
  const Radians angle = arm_angles_[rotor], phi = enabled_ ? occlusion_angles_[rotor] : Radians(0);
  Radians spread(0);
  if (enabled_ && is_finite(angle.value())) {
    const Radians above = occlusion_of_arm(airframe_, rotor, angle + arm_angle_uncertainty);
    const Radians below = occlusion_of_arm(airframe_, rotor, angle - arm_angle_uncertainty);
    spread = Radians(std::fabs((above - below).value()) / 2);
  }
  const Real relative = curve.relative_uncertainty(phi, spread, phi.value() > 0 ? law_ : ScalingLaw::clamped);
  // Zero times infinity would be NaN.
  return RadPerSec(relative < kUnknown ? relative / 2 * speed.value() : kUnknown);
}

}  // namespace kphi::compensation
