// The default vehicle, and a line as a bench finds it: a little off the paper's.
#pragma once

#include "compensation/flight/draw.hpp"
#include "test/compensation/example_vehicle.hpp"

namespace kphi::flight {

inline Vehicle example_vehicle() {
  Vehicle vehicle;
  vehicle.airframe = compensation::example_airframe();
  vehicle.x = compensation::shape_x();
  vehicle.o = compensation::shape_o();
  return vehicle;
}

inline const Shadow& example_shadow() {
  static const Shadow shadow(compensation::example_airframe());
  return shadow;
}

inline compensation::ThrustLine bench_line() { return compensation::example_line(1.025, -0.0028889 * 1.02); }

inline Scene example_scene(std::uint64_t seed = 1) { return nominal_scene(example_vehicle(), bench_line(), seed); }

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
