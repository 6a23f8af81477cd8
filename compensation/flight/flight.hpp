// One experiment flown: the loop of world, estimator and pilot, and what is measured of each leg. The estimate of
// position and velocity that the controller gets has a seeded noise, with random numbers that are the same on every
// machine (the standard's generators are, its distributions are not).
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "base/random.hpp"
#include "compensation/flight/experiment.hpp"
#include "compensation/flight/pilot.hpp"

namespace kphi::flight {

/// SplitMix64 with Box and Muller's normal numbers.
class Random {
 public:
  explicit Random(std::uint64_t seed) noexcept : draw_(seed) {}
  /// Of stream `stream` of `seed`: no stream depends on how many numbers another one took.
  Random(std::uint64_t seed, std::uint64_t stream) noexcept
      : draw_(SplitMix64(seed)() ^ (stream * SplitMix64::kGamma + SplitMix64::kGamma)) {}

  [[nodiscard]] std::uint64_t bits() noexcept { return draw_(); }
  /// In [from, to).
  [[nodiscard]] double uniform(double from, double to) noexcept {
    return from + (to - from) * static_cast<double>(bits() >> 11) * 0x1p-53;
  }
  [[nodiscard]] double normal(double mean, double deviation) noexcept {
    if (spare_) {
      spare_ = false;
      return mean + deviation * spare_value_;
    }
    const double radius = std::sqrt(-2 * std::log(1 - uniform(0, 1))), angle = uniform(0, 2 * kPi);
    spare_ = true;
    spare_value_ = radius * std::sin(angle);
    return mean + deviation * radius * std::cos(angle);
  }

 private:
  SplitMix64 draw_;
  double spare_value_ = 0;
  bool spare_ = false;
};

struct EstimatorNoise {
  double position = 0.008;       ///< m, standard deviation per axis
  double position_memory = 1.0;  ///< s
  double velocity = 0.03;        ///< m/s
  double velocity_memory = 0.2;  ///< s
};

/// The truth, and a noise that wanders (Ornstein and Uhlenbeck).
class Estimator {
 public:
  /// Begins with a noise of its stationary distribution.
  Estimator(const EstimatorNoise& noise, double period, Random random) noexcept
      : noise_(noise),
        position_keep_(std::exp(-period / noise.position_memory)),
        velocity_keep_(std::exp(-period / noise.velocity_memory)),
        random_(random) {
    for (Eigen::Index i = 0; i < 3; ++i) {
      position_[i] = random_.normal(0, noise.position);
      velocity_[i] = random_.normal(0, noise.velocity);
    }
  }

  /// Once per period.
  [[nodiscard]] BodyMotion estimate(const BodyMotion& truth) noexcept {
    for (Eigen::Index i = 0; i < 3; ++i) {
      position_[i] = wander(position_[i], position_keep_, noise_.position);
      velocity_[i] = wander(velocity_[i], velocity_keep_, noise_.velocity);
    }
    return {truth.position + position_, truth.velocity + velocity_};
  }

 private:
  [[nodiscard]] double wander(double from, double keep, double deviation) noexcept {
    return keep * from + random_.normal(0, deviation * std::sqrt(1 - keep * keep));
  }

  EstimatorNoise noise_;
  double position_keep_;
  double velocity_keep_;
  Random random_;
  Eigen::Vector3d position_{0, 0, 0};
  Eigen::Vector3d velocity_{0, 0, 0};
};

/// All that one flight depends on.
struct Scene {
  Vehicle vehicle;
  /// Of the coefficient files; their K_T are those of rotors without error.
  compensation::Rotors<compensation::ThrustCurve> curves;
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
  Eigen::Vector3d reference, estimate, truth;  ///< m
  Eigen::Vector3d rotation;                    ///< roll, pitch, yaw [rad]
  bool on_ways = false;                        ///< arms are no angles but shares of a way, as in Angles
  Rotors<double> arms, arms_told;              ///< rad, or shares: where the hubs are, and what the controller was told
  Rotors<double> occlusions,
      occlusions_believed;                ///< rad: φ by the rim arc as it is, and as the controller knows it
  Rotors<double> scaling;                 ///< k_i
  Rotors<double> thrusts_asked, thrusts;  ///< N: of the mixer, and of the rotors
  Rotors<double> speeds_asked, speeds;    ///< rad/s
};

/// Throws std::invalid_argument if the pilot cannot be built for the vehicle. Allocates nothing while it flies unless
/// `trace` is given.
[[nodiscard]] FlightResult fly(const Experiment& experiment, const Scene& scene, const Shadow& shadow,
                               std::vector<TraceRow>* trace = nullptr);

}  // namespace kphi::flight
