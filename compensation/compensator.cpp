#include "compensation/compensator.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace kphi::compensation {
namespace {

bool positive(double value) noexcept { return std::isfinite(value) && value > 0.0; }

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

Refusal refusal_of(const Airframe& airframe) noexcept {
  if ((!airframe.polygon && !positive(airframe.half_side.value())) || !positive(airframe.arm_length.value()) ||
      !positive(airframe.propeller_radius.value())) {
    return Refusal::sizes;
  }
  if (airframe.arm_length <= airframe.propeller_radius) return Refusal::arm_length;
  const double slowest = airframe.slowest_speed.value(), fastest = airframe.fastest_speed.value();
  if (!(slowest >= 0.0) || !(fastest > slowest) || !std::isfinite(fastest)) return Refusal::speeds;
  return refusal_of_body(airframe);
}

/// The window is known in closed form for the square alone.
ContactFreeWindow window_of(const Airframe& airframe) noexcept {
  if (airframe.polygon) return {Radians(1.0), Radians(-1.0)};
  return contact_free_window(airframe.half_side, airframe.arm_length, airframe.propeller_radius);
}

/// As a number that is added: the compiler makes vector instructions of it.
constexpr double worth(Flag flag) noexcept { return static_cast<double>(flag); }

CurveDoubts doubts_about(const ThrustCurve& curve, ScalingLaw law) noexcept {
  CurveDoubts doubts;
  doubts.gains_with_occlusion = curve.at(curve.largest_fitted()) >= curve.at(Radians(0.0));
  // A curve forced through K_T may miss it by the rounding of its file.
  const double offset = curve.at(Radians(0.0)) / curve.thrust_coefficient() - 1.0;
  doubts.steps_at_contact = offset < -1e-9 || (law == ScalingLaw::published && offset > 1e-9);
  return doubts;
}

}  // namespace

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
      "or fit again"};
  return refusal <= Refusal::overlap ? kSentences[static_cast<std::size_t>(refusal)] : "unknown refusal";
}

BuildOutcome Compensator::build(const std::array<ThrustCurve, 4>& curves, const Airframe& airframe,
                                ScalingLaw law) noexcept {
  BuildOutcome outcome;
  outcome.refusal = refusal_of(airframe);
  for (const ThrustCurve& curve : curves) {
    if (outcome.refusal == Refusal::none && curve.overlap() != airframe.overlap) outcome.refusal = Refusal::overlap;
  }
  if (outcome.refusal != Refusal::none) return outcome;
  for (std::size_t i = 0; i < curves.size(); ++i) outcome.doubts[i] = doubts_about(curves[i], law);
  outcome.compensator = Compensator(curves, airframe, law);
  return outcome;
}

Compensator::Compensator(const std::array<ThrustCurve, 4>& curves, const Airframe& airframe, ScalingLaw law) noexcept
    : slowest_(airframe.slowest_speed.value()),
      fastest_(airframe.fastest_speed.value()),
      law_(law),
      curves_(curves),
      airframe_(airframe),
      contact_free_(window_of(airframe)) {
  arm_angles_.fill(Radians(std::numeric_limits<double>::quiet_NaN()));  // differs from every first angle
  for (std::size_t i = 0; i < curves_.size(); ++i) apply_occlusion(i);
}

Compensator::Arm Compensator::take(std::size_t i, Radians angle) noexcept {
  if (angle == arm_angles_[i] && !arm_flags_[i].has(Flag::arm_angle_unknown)) return Arm::at_rest;
  if (!std::isfinite(angle.value())) {
    arm_flags_[i] = arm_flags_[i].with(Flag::arm_angle_unknown, true);
    return Arm::at_rest;
  }
  arm_angles_[i] = angle;
  arm_flags_[i] = Flags();
  if (!contact_free_.contains(angle)) return Arm::near_body;
  return occlusion_angles_[i].value() == 0.0 ? Arm::at_rest : Arm::left_body;
}

void Compensator::set_arms(const std::array<Radians, 4>& arm_angles) noexcept {
  // In passes over all arms: the long calls of one pass do not wait for each other.
  std::array<Arm, 4> arms{};
  bool all_at_rest = true;
  for (std::size_t i = 0; i < 4; ++i) {
    arms[i] = take(i, arm_angles[i]);
    all_at_rest = all_at_rest && arms[i] == Arm::at_rest;
  }
  if (all_at_rest) return;
  std::array<HubPosition, 4> hubs{};
  for (std::size_t i = 0; i < 4; ++i) {
    if (arms[i] == Arm::near_body) hubs[i] = hub_beside_body(airframe_, i, arm_angles[i]);
  }
  for (std::size_t i = 0; i < 4; ++i) {
    if (arms[i] == Arm::near_body) occlusion_angles_[i] = occlusion_beside_body(airframe_, hubs[i]);
    if (arms[i] == Arm::left_body) occlusion_angles_[i] = Radians(0.0);
  }
  for (std::size_t i = 0; i < 4; ++i) {
    if (arms[i] != Arm::at_rest) apply_occlusion(i);
  }
}

void Compensator::enable(bool on) noexcept {
  enabled_ = on;
  for (std::size_t i = 0; i < curves_.size(); ++i) apply_occlusion(i);
}

void Compensator::apply_occlusion(std::size_t rotor) noexcept {
  const ThrustCurve& curve = curves_[rotor];
  const Radians phi = occlusion_angles_[rotor];
  const bool covered = enabled_ && phi.value() > 0.0;
  const double scaling = covered ? curve.scaling_factor(phi, law_) : 1.0;
  // The published law reaches 0 and below: divide by next to nothing then, and the fastest speed holds.
  const double effective = std::max(curve.thrust_coefficient().value() * scaling, std::numeric_limits<double>::min());
  scaling_factors_[rotor] = scaling;
  effective_coefficients_[rotor] = effective;
  thrust_max_[rotor] = Newtons(effective * (fastest_ * fastest_));
  drag_scale_[rotor] = 1.0 / std::max(scaling, kScalingFloor);
  arm_flags_[rotor] =
      Flags()
          .with(Flag::arm_angle_unknown, arm_flags_[rotor].has(Flag::arm_angle_unknown))
          .with(Flag::beyond_fit, phi > curve.largest_fitted())
          .with(Flag::at_floor, scaling <= kScalingFloor)
          .with(Flag::at_ceiling, covered && law_ == ScalingLaw::clamped && curve.at(phi) > curve.thrust_coefficient());
}

SpeedCommand Compensator::speeds_for(const std::array<Newtons, 4>& thrusts) const noexcept {
  // In passes over all rotors: the compiler makes vector instructions of them. Flags are for what was changed alone.
  double possible[4], wanted[4], held[4], change[4];
  for (std::size_t i = 0; i < 4; ++i) {
    const double asked = thrusts[i].value();
    possible[i] = asked > 0.0 ? asked : 0.0;  // NaN compares false
    wanted[i] = std::sqrt(possible[i] / effective_coefficients_[i]);
  }
  for (std::size_t i = 0; i < 4; ++i) {
    const double raised = wanted[i] < slowest_ ? slowest_ : wanted[i];
    held[i] = raised > fastest_ ? fastest_ : raised;
  }
  for (std::size_t i = 0; i < 4; ++i) {
    change[i] = std::fabs(held[i] - wanted[i]) + std::fabs(possible[i] - thrusts[i].value());
  }
  SpeedCommand command;
  for (std::size_t i = 0; i < 4; ++i) command.speeds[i] = RadPerSec(held[i]);
  command.flags = arm_flags_;
  const bool as_asked = change[0] + change[1] + (change[2] + change[3]) == 0.0;  // NaN compares false
  if (!as_asked) flag(thrusts, wanted, command.flags);
  return command;
}

void Compensator::flag(const std::array<Newtons, 4>& thrusts, const double (&wanted)[4],
                       std::array<Flags, 4>& flags) const noexcept {
  double raised[4];
  for (std::size_t i = 0; i < 4; ++i) {
    const double asked = thrusts[i].value();
    raised[i] = (asked != asked ? worth(Flag::thrust_nan) : 0.0) + (asked < 0.0 ? worth(Flag::thrust_negative) : 0.0) +
                (wanted[i] < slowest_ ? worth(Flag::speed_at_slowest) : 0.0) +
                (wanted[i] > fastest_ ? worth(Flag::speed_at_fastest) : 0.0);
  }
  for (std::size_t i = 0; i < 4; ++i) {
    flags[i] = flags[i].with(static_cast<std::uint8_t>(static_cast<int>(raised[i])));
  }
}

std::array<RadPerSec, 4> Compensator::speed_uncertainties(const std::array<Newtons, 4>& thrusts,
                                                          Radians arm_angle_uncertainty) const noexcept {
  const SpeedCommand command = speeds_for(thrusts);
  std::array<RadPerSec, 4> uncertainties;
  for (std::size_t i = 0; i < 4; ++i) {
    const Radians angle = arm_angles_[i], phi = enabled_ ? occlusion_angles_[i] : Radians(0.0);
    const bool known = !arm_flags_[i].has(Flag::arm_angle_unknown) && std::isfinite(arm_angle_uncertainty.value());
    Radians spread(0.0);
    if (enabled_ && known && std::isfinite(angle.value()) && arm_angle_uncertainty.value() != 0.0) {
      const Radians above = occlusion_of_arm(airframe_, i, angle + arm_angle_uncertainty);
      const Radians below = occlusion_of_arm(airframe_, i, angle - arm_angle_uncertainty);
      spread = Radians(0.5 * std::fabs((above - below).value()));
    }
    const double relative =
        curves_[i].relative_uncertainty(phi, spread, phi.value() > 0.0 ? law_ : ScalingLaw::clamped);
    const double unknown = std::numeric_limits<double>::infinity();
    const double speed = command.speeds[i].value();
    // Zero times infinity would be NaN.
    uncertainties[i] = RadPerSec(known && relative < unknown ? 0.5 * relative * speed : unknown);
  }
  return uncertainties;
}

}  // namespace kphi::compensation
