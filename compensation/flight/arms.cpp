#include "compensation/flight/arms.hpp"

#include <algorithm>
#include <cmath>

namespace kphi::flight {
namespace {

constexpr double kThere = 1e-9;  // rad

}  // namespace

Arms::Arms(const Angles& at, double morph_s, const ArmHardware& hardware, double step) noexcept
    : hardware_(hardware), command_(at, morph_s), goal_(at), servos_(at), hubs_(at), rates_(at.size()) {
  told_.fill(at);
  const double late = std::clamp(hardware.feedback_delay_s, 0.0, kLongestDelay) / step;
  late_ = std::min(static_cast<std::size_t>(std::lround(late)), told_.size() - 1);
}

void Arms::begin(const Angles& goal) noexcept {
  goal_ = goal;
  command_.begin(goal, now_);
  moving_ = true;
}

void Arms::advance(double to) noexcept {
  if (!moving_) {
    now_ = to;
    return;
  }
  const Angles middle = command_.angles((now_ + to) / 2), end = command_.angles(to);
  const Rotors<double> rates = command_.rates(to);
  const double keep = hardware_.lag_s > 0 ? std::exp(-(to - now_) / hardware_.lag_s) : 0.0;
  bool there = !command_.moving(to);
  for (std::size_t i = 0; i < servos_.size(); ++i) {
    const bool lags = hardware_.lag_s > 0;
    servos_[i] = lags ? middle[i] + keep * (servos_[i] - middle[i]) : end[i];
    there = there && std::fabs((servos_[i] - goal_[i]).value()) < kThere;
    const double rate = lags ? (end[i] - servos_[i]).value() / hardware_.lag_s : rates[i];
    const Radians play(hardware_.backlash / 2);
    const Radians pushed = std::clamp(hubs_[i], servos_[i] - play, servos_[i] + play);
    rates_[i] = play.value() > 0 && pushed == hubs_[i] ? 0.0 : rate;
    hubs_[i] = pushed;
  }
  now_ = to;
  if (!there) return;
  moving_ = false;
  rates_ = Rotors<double>(rates_.size());
}

Angles Arms::tell() noexcept {
  told_[next_] = servos_;
  const Angles& then = told_[(next_ + told_.size() - late_) % told_.size()];
  next_ = (next_ + 1) % told_.size();
  return then;
}

}  // namespace kphi::flight
