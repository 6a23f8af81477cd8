// The foldable drone and its controller, and a line as a bench finds it: a little off the paper's.
#pragma once

#include "compensation/flight/study.hpp"
#include "test/compensation/example_vehicle.hpp"
#include "test/compensation/line_of.hpp"

namespace kphi::flight {

/// As in profiles/foldable_drone.yaml, which shipped_files_test holds to the same numbers.
inline Build example_build() {
  Build build;
  build.mass_kg = 0.60;
  build.hub_mass_kg = 0.045;
  build.body_height_m = 0.040;
  build.yaw_arm_m = 0.0133;
  build.rotor_lag_s = 0.033;
  build.air_drag_per_s = 0.3;
  build.morph_s = 1.5;
  build.spin = {1, -1, 1, -1};
  return build;
}

inline Gains example_gains() {
  Gains gains;
  gains.position = {6, 6, 15};
  gains.velocity = {4, 4, 6};
  gains.attitude = {8.5, 8.5, 5};
  gains.rate = {12.7, 12.7, 5};
  gains.torque_weight = 0.5;
  gains.position_error_max = {0.6, 0.6, 0.3};
  gains.velocity_error_max = {1.0, 1.0, 0.75};
  gains.smallest_collective = 1.0;
  return gains;
}

inline PilotSettings example_settings() { return {example_gains(), 0.02}; }

inline Vehicle example_vehicle() {
  Vehicle vehicle;
  vehicle.build = example_build();
  vehicle.airframe = compensation::example_airframe();
  vehicle.x = compensation::shape_x();
  vehicle.o = compensation::shape_o();
  return vehicle;
}

inline const Shadow& example_shadow() {
  static const Shadow shadow(example_vehicle());
  return shadow;
}

/// rad/s, of four rotors.
inline RotorSpeeds speeds_of(double a, double b, double c, double d) {
  RotorSpeeds speeds = RotorSpeeds::Zero();
  speeds.head<4>() << a, b, c, d;
  return speeds;
}

inline compensation::ThrustCurve bench_line() { return compensation::example_line(1.025, -0.0028889 * 1.02); }

/// The same curve for each rotor.
inline compensation::Rotors<compensation::ThrustCurve> four(const compensation::ThrustCurve& curve) {
  return {curve, curve, curve, curve};
}

/// The curve with all that it loses against K_T scaled: 0 believes that no occlusion costs anything.
inline compensation::ThrustCurve scaled_loss(const compensation::ThrustCurve& curve, double factor) {
  const ThrustCoefficient k_t = curve.thrust_coefficient();
  return *compensation::ThrustCurve::from_line(k_t, k_t + factor * (compensation::line_of(curve).intercept - k_t),
                                               factor * compensation::line_of(curve).slope_per_rad,
                                               curve.largest_fitted());
}

inline Scene example_scene(std::uint64_t seed = 1) {
  Truth world;
  world.drag = example_vehicle().build.air_drag_per_s;
  world.thrust_coefficient = bench_line().thrust_coefficient();
  world.mass = 1.01;
  world.thrust = {1.01, 0.99, 1.00, 1.01};
  world.cog_error = {1e-3, -0.5e-3};
  return nominal_scene(example_vehicle(), example_settings(), four(bench_line()), world, seed);
}

/// No noise, no error of mass, rotors, arms or centre of gravity, no drag: only the loss is not what the line says.
inline Scene clean_scene() {
  Scene scene = example_scene();
  scene.noise.position = scene.noise.velocity = 0;
  scene.truth.mass = 1;
  scene.truth.thrust = {1, 1, 1, 1};
  scene.truth.cog_error.setZero();
  scene.truth.drag = 0;
  return scene;
}

}  // namespace kphi::flight
