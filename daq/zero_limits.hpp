// When a zero of the load cell, or the pair of them about a run, can be trusted.
#pragma once

#include <algorithm>

namespace kphi::daq {

/// Deviation of one unfiltered record of the cell at rest.
inline constexpr double kRestForce = 0.03;     ///< N
inline constexpr double kRestTorque = 0.0009;  ///< N m

/// Deviation of one record above which the cell was not at rest while its zero was taken, N.
inline constexpr double kNoisyZero = 5 * kRestForce;

inline constexpr const char* kZeroNextMove = "let the stand come to rest, keep hands and wind off, and try again";

/// How far the zeros before and after a run may differ, N.
[[nodiscard]] inline double tolerated_drift(double largest_thrust_n) {
  return std::max(0.005 * largest_thrust_n, 0.02);
}

}  // namespace kphi::daq
