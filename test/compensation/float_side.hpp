// The library compiled in float, behind plain numbers, so that a test can hold it against the one in double.
#pragma once

#include <cstdint>

namespace kphi::test {

/// A vehicle on a square body, its shape, and what is demanded; [SI].
struct Vehicle {
  float half_side, arm_length, propeller_radius, fastest_speed;
  float thrust_coefficient, intercept, slope_per_rad;
  bool table;
  float knots[4];        ///< of a table, at 45, 90, 180 and 270 degrees, as shares of K_T
  float trend;           ///< of k with the speed, up to the fastest
  float torque_covered;  ///< share of the drag torque at 270 degrees
  int overlap, law;
  float arms[4];
  float demand[4];  ///< thrust, roll, pitch, yaw
  float assured_yaw;
};

struct Flown {
  bool built;
  float speeds[4], thrusts[4], occlusions[4], thrust_max[4], achieved[4];
  std::uint16_t flags[4], concessions;
};

/// Builds, sets the arms, mixes for hubs about a centre of gravity of four equal masses, and asks for the speeds.
[[gnu::visibility("default")]] Flown flown_in_float(const Vehicle& vehicle);

/// A vehicle of 3 to 8 rotors by itself, what is demanded of its mixer, and what it made of that in float; [SI].
struct Mixed {
  int rotors;
  float hubs[8][2], drag_scale[8], smallest[8], largest[8];
  int spins[8];
  float per_newton, per_square_newton, demand[4], assured_yaw;
  bool built;
  float thrusts[8], achieved[4];
  unsigned concessions;
};

/// The next of arm/demands.hpp after `state`. `curved`: torque per thrust depends on the thrust.
[[gnu::visibility("default")]] Mixed mixed_in_float(std::uint32_t& state, bool curved);

}  // namespace kphi::test
