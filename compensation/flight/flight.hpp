// One experiment flown: the loop of world, estimator and pilot, and what is measured of each leg.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "compensation/flight/experiment.hpp"
#include "compensation/flight/noise.hpp"
#include "compensation/flight/pilot.hpp"

namespace kphi::flight {

/// All that one flight depends on.
struct Scene {
  Vehicle vehicle;
  compensation::ThrustCurve curve;  ///< of the coefficient file; its K_T is that of a rotor without error
  Truth truth;
  EstimatorNoise noise;
  PilotSettings pilot;
  std::uint64_t seed = 1;  ///< of the estimator's noise
};

/// Errors are reference − estimate, as the paper's.
struct LegResult {
  Eigen::Vector3d mean_error{0, 0, 0};       ///< m
  Eigen::Vector3d mean_error_rate{0, 0, 0};  ///< m/s
  double mean_distance = 0;                  ///< m: μ of Table III
  double deviation = 0;                      ///< m: σ of Table III
  double mean_square_speed = 0;              ///< (rad/s)²: mean over the rotors
  double fastest = 0;                        ///< rad/s
};

struct FlightResult {
  std::array<LegResult, 3> legs;
  std::size_t leg_count = 0;
  bool lost = false;         ///< more than 1 m from the reference, or tilted beyond 90°: flown no further
  std::size_t lost_leg = 0;  ///< in which leg; it and those after it are not valid
  int concessions = 0;       ///< steps in which the mixer had to give something up
};

/// Every 10 ms.
struct TraceRow {
  double time;  ///< s
  std::size_t leg;
  Eigen::Vector3d reference, estimate, truth;                              ///< m
  Eigen::Vector3d rotation;                                                ///< roll, pitch, yaw [rad]
  std::array<double, 4> arm_angles, occlusions, scaling, thrusts, speeds;  ///< rad, rad, 1, N, rad/s
};

/// Throws std::invalid_argument if the pilot cannot be built for the vehicle. Allocates nothing while it flies unless
/// `trace` is given.
[[nodiscard]] FlightResult fly(const Experiment& experiment, const Scene& scene, const Shadow& shadow,
                               std::vector<TraceRow>* trace = nullptr);

}  // namespace kphi::flight
