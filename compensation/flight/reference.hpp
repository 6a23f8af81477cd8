// Where the drone is told to be: in one place, or on the paper's circles.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>

#include "compensation/units.hpp"

namespace kphi::flight {

enum class Path : std::uint8_t { hover, level_circle, rising_circle };

inline constexpr double kHeight = 1.5;        // m
inline constexpr double kCircleRadius = 1.5;  // m
inline constexpr double kCircleSpeed = 0.6;   // m/s, in the plane
inline constexpr double kHeightSwing = 0.25;  // m: 1.25 to 1.75 m, once a lap
inline constexpr double kLapSeconds = 2 * kPi * kCircleRadius / kCircleSpeed;

struct Reference {
  Eigen::Vector3d position{0, 0, kHeight};
  Eigen::Vector3d velocity{0, 0, 0};
  Eigen::Vector3d acceleration{0, 0, 0};
  Eigen::Vector3d jerk{0, 0, 0};
};

/// Yaw is always 0.
[[nodiscard]] inline Reference reference_at(Path path, double seconds) noexcept {
  Reference wanted;
  if (path == Path::hover) return wanted;
  const double turn_rate = kCircleSpeed / kCircleRadius;
  const double swing = path == Path::rising_circle ? kHeightSwing : 0.0;
  const double c = std::cos(turn_rate * seconds), s = std::sin(turn_rate * seconds);
  wanted.position = Eigen::Vector3d(kCircleRadius * c, kCircleRadius * s, kHeight + swing * s);
  wanted.velocity = turn_rate * Eigen::Vector3d(-kCircleRadius * s, kCircleRadius * c, swing * c);
  wanted.acceleration = -turn_rate * turn_rate * Eigen::Vector3d(kCircleRadius * c, kCircleRadius * s, swing * s);
  wanted.jerk = -turn_rate * turn_rate * wanted.velocity;
  return wanted;
}

}  // namespace kphi::flight
