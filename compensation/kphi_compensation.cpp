#include "compensation/kphi_compensation.h"

#include <cmath>
#include <cstddef>
#include <new>

#include "compensation/compensator.hpp"
#include "compensation/mixing.hpp"
#include "compensation/throttle.hpp"

namespace {

using namespace kphi;
using namespace kphi::compensation;

static_assert(sizeof(Compensator) <= sizeof(kphi_compensator) && alignof(Compensator) <= alignof(kphi_compensator));
static_assert(sizeof(Mixer) <= sizeof(kphi_mixer) && alignof(Mixer) <= alignof(kphi_mixer));
static_assert(KPHI_MAX_CORNERS == ConvexPolygon::kMaxCorners && KPHI_MAX_ROTORS == kMostRotors &&
              KPHI_MAX_KNOTS == kMostKnots);
static_assert(KPHI_ARM_ANGLE_STALE == static_cast<int>(Flag::arm_angle_stale) &&
              KPHI_THRUST_NAN == static_cast<int>(Flag::thrust_nan));
static_assert(KPHI_LOAD_SHARE == static_cast<int>(OverlapMeasure::load_share));
static_assert(KPHI_DEMAND_NAN == static_cast<int>(Concession::demand_nan) &&
              KPHI_MIX_UNFINISHED == static_cast<int>(Concession::unfinished));
static_assert(KPHI_LAW_PUBLISHED == static_cast<int>(ScalingLaw::published));
static_assert(sizeof(unsigned short) == sizeof(Flags));

/// Codes of kphi_compensator_build beyond those of Refusal; kphi_refusal_text has their words in the same order.
enum MoreRefusals : int { kBadCurve = 100, kBadOutline, kBadLaw, kBadOverlap };

Compensator& of(kphi_compensator* c) noexcept { return *std::launder(reinterpret_cast<Compensator*>(c->state)); }
const Compensator& of(const kphi_compensator* c) noexcept {
  return *std::launder(reinterpret_cast<const Compensator*>(c->state));
}
Mixer& of(kphi_mixer* m) noexcept { return *std::launder(reinterpret_cast<Mixer*>(m->state)); }
const Mixer& of(const kphi_mixer* m) noexcept { return *std::launder(reinterpret_cast<const Mixer*>(m->state)); }

template <class T, class From>
Rotors<T> taken(const From* values, std::size_t count) noexcept {
  Rotors<T> rotors(count);
  for (std::size_t i = 0; i < count; ++i) rotors[i] = T(values[i]);
  return rotors;
}

kphi_real number(kphi_real value) noexcept { return value; }
template <class Unit>
kphi_real number(Quantity<Unit> value) noexcept {
  return value.value();
}

template <class T>
void hand_out(const Rotors<T>& from, kphi_real* to) noexcept {
  for (std::size_t i = 0; i < from.size(); ++i) to[i] = number(from[i]);
}

Position at(const kphi_real (&place)[2]) noexcept { return {Metres(place[0]), Metres(place[1])}; }

std::optional<OverlapMeasure> measure_of(int code) noexcept {
  if (code < KPHI_RIM_ARC || code > KPHI_LOAD_SHARE) return std::nullopt;
  return static_cast<OverlapMeasure>(code);
}

std::optional<OcclusionTable> table_of(const kphi_knot* knots, int count) noexcept {
  if (count < 0 || count > KPHI_MAX_KNOTS) return std::nullopt;
  Knot taken[KPHI_MAX_KNOTS];
  for (int i = 0; i < count; ++i) taken[i] = {Radians(knots[i].phi_rad), knots[i].value, knots[i].error};
  return OcclusionTable::from(taken, static_cast<std::size_t>(count));
}

/// k(φ) alone.
std::optional<ThrustCurve> form_of(const kphi_curve& curve, OverlapMeasure overlap) noexcept {
  const Radians largest(curve.largest_fitted_rad);
  if (curve.knot_count != 0) {
    const auto k = table_of(curve.knots, curve.knot_count);
    return k ? ThrustCurve::from_table(*k, largest, overlap) : std::nullopt;
  }
  std::optional<LineUncertainty> uncertainty;
  if (curve.has_uncertainty != 0) {
    uncertainty = LineUncertainty{curve.thrust_coefficient_error, curve.intercept_variance, curve.covariance,
                                  curve.slope_variance};
  }
  return ThrustCurve::from_line(ThrustCoefficient(curve.thrust_coefficient), ThrustCoefficient(curve.intercept),
                                curve.slope_per_rad, largest, overlap, uncertainty);
}

std::optional<ThrustCurve> curve_of(const kphi_curve& from) noexcept {
  const auto overlap = measure_of(from.overlap);
  auto curve = overlap ? form_of(from, *overlap) : std::nullopt;
  if (curve && from.torque_count != 0) {
    const auto share = table_of(from.torque, from.torque_count);
    if (!share || !curve->set_torque_share(*share)) return std::nullopt;
  }
  const bool trend = !(std::fabs(from.trend_per_rad_s) <= 0);
  if (curve && trend && !curve->set_speed_trend({from.trend_per_rad_s, RadPerSec(from.trend_reference)})) {
    return std::nullopt;
  }
  return curve;
}

std::size_t rotors_of(const kphi_airframe& airframe) noexcept {
  if (airframe.rotors == 0) return 4;
  const bool possible = airframe.rotors > 0 && airframe.rotors <= KPHI_MAX_ROTORS;
  return possible ? static_cast<std::size_t>(airframe.rotors) : 0;
}

std::optional<PolygonBody> body_of(const kphi_airframe& airframe) noexcept {
  if (airframe.corner_count < 0 || airframe.corner_count > KPHI_MAX_CORNERS) return std::nullopt;
  Position corners[KPHI_MAX_CORNERS];
  const auto count = static_cast<std::size_t>(airframe.corner_count);
  for (std::size_t i = 0; i < count; ++i) corners[i] = at(airframe.corners[i]);
  const auto outline = ConvexPolygon::from(corners, count);
  if (!outline) return std::nullopt;
  PolygonBody body{*outline, Rotors<Hinge>(rotors_of(airframe))};
  for (std::size_t i = 0; i < body.hinges.size(); ++i) {
    body.hinges[i] = {at(airframe.hinges[i]), Radians(airframe.hinge_turn_rad[i]), airframe.mirrored[i] != 0};
  }
  return body;
}

Airframe airframe_of(const kphi_airframe& from, OverlapMeasure overlap) noexcept {
  Airframe airframe{Metres(from.half_side), Metres(from.arm_length), Metres(from.propeller_radius),
                    RadPerSec(from.slowest_speed), RadPerSec(from.fastest_speed)};
  airframe.overlap = overlap;
  for (std::size_t i = 0; i < 4; ++i) {
    airframe.hinge_turns[i] = from.hinge_turns[i];
    airframe.mirrored[i] = from.mirrored[i] != 0;
  }
  if (from.propellers_differ != 0) airframe.propeller_radii = taken<Metres>(from.propeller_radii, rotors_of(from));
  if (from.has_arm_limits != 0) {
    airframe.arms = {Radians(from.arm_from_rad), Radians(from.arm_to_rad), Radians(from.arm_stale_rad)};
  }
  return airframe;
}

RotorLayout layout_of(std::size_t count, const kphi_real (*hubs)[2], const int* spins) noexcept {
  RotorLayout layout{Rotors<HubPosition>(count), taken<int>(spins, count)};
  for (std::size_t i = 0; i < count; ++i) layout.hubs[i] = at(hubs[i]);
  return layout;
}

}  // namespace

extern "C" {

const char* kphi_compensation_version(void) { return KPHI_COMPENSATION_VERSION; }

int kphi_compensator_build(kphi_compensator* out, const kphi_curve* curves, const kphi_airframe* airframe, int law) {
  if (law != KPHI_LAW_CLAMPED && law != KPHI_LAW_PUBLISHED) return kBadLaw;
  const auto overlap = measure_of(airframe->overlap);
  if (!overlap) return kBadOverlap;
  const std::size_t count = rotors_of(*airframe);
  if (count < kFewestRotors) return static_cast<int>(Refusal::rotors);
  Airframe frame = airframe_of(*airframe, *overlap);
  if (airframe->corner_count != 0) {
    frame.polygon = body_of(*airframe);
    if (!frame.polygon) return kBadOutline;
  }
  const auto first = curve_of(curves[0]);
  if (!first) return kBadCurve;
  Rotors<ThrustCurve> each(count, *first);
  for (std::size_t i = 1; i < count; ++i) {
    const auto curve = curve_of(curves[i]);
    if (!curve) return kBadCurve;
    each[i] = *curve;
  }
  const BuildOutcome outcome = Compensator::build(each, frame, static_cast<ScalingLaw>(law));
  if (!outcome.compensator) return static_cast<int>(outcome.refusal);
  ::new (out->state) Compensator(*outcome.compensator);
  return 0;
}

const char* kphi_refusal_text(int refusal) {
  static constexpr const char* kMore[] = {
      ("a curve needs K_T > 0, intercept > 0, a finite slope, a largest angle in (0, 2 pi], a known overlap measure, "
       "variances that are not negative; a table 2 to 12 knots from phi = 0 on with k > 0 that does not rise; shares "
       "of the torque in (0, 10); a speed trend a reference > 0, and at most 0.3 of k down to rest"),
      "the body must have 3 to 12 corners, finite, counter-clockwise and convex",
      "the law is neither KPHI_LAW_CLAMPED nor KPHI_LAW_PUBLISHED",
      "the airframe's overlap measure is none of KPHI_RIM_ARC, KPHI_AREA_SHARE, KPHI_LOAD_SHARE"};
  if (refusal >= kBadCurve && refusal < kBadCurve + static_cast<int>(std::size(kMore)))
    return kMore[refusal - kBadCurve];
  const bool known = refusal >= 0 && refusal <= static_cast<int>(Refusal::arm_limits);
  return known ? describe(static_cast<Refusal>(refusal)) : "unknown refusal";
}

int kphi_curve_doubts(const kphi_curve* from, int law) {
  const auto curve = curve_of(*from);
  if (!curve) return -1;
  const CurveDoubts doubts =
      doubts_about(*curve, law == KPHI_LAW_PUBLISHED ? ScalingLaw::published : ScalingLaw::clamped);
  return (doubts.gains_with_occlusion ? KPHI_GAINS_WITH_OCCLUSION : 0) +
         (doubts.steps_at_contact ? KPHI_STEPS_AT_CONTACT : 0);
}

void kphi_set_arms(kphi_compensator* compensator, const kphi_real* arm_angles_rad) {
  of(compensator).set_arms(taken<Radians>(arm_angles_rad, of(compensator).rotors()));
}

void kphi_set_moving_arms(kphi_compensator* compensator, const kphi_real* arm_angles_rad, const kphi_real* rates,
                          kphi_real age_s) {
  const std::size_t count = of(compensator).rotors();
  of(compensator).set_arms(taken<Radians>(arm_angles_rad, count), {Seconds(age_s), taken<RadPerSec>(rates, count)});
}

void kphi_speeds_for(const kphi_compensator* compensator, const kphi_real* thrusts_n, kphi_real* speeds_rad_s,
                     unsigned short* flags) {
  const SpeedCommand command = of(compensator).speeds_for(taken<Newtons>(thrusts_n, of(compensator).rotors()));
  hand_out(command.speeds, speeds_rad_s);
  if (flags == nullptr) return;
  for (std::size_t i = 0; i < command.flags.size(); ++i) flags[i] = command.flags[i].bits();
}

void kphi_uncovered_thrusts(const kphi_compensator* compensator, const kphi_real* thrusts_n, kphi_real* uncovered_n) {
  hand_out(of(compensator).uncovered_thrusts(taken<Newtons>(thrusts_n, of(compensator).rotors())), uncovered_n);
}

kphi_real kphi_throttle(kphi_real full_n, kphi_real square_share, kphi_real uncovered_n) {
  return ThrottleCurve{Newtons(full_n), square_share}.throttle_for(Newtons(uncovered_n));
}

void kphi_enable(kphi_compensator* compensator, int on) { of(compensator).enable(on != 0); }

int kphi_set_air_density_ratio(kphi_compensator* compensator, kphi_real ratio) {
  return of(compensator).set_air_density_ratio(ratio) ? 1 : 0;
}

void kphi_resume_from(kphi_compensator* compensator, const kphi_compensator* before) {
  of(compensator).resume_from(of(before));
}

void kphi_occlusion_angles(const kphi_compensator* compensator, kphi_real* angles_rad) {
  hand_out(of(compensator).occlusion_angles(), angles_rad);
}

void kphi_scaling_factors(const kphi_compensator* compensator, kphi_real* factors) {
  hand_out(of(compensator).scaling_factors(), factors);
}

void kphi_thrust_max(const kphi_compensator* compensator, kphi_real* thrusts_n) {
  hand_out(of(compensator).thrust_max(), thrusts_n);
}

void kphi_drag_scale(const kphi_compensator* compensator, kphi_real* scales) {
  hand_out(of(compensator).drag_scale(), scales);
}

void kphi_hubs(const kphi_compensator* compensator, const kphi_masses* masses, kphi_real (*hubs)[2]) {
  const Compensator& known = of(compensator);
  const Masses of_vehicle{masses->body, at(masses->body_at), taken<Real>(masses->at_hubs, known.rotors())};
  const RotorLayout layout = known.layout(of_vehicle, {});
  for (std::size_t i = 0; i < layout.hubs.size(); ++i) {
    hubs[i][0] = layout.hubs[i].x.value();
    hubs[i][1] = layout.hubs[i].y.value();
  }
}

void kphi_speed_uncertainties(const kphi_compensator* compensator, const kphi_real* thrusts_n,
                              kphi_real arm_angle_uncertainty_rad, kphi_real* uncertainties_rad_s) {
  const Compensator& known = of(compensator);
  hand_out(known.speed_uncertainties(taken<Newtons>(thrusts_n, known.rotors()), Radians(arm_angle_uncertainty_rad)),
           uncertainties_rad_s);
}

int kphi_mixer_build(kphi_mixer* out, int rotors, const kphi_real (*hubs)[2], const int* spins,
                     kphi_real drag_per_newton, kphi_real drag_per_square_newton) {
  if (rotors < static_cast<int>(kFewestRotors) || rotors > KPHI_MAX_ROTORS) return 0;
  const auto mixer = Mixer::build(layout_of(static_cast<std::size_t>(rotors), hubs, spins),
                                  {Metres(drag_per_newton), drag_per_square_newton});
  if (!mixer) return 0;
  ::new (out->state) Mixer(*mixer);
  return 1;
}

int kphi_mixer_set_layout(kphi_mixer* mixer, const kphi_real (*hubs)[2], const int* spins,
                          const kphi_real* drag_scale) {
  const std::size_t count = of(mixer).rotors();
  return of(mixer).set_layout(layout_of(count, hubs, spins), taken<Real>(drag_scale, count)) ? 1 : 0;
}

int kphi_mix(const kphi_mixer* mixer, const kphi_real wrench[4], const kphi_real* smallest_n,
             const kphi_real* largest_n, kphi_real assured_yaw, kphi_real* thrusts_n, kphi_real achieved[4]) {
  const std::size_t count = of(mixer).rotors();
  const MixedThrusts mixed =
      of(mixer).mix({Newtons(wrench[0]), NewtonMetres(wrench[1]), NewtonMetres(wrench[2]), NewtonMetres(wrench[3])},
                    {taken<Newtons>(smallest_n, count), taken<Newtons>(largest_n, count)}, NewtonMetres(assured_yaw));
  hand_out(mixed.thrusts, thrusts_n);
  if (achieved != nullptr) {
    achieved[0] = mixed.achieved.thrust.value();
    achieved[1] = mixed.achieved.roll.value();
    achieved[2] = mixed.achieved.pitch.value();
    achieved[3] = mixed.achieved.yaw.value();
  }
  return mixed.concessions.bits();
}

}  // extern "C"
