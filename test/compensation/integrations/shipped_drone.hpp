// The shipped drone for the integrations in float: profiles/foldable_drone.yaml, every rotor with the paper's line.
#pragma once

#include "compensation/kphi_compensation.h"

namespace shipped_drone {

constexpr float kPi = 3.14159265F, kDrag = 0.0133F, kFastest = 2000.0F, kCoefficient = 1.55e-6F;
constexpr float kFull = kCoefficient * kFastest * kFastest;
constexpr float kX[4] = {kPi / 4, kPi / 4, kPi / 4, kPi / 4}, kO[4] = {kPi, kPi, kPi - 0.25F, kPi}, kStill[4] = {};

/// What the vehicles of all integrations have under the same names.
template <class Vehicle>
Vehicle with_shipped_drone() {
  Vehicle made{};
  made.airframe.half_side = 0.045F;
  made.airframe.arm_length = 0.117F;
  made.airframe.propeller_radius = 0.0635F;
  made.airframe.fastest_speed = kFastest;
  made.masses.body = 0.42F;
  kphi_curve line{};
  line.thrust_coefficient = kCoefficient;
  line.intercept = 1.03F * kCoefficient;
  line.slope_per_rad = -0.1655F * kCoefficient;
  line.largest_fitted_rad = 4.7F;
  line.overlap = KPHI_RIM_ARC;
  for (int i = 0; i < 4; ++i) {
    made.airframe.hinge_turns[i] = i;
    made.masses.at_hubs[i] = 0.045F;
    made.spins[i] = i % 2 == 0 ? 1 : -1;
    made.curves[i] = line;
  }
  return made;
}

}  // namespace shipped_drone
