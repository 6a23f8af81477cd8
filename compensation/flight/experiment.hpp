// The paper's nine experiments as a table: a path, and legs of one shape each, compensated or not.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "compensation/flight/simulated_vehicle.hpp"

namespace kphi::flight {

enum class Path : std::uint8_t { hover, level_circle, rising_circle };

inline constexpr double kHeight = 1.5;        // m
inline constexpr double kCircleRadius = 1.5;  // m
inline constexpr double kCircleSpeed = 0.6;   // m/s, in the plane
inline constexpr double kHeightSwing = 0.25;  // m: 1.25 to 1.75 m, once a lap
inline constexpr double kLapSeconds = 2 * kPi * kCircleRadius / kCircleSpeed;

/// Where the drone should be: in one place, or on one of the paper's circles.
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

/// One shape, compensated or not. The arms begin to move and the switch is thrown when the leg begins.
struct Leg {
  Shape shape;
  bool compensated;
};

struct Experiment {
  std::string_view name;
  std::string_view title;
  Path path;
  std::array<Leg, 3> legs;
  std::size_t leg_count;
};

inline constexpr double kHoverLegSeconds = 10;
inline constexpr double kHoverMeanSeconds = 4;     ///< the last seconds of a leg that are averaged
inline constexpr double kCircleSettleSeconds = 3;  ///< left out after a change; then one lap counts

[[nodiscard]] constexpr double leg_seconds(Path path) noexcept {
  return path == Path::hover ? kHoverLegSeconds : kCircleSettleSeconds + kLapSeconds;
}
[[nodiscard]] constexpr double settle_seconds(Path path) noexcept {
  return path == Path::hover ? kHoverLegSeconds - kHoverMeanSeconds : kCircleSettleSeconds;
}

inline constexpr Leg kX{Shape::x, false};
inline constexpr Leg kXCompensated{Shape::x, true};
inline constexpr Leg kO{Shape::o, false};
inline constexpr Leg kOCompensated{Shape::o, true};

/// Indices into kExperiments.
enum ExperimentIndex : std::size_t {
  kHoverPlain,
  kHoverCompensated,
  kHoverSwitched,
  kLevelPlain,
  kLevelSwitched,
  kLevelCompensated,
  kRisingPlain,
  kRisingSwitched,
  kRisingCompensated,
};

inline constexpr std::array<Experiment, 9> kExperiments{{
    {"hover_xo_nc", "hover: X, O n.c., X", Path::hover, {kX, kO, kX}, 3},
    {"hover_xo_c", "hover: X, O c., X", Path::hover, {kXCompensated, kOCompensated, kXCompensated}, 3},
    {"hover_o_switched", "hover: O c., O n.c., O c.", Path::hover, {kOCompensated, kO, kOCompensated}, 3},
    {"level_xo_nc", "level circle: X, O n.c.", Path::level_circle, {kX, kO}, 2},
    {"level_o_switched", "level circle: O n.c., O c.", Path::level_circle, {kO, kOCompensated}, 2},
    {"level_xo_c", "level circle: X, O c.", Path::level_circle, {kXCompensated, kOCompensated}, 2},
    {"rising_xo_nc", "rising circle: X, O n.c.", Path::rising_circle, {kX, kO}, 2},
    {"rising_o_switched", "rising circle: O n.c., O c.", Path::rising_circle, {kO, kOCompensated}, 2},
    {"rising_xo_c", "rising circle: X, O c.", Path::rising_circle, {kXCompensated, kOCompensated}, 2},
}};

}  // namespace kphi::flight
