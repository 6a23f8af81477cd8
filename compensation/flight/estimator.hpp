// What the controller is told of position and velocity: the truth and a noise that wanders (Ornstein and Uhlenbeck).
#pragma once

#include <Eigen/Core>
#include <cmath>

#include "compensation/flight/plant.hpp"
#include "compensation/flight/random.hpp"

namespace kphi::flight {

struct EstimatorNoise {
  double position = 0.008;       ///< m, standard deviation per axis
  double position_memory = 1.0;  ///< s
  double velocity = 0.03;        ///< m/s
  double velocity_memory = 0.2;  ///< s
};

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
