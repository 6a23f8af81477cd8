// Seeded noise: random numbers that are the same on every machine (the standard's generators are, its distributions are
// not), and the estimate of position and velocity that the controller gets.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>

#include "base/random.hpp"
#include "compensation/flight/plant.hpp"

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

}  // namespace kphi::flight
