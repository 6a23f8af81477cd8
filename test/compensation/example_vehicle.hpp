// The default vehicle and the paper's line, as the tests use them.
#pragma once

#include <array>
#include <cmath>

#include "compensation/compensator.hpp"
#include "compensation/mixing.hpp"
#include "test/compensation/line_of.hpp"
#include "test/compensation/odd_numbers.hpp"

namespace kphi::compensation {

inline Position at(double x, double y) { return {Metres(x), Metres(y)}; }

inline ConvexPolygon regular_polygon(std::size_t count, double circumradius, double turned = 0.0) {
  std::array<Position, ConvexPolygon::kMaxCorners> corners;
  for (std::size_t i = 0; i < count; ++i) {
    const double angle = turned + 2 * kPi * static_cast<double>(i) / static_cast<double>(count);
    corners[i] = at(circumradius * std::cos(angle), circumradius * std::sin(angle));
  }
  return *ConvexPolygon::from(corners.data(), count);
}

/// Five inches, three blades.
inline const ThrustCoefficient kExampleCoefficient = from_newtons_per_rpm2(1.7e-8);

/// A line given in units of K_T, slope per degree.
inline ThrustCurve example_line(double intercept, double slope_per_deg, double largest_fitted_deg = 270) {
  const double slope_per_rad = slope_per_deg * 180 / kPi * kExampleCoefficient.value();
  return *ThrustCurve::from_line(kExampleCoefficient, kExampleCoefficient * intercept, slope_per_rad,
                                 from_degrees(largest_fitted_deg));
}

/// Through (45°, 0.90) and (270°, 0.25); fitted on sector plates, where the measures agree, so flown by any of them.
inline std::optional<ThrustCurve> paper_line_if(OverlapMeasure measure, const std::optional<LineUncertainty>& u) {
  const ThrustCurve line = example_line(1.03, -0.0028889);
  return ThrustCurve::from_line(line.thrust_coefficient(), line_of(line).intercept, line_of(line).slope_per_rad,
                                line.largest_fitted(), measure, u);
}
inline ThrustCurve paper_line(OverlapMeasure measure = OverlapMeasure::rim_arc) {
  return *paper_line_if(measure, std::nullopt);
}

/// Bent as no line is, in units of K_T; `error` of every k.
inline ThrustCurve example_table(double error = kInfinity) {
  const double k_t = kExampleCoefficient.value();
  const Knot knots[] = {{Radians(0), k_t, error * k_t},
                        {from_degrees(45), 0.96 * k_t, error * k_t},
                        {from_degrees(90), 0.83 * k_t, error * k_t},
                        {from_degrees(180), 0.40 * k_t, error * k_t},
                        {from_degrees(270), 0.25 * k_t, error * k_t}};
  return *ThrustCurve::from_table(*OcclusionTable::from(knots, 5), from_degrees(270));
}

inline Airframe example_airframe(OverlapMeasure measure = OverlapMeasure::rim_arc) {
  Airframe airframe;
  airframe.half_side = Metres(0.045);
  airframe.arm_length = Metres(0.117);
  airframe.propeller_radius = Metres(0.0635);
  airframe.fastest_speed = from_rpm(19100);
  airframe.overlap = measure;
  return airframe;
}

inline Airframe example_airframe_of(double half_side, double arm_length, double propeller_radius) {
  Airframe airframe = example_airframe();
  airframe.half_side = Metres(half_side);
  airframe.arm_length = Metres(arm_length);
  airframe.propeller_radius = Metres(propeller_radius);
  return airframe;
}

/// A square as an outline like any other, each arm hinged at its corner.
inline PolygonBody square_as_polygon(Metres half_side) {
  PolygonBody body{ConvexPolygon::square(half_side), Rotors<Hinge>(4)};
  for (std::size_t i = 0; i < 4; ++i) {
    body.hinges[i] = {body.outline.corner(i), Radians(kPi / 2 * static_cast<double>(i)), false};
  }
  return body;
}

/// Four rotors with this line.
inline BuildOutcome build_with(const ThrustCurve& line, const Airframe& airframe = example_airframe(),
                               ScalingLaw law = ScalingLaw::clamped) {
  return Compensator::build({line, line, line, line}, airframe, law);
}
inline Compensator compensator_of(const Airframe& airframe, ScalingLaw law = ScalingLaw::clamped) {
  return build_with(paper_line(airframe.overlap), airframe, law).compensator.value();
}
inline Compensator example_compensator(ScalingLaw law = ScalingLaw::clamped) {
  return compensator_of(example_airframe(), law);
}

inline std::array<Radians, 4> arms_at(double a, double b, double c, double d) {
  return {from_degrees(a), from_degrees(b), from_degrees(c), from_degrees(d)};
}
inline std::array<Radians, 4> all_at(double degrees) { return arms_at(degrees, degrees, degrees, degrees); }
inline std::array<Radians, 4> shape_x() { return all_at(45); }
inline std::array<Radians, 4> shape_h() { return arms_at(0, 90, 0, 90); }
inline std::array<Radians, 4> shape_t() { return arms_at(90, 0, 0, 90); }
inline std::array<Radians, 4> shape_o() { return arms_at(180, 180, 180 - 0.25 * 180 / kPi, 180); }

inline Compensator with_arms(const std::array<Radians, 4>& arms, Compensator compensator = example_compensator()) {
  compensator.set_arms(arms);
  return compensator;
}

/// The hubs as seen from the middle of the body.
inline RotorLayout example_layout(const std::array<Radians, 4>& arms) {
  RotorLayout layout{Rotors<HubPosition>(4), {1, -1, 1, -1}};
  for (std::size_t i = 0; i < 4; ++i) layout.hubs[i] = hub_in_body(example_airframe(), i, arms[i]);
  return layout;
}

inline std::array<Newtons, 4> thrusts_of(double a, double b, double c, double d) {
  return {Newtons(a), Newtons(b), Newtons(c), Newtons(d)};
}

}  // namespace kphi::compensation
