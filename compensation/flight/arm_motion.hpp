// How the servos carry the arms from one shape to the next: a minimum-jerk course, all four arms at once.
#pragma once

#include <array>

#include "compensation/flight/vehicle.hpp"

namespace kphi::flight {

class ArmMotion {
 public:
  /// At rest. From one shape to the next it takes `seconds`, above 0.
  ArmMotion(const Angles& at, double seconds) noexcept : from_(at), to_(at), seconds_(seconds), began_(-seconds) {}

  /// From where the arms are at `now` [s], at rest, to `to`.
  void begin(const Angles& to, double now) noexcept {
    from_ = angles(now);
    to_ = to;
    began_ = now;
  }
  [[nodiscard]] bool moving(double now) const noexcept { return now < began_ + seconds_; }
  [[nodiscard]] Angles angles(double now) const noexcept {
    if (!moving(now)) return to_;
    const double s = (now - began_) / seconds_;
    const double share = s * s * s * (10 + s * (6 * s - 15));
    Angles at = from_;
    for (std::size_t i = 0; i < at.size(); ++i) at[i] = at[i] + share * (to_[i] - from_[i]);
    return at;
  }
  /// rad/s
  [[nodiscard]] std::array<double, 4> rates(double now) const noexcept {
    std::array<double, 4> found{};
    if (!moving(now)) return found;
    const double s = (now - began_) / seconds_;
    const double slope = 30 * s * s * (1 - s) * (1 - s) / seconds_;
    for (std::size_t i = 0; i < found.size(); ++i) found[i] = slope * (to_[i] - from_[i]).value();
    return found;
  }

 private:
  Angles from_;
  Angles to_;
  double seconds_;
  double began_;
};

}  // namespace kphi::flight
