#include "compensation/kphi_compensation.h"

#include <cmath>
#include <cstddef>
#include <limits>
#include <new>

#include "compensation/compensator.hpp"
#include "compensation/mixing.hpp"
#include "compensation/strict_math.hpp"
#include "compensation/throttle.hpp"
#include "compensation/thrust_factor.hpp"

#ifdef __GNUC__
#define KPHI_BY_ITSELF [[gnu::noinline]]
#else
#define KPHI_BY_ITSELF
#endif

namespace {

using namespace kphi;
using namespace kphi::compensation;

static_assert(sizeof(Compensator) <= sizeof(kphi_compensator) && alignof(Compensator) <= alignof(kphi_compensator));
static_assert(sizeof(Mixer) <= sizeof(kphi_mixer) && alignof(Mixer) <= alignof(kphi_mixer));
static_assert(sizeof(ThrustFactor) <= sizeof(kphi_factor) && alignof(ThrustFactor) <= alignof(kphi_factor));
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
ThrustFactor& of(kphi_factor* f) noexcept { return *std::launder(reinterpret_cast<ThrustFactor*>(f->state)); }
const ThrustFactor& of(const kphi_factor* f) noexcept {
  return *std::launder(reinterpret_cast<const ThrustFactor*>(f->state));
}

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

KnotList knots_of(const kphi_knot (&knots)[KPHI_MAX_KNOTS], int count) noexcept {
  // As many as are too many stand for a count that is none.
  const std::size_t many = count < 0 || count > KPHI_MAX_KNOTS ? kMostKnots + 1 : static_cast<std::size_t>(count);
  return {knots, many, [](const void* from, std::size_t i) noexcept {
            const kphi_knot& knot = static_cast<const kphi_knot*>(from)[i];
            return Knot{Radians(knot.phi_rad), knot.value, knot.error};
          }};
}

LineUncertainty uncertainty_of(const kphi_curve& from) noexcept {
  return {from.thrust_coefficient_error, from.intercept_variance, from.covariance, from.slope_variance};
}

CurveParts parts_of(const kphi_curve& from) noexcept {
  CurveParts parts{ThrustCoefficient(from.thrust_coefficient),
                   ThrustCoefficient(from.intercept),
                   from.slope_per_rad,
                   Radians(from.largest_fitted_rad),
                   OverlapMeasure::rim_arc,
                   knots_of(from.knots, from.knot_count),
                   knots_of(from.torque, from.torque_count),
                   {from.trend_per_rad_s, RadPerSec(from.trend_reference)}};
  const auto overlap = measure_of(from.overlap);
  const bool errors = from.has_uncertainty == 0 || from.knot_count != 0 || sound(uncertainty_of(from));
  if (!overlap || !errors) return {};  // of which no curve can be made
  parts.overlap = *overlap;
  if (from.knot_count > 0) parts.thrust_coefficient = ThrustCoefficient(from.knots[0].value);
  return parts;
}

std::optional<OcclusionTable> table_of(const KnotList& knots) noexcept {
  Knot taken[KPHI_MAX_KNOTS];
  if (knots.count > kMostKnots) return std::nullopt;
  for (std::size_t i = 0; i < knots.count; ++i) taken[i] = knots[i];
  return OcclusionTable::from(taken, knots.count);
}

/// With its uncertainties: for the ground.
std::optional<ThrustCurve> curve_of(const kphi_curve& from) noexcept {
  const CurveParts parts = parts_of(from);
  if (!sound(parts)) return std::nullopt;
  std::optional<LineUncertainty> errors;
  if (from.has_uncertainty != 0) errors = uncertainty_of(from);
  auto curve = parts.k.count > 0
                   ? ThrustCurve::from_table(*table_of(parts.k), parts.largest_fitted, parts.overlap)
                   : ThrustCurve::from_line(parts.thrust_coefficient, parts.intercept, parts.slope_per_rad,
                                            parts.largest_fitted, parts.overlap, errors);
  if (curve && parts.torque.count > 0) (void)curve->set_torque_share(*table_of(parts.torque));
  if (curve) (void)curve->set_speed_trend(parts.speed_trend);
  return curve;
}

std::size_t rotors_of(const kphi_airframe& airframe) noexcept {
  if (airframe.rotors == 0) return 4;
  const bool possible = airframe.rotors > 0 && airframe.rotors <= KPHI_MAX_ROTORS;
  return possible ? static_cast<std::size_t>(airframe.rotors) : 0;
}

/// By itself: the corners are off the stack when the curves are taken.
KPHI_BY_ITSELF std::optional<ConvexPolygon> outline_of(const kphi_real (&from)[KPHI_MAX_CORNERS][2],
                                                       int count) noexcept {
  if (count < 0 || count > KPHI_MAX_CORNERS) return std::nullopt;
  Position corners[KPHI_MAX_CORNERS];
  for (int i = 0; i < count; ++i) corners[i] = at(from[i]);
  return ConvexPolygon::from(corners, static_cast<std::size_t>(count));
}

/// False: of these corners no outline can be made.
KPHI_BY_ITSELF bool put_body(const kphi_airframe& from, Airframe& airframe) noexcept {
  const auto outline = outline_of(from.corners, from.corner_count);
  if (!outline) return false;
  airframe.polygon.emplace(*outline);
  for (std::size_t i = 0; i < rotors_of(from); ++i)
    airframe.polygon->hinges.add({at(from.hinges[i]), Radians(from.hinge_turn_rad[i]), from.mirrored[i] != 0});
  for (std::size_t i = 0; i < PolygonBody::kMostMore; ++i) {
    if (from.more_corner_counts[i] == 0) continue;
    auto& part = airframe.polygon->more[i];
    part = outline_of(from.more_corners[i], from.more_corner_counts[i]);
    if (!part) return false;
  }
  return true;
}

/// An airframe on its way, and whether its body is one.
struct Told {
  const kphi_airframe* from;
  mutable bool bad_outline = false;
};

void put_airframe(const void* told, Airframe& airframe) noexcept {
  const kphi_airframe& from = *static_cast<const Told*>(told)->from;
  airframe.half_side = Metres(from.half_side);
  airframe.arm_length = Metres(from.arm_length);
  airframe.propeller_radius = Metres(from.propeller_radius);
  airframe.slowest_speed = RadPerSec(from.slowest_speed);
  airframe.fastest_speed = RadPerSec(from.fastest_speed);
  airframe.overlap = static_cast<OverlapMeasure>(from.overlap);
  for (std::size_t i = 0; i < 4; ++i) {
    airframe.hinge_turns[i] = from.hinge_turns[i];
    airframe.mirrored[i] = from.mirrored[i] != 0;
  }
  for (std::size_t i = 0; from.propellers_differ != 0 && i < rotors_of(from); ++i)
    airframe.propeller_radii.add(Metres(from.propeller_radii[i]));
  if (from.has_arm_limits != 0) {
    airframe.arms.from = Radians(from.arm_from_rad);
    airframe.arms.to = Radians(from.arm_to_rad);
    airframe.arms.stale = Radians(from.arm_stale_rad);
    if (!(std::fabs(from.arm_oldest_s) <= 0)) airframe.arms.oldest = Seconds(from.arm_oldest_s);
    if (!(std::fabs(from.hub_stale_m) <= 0)) airframe.arms.stale_hub = Metres(from.hub_stale_m);
  }
  if (from.corner_count != 0) static_cast<const Told*>(told)->bad_outline = !put_body(from, airframe);
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
  if (!measure_of(airframe->overlap)) return kBadOverlap;
  const std::size_t count = rotors_of(*airframe);
  if (count < kFewestRotors) return static_cast<int>(Refusal::rotors);
  const Told told{airframe};
  const Refusal refusal = Compensator::build_at(
      out->state,
      {count, curves,
       [](const void* all, std::size_t rotor) noexcept { return parts_of(static_cast<const kphi_curve*>(all)[rotor]); },
       &told, put_airframe, static_cast<ScalingLaw>(law)});
  if (told.bad_outline) {
    ::new (out->state) Compensator();
    return kBadOutline;
  }
  return refusal == Refusal::curve ? static_cast<int>(kBadCurve) : static_cast<int>(refusal);
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
  const bool known = refusal >= 0 && refusal <= static_cast<int>(Refusal::knots);
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

void kphi_set_hubs(kphi_compensator* compensator, const kphi_real (*hubs)[2], const kphi_real* speeds,
                   kphi_real age_s) {
  const std::size_t count = of(compensator).rotors();
  Rotors<HubPosition> places;
  HubFeedback feedback{Seconds(age_s), {}};
  for (std::size_t i = 0; i < count; ++i) {
    places.add(at(hubs[i]));
    if (speeds != nullptr) feedback.speeds.add(speeds[i]);
  }
  of(compensator).set_hubs(places, feedback);
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

void kphi_speed_uncertainties(const kphi_compensator* compensator, const kphi_curve* curves, const kphi_real* thrusts_n,
                              kphi_real arm_angle_uncertainty_rad, kphi_real* uncertainties_rad_s) {
  const Compensator& known = of(compensator);
  const SpeedCommand command = known.speeds_for(taken<Newtons>(thrusts_n, known.rotors()));
  for (std::size_t i = 0; i < known.rotors(); ++i) {
    const auto curve = curve_of(curves[i]);
    uncertainties_rad_s[i] =
        curve ? known.speed_uncertainty(i, *curve, command.speeds[i], Radians(arm_angle_uncertainty_rad)).value()
              : std::numeric_limits<kphi_real>::infinity();
  }
}

int kphi_mixer_build(kphi_mixer* out, int rotors, const kphi_real (*hubs)[2], const int* spins,
                     kphi_real drag_per_newton, kphi_real drag_per_square_newton) {
  if (rotors < static_cast<int>(kFewestRotors) || rotors > KPHI_MAX_ROTORS) return 0;
  const RotorLayout layout = layout_of(static_cast<std::size_t>(rotors), hubs, spins);
  return (::new (out->state) Mixer())->rebuild(layout, {Metres(drag_per_newton), drag_per_square_newton}) ? 1 : 0;
}

int kphi_mixer_set_layout(kphi_mixer* mixer, const kphi_real (*hubs)[2], const int* spins,
                          const kphi_real* drag_scale) {
  const std::size_t count = of(mixer).rotors();
  return of(mixer).set_layout(layout_of(count, hubs, spins), taken<Real>(drag_scale, count)) ? 1 : 0;
}

int kphi_mix(const kphi_mixer* mixer, const kphi_real wrench[4], const kphi_real* smallest_n,
             const kphi_real* largest_n, kphi_real assured_yaw, kphi_real* thrusts_n, kphi_real achieved[4]) {
  const MixedThrusts mixed =
      of(mixer).mix({Newtons(wrench[0]), NewtonMetres(wrench[1]), NewtonMetres(wrench[2]), NewtonMetres(wrench[3])},
                    smallest_n, largest_n, NewtonMetres(assured_yaw));
  hand_out(mixed.thrusts, thrusts_n);
  if (achieved != nullptr) {
    achieved[0] = mixed.achieved.thrust.value();
    achieved[1] = mixed.achieved.roll.value();
    achieved[2] = mixed.achieved.pitch.value();
    achieved[3] = mixed.achieved.yaw.value();
  }
  return mixed.concessions.bits();
}

int kphi_factor_build(kphi_factor* out, kphi_real mass, kphi_real period_s, kphi_real memory_s, kphi_real flown_error) {
  const auto built = ThrustFactor::build({mass, Seconds(period_s), Seconds(memory_s), flown_error});
  if (built) new (out->state) ThrustFactor(*built);
  return built ? 1 : 0;
}

void kphi_factor_update(kphi_factor* factor, kphi_real specific_force, kphi_real told_n) {
  of(factor).update(specific_force, Newtons(told_n));
}

int kphi_factor_estimate(const kphi_factor* factor, kphi_real* value, kphi_real* u) {
  const ThrustFactor::Estimate estimate = of(factor).estimate();
  *value = estimate.factor;
  *u = estimate.u;
  return (estimate.known ? KPHI_FACTOR_KNOWN : 0) + (estimate.wrong ? KPHI_FACTOR_WRONG : 0);
}

void kphi_factor_counts(const kphi_factor* factor, unsigned* used, unsigned* left_out) {
  if (used != nullptr) *used = of(factor).used();
  if (left_out != nullptr) *left_out = of(factor).left_out();
}

}  // extern "C"
