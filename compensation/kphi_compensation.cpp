#include "compensation/kphi_compensation.h"

#include <cstddef>
#include <new>

#include "compensation/compensator.hpp"
#include "compensation/mixing.hpp"

namespace {

using namespace kphi;
using namespace kphi::compensation;

static_assert(sizeof(Compensator) <= sizeof(kphi_compensator) && alignof(Compensator) <= alignof(kphi_compensator));
static_assert(sizeof(Mixer) <= sizeof(kphi_mixer) && alignof(Mixer) <= alignof(kphi_mixer));
static_assert(KPHI_MAX_CORNERS == ConvexPolygon::kMaxCorners);
static_assert(KPHI_AT_CEILING == static_cast<int>(Flag::at_ceiling) &&
              KPHI_THRUST_NAN == static_cast<int>(Flag::thrust_nan));
static_assert(KPHI_LOAD_SHARE == static_cast<int>(OverlapMeasure::load_share));
static_assert(KPHI_DEMAND_NAN == static_cast<int>(Concession::demand_nan));
static_assert(KPHI_LAW_PUBLISHED == static_cast<int>(ScalingLaw::published));

/// Codes of kphi_compensator_build beyond those of Refusal; kphi_refusal_text has their words in the same order.
enum MoreRefusals : int { kBadLine = 100, kBadOutline, kBadLaw, kBadOverlap };

Compensator& of(kphi_compensator* c) noexcept { return *std::launder(reinterpret_cast<Compensator*>(c->state)); }
const Compensator& of(const kphi_compensator* c) noexcept {
  return *std::launder(reinterpret_cast<const Compensator*>(c->state));
}
Mixer& of(kphi_mixer* m) noexcept { return *std::launder(reinterpret_cast<Mixer*>(m->state)); }
const Mixer& of(const kphi_mixer* m) noexcept { return *std::launder(reinterpret_cast<const Mixer*>(m->state)); }

template <class Unit>
std::array<Quantity<Unit>, 4> four(const double values[4]) noexcept {
  return {Quantity<Unit>(values[0]), Quantity<Unit>(values[1]), Quantity<Unit>(values[2]), Quantity<Unit>(values[3])};
}

template <class Unit>
void hand_out(const std::array<Quantity<Unit>, 4>& from, double to[4]) noexcept {
  for (std::size_t i = 0; i < 4; ++i) to[i] = from[i].value();
}
void hand_out(const std::array<double, 4>& from, double to[4]) noexcept {
  for (std::size_t i = 0; i < 4; ++i) to[i] = from[i];
}

std::optional<OverlapMeasure> measure_of(int code) noexcept {
  if (code < KPHI_RIM_ARC || code > KPHI_LOAD_SHARE) return std::nullopt;
  return static_cast<OverlapMeasure>(code);
}

std::optional<ThrustCurve> curve_of(const kphi_line& line) noexcept {
  const auto overlap = measure_of(line.overlap);
  if (!overlap) return std::nullopt;
  std::optional<LineUncertainty> uncertainty;
  if (line.has_uncertainty != 0) {
    uncertainty =
        LineUncertainty{line.thrust_coefficient_error, line.intercept_variance, line.covariance, line.slope_variance};
  }
  return ThrustCurve::from_line(ThrustCoefficient(line.thrust_coefficient), ThrustCoefficient(line.intercept),
                                line.slope_per_rad, Radians(line.largest_fitted_rad), *overlap, uncertainty);
}

std::optional<PolygonBody> body_of(const kphi_airframe& airframe) noexcept {
  if (airframe.corner_count < 0 || airframe.corner_count > KPHI_MAX_CORNERS) return std::nullopt;
  Position corners[KPHI_MAX_CORNERS];
  const auto count = static_cast<std::size_t>(airframe.corner_count);
  for (std::size_t i = 0; i < count; ++i) corners[i] = {Metres(airframe.corners[i][0]), Metres(airframe.corners[i][1])};
  const auto outline = ConvexPolygon::from(corners, count);
  if (!outline) return std::nullopt;
  PolygonBody body{*outline, {}};
  for (std::size_t i = 0; i < 4; ++i) {
    body.hinges[i] = {{Metres(airframe.hinges[i][0]), Metres(airframe.hinges[i][1])},
                      Radians(airframe.hinge_turn_rad[i]),
                      airframe.mirrored[i] != 0};
  }
  return body;
}

RotorLayout layout_of(const double hubs[4][2], const int spins[4]) noexcept {
  RotorLayout layout;
  for (std::size_t i = 0; i < 4; ++i) {
    layout.hubs[i] = {Metres(hubs[i][0]), Metres(hubs[i][1])};
    layout.spins[i] = spins[i];
  }
  return layout;
}

}  // namespace

extern "C" {

int kphi_compensator_build(kphi_compensator* out, const kphi_line lines[4], const kphi_airframe* airframe, int law) {
  if (law != KPHI_LAW_CLAMPED && law != KPHI_LAW_PUBLISHED) return kBadLaw;
  const auto overlap = measure_of(airframe->overlap);
  if (!overlap) return kBadOverlap;
  Airframe frame{Metres(airframe->half_side), Metres(airframe->arm_length), Metres(airframe->propeller_radius),
                 RadPerSec(airframe->slowest_speed), RadPerSec(airframe->fastest_speed)};
  frame.overlap = *overlap;
  for (std::size_t i = 0; i < 4; ++i) {
    frame.hinge_turns[i] = airframe->hinge_turns[i];
    frame.mirrored[i] = airframe->mirrored[i] != 0;
  }
  if (airframe->corner_count != 0) {
    frame.polygon = body_of(*airframe);
    if (!frame.polygon) return kBadOutline;
  }
  const std::optional<ThrustCurve> made[4] = {curve_of(lines[0]), curve_of(lines[1]), curve_of(lines[2]),
                                              curve_of(lines[3])};
  if (!made[0] || !made[1] || !made[2] || !made[3]) return kBadLine;
  const BuildOutcome outcome =
      Compensator::build({*made[0], *made[1], *made[2], *made[3]}, frame, static_cast<ScalingLaw>(law));
  if (!outcome.compensator) return static_cast<int>(outcome.refusal);
  ::new (out->state) Compensator(*outcome.compensator);
  return 0;
}

const char* kphi_refusal_text(int refusal) {
  static constexpr const char* kMore[] = {
      "a line needs K_T > 0, intercept > 0, a finite slope, a largest angle in (0, 2 pi], a known overlap measure, and "
      "variances that are not negative",
      "the body must have 3 to 12 corners, finite, counter-clockwise and convex",
      "the law is neither KPHI_LAW_CLAMPED nor KPHI_LAW_PUBLISHED",
      "the airframe's overlap measure is none of KPHI_RIM_ARC, KPHI_AREA_SHARE, KPHI_LOAD_SHARE"};
  if (refusal >= kBadLine && refusal < kBadLine + static_cast<int>(std::size(kMore))) return kMore[refusal - kBadLine];
  const bool known = refusal >= 0 && refusal <= static_cast<int>(Refusal::overlap);
  return known ? describe(static_cast<Refusal>(refusal)) : "unknown refusal";
}

void kphi_set_arms(kphi_compensator* compensator, const double arm_angles_rad[4]) {
  of(compensator).set_arms(four<RadianUnit>(arm_angles_rad));
}

void kphi_speeds_for(const kphi_compensator* compensator, const double thrusts_n[4], double speeds_rad_s[4],
                     unsigned char flags[4]) {
  const SpeedCommand command = of(compensator).speeds_for(four<NewtonUnit>(thrusts_n));
  hand_out(command.speeds, speeds_rad_s);
  if (flags == nullptr) return;
  for (std::size_t i = 0; i < 4; ++i) flags[i] = command.flags[i].bits();
}

void kphi_enable(kphi_compensator* compensator, int on) { of(compensator).enable(on != 0); }

void kphi_occlusion_angles(const kphi_compensator* compensator, double angles_rad[4]) {
  hand_out(of(compensator).occlusion_angles(), angles_rad);
}

void kphi_scaling_factors(const kphi_compensator* compensator, double factors[4]) {
  hand_out(of(compensator).scaling_factors(), factors);
}

void kphi_thrust_max(const kphi_compensator* compensator, double thrusts_n[4]) {
  hand_out(of(compensator).thrust_max(), thrusts_n);
}

void kphi_drag_scale(const kphi_compensator* compensator, double scales[4]) {
  hand_out(of(compensator).drag_scale(), scales);
}

void kphi_speed_uncertainties(const kphi_compensator* compensator, const double thrusts_n[4],
                              double arm_angle_uncertainty_rad, double uncertainties_rad_s[4]) {
  hand_out(of(compensator).speed_uncertainties(four<NewtonUnit>(thrusts_n), Radians(arm_angle_uncertainty_rad)),
           uncertainties_rad_s);
}

int kphi_mixer_build(kphi_mixer* out, const double hubs[4][2], const int spins[4], double drag_per_newton,
                     double drag_per_square_newton) {
  const auto mixer = Mixer::build(layout_of(hubs, spins), {Metres(drag_per_newton), drag_per_square_newton});
  if (!mixer) return 0;
  ::new (out->state) Mixer(*mixer);
  return 1;
}

int kphi_mixer_set_layout(kphi_mixer* mixer, const double hubs[4][2], const int spins[4], const double drag_scale[4]) {
  return of(mixer).set_layout(layout_of(hubs, spins), {drag_scale[0], drag_scale[1], drag_scale[2], drag_scale[3]}) ? 1
                                                                                                                    : 0;
}

int kphi_mix(const kphi_mixer* mixer, const double wrench[4], const double smallest_n[4], const double largest_n[4],
             double assured_yaw, double thrusts_n[4], double achieved[4]) {
  const MixedThrusts mixed =
      of(mixer).mix({Newtons(wrench[0]), NewtonMetres(wrench[1]), NewtonMetres(wrench[2]), NewtonMetres(wrench[3])},
                    {four<NewtonUnit>(smallest_n), four<NewtonUnit>(largest_n)}, NewtonMetres(assured_yaw));
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
