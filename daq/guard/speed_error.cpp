#include "daq/guard/speed_error.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace kphi::daq {

std::string to_words(const SpeedError& error) {
  const double measured = to_rpm(error.measured), commanded = to_rpm(error.commanded), lasts = to_seconds(error.lasts);
  if (error.kind == SpeedError::Kind::strays)
    return fmt::format(
        "motor: speed off target for {:.2g} s: {:.0f} of {:.0f} RPM; check for a blocked rotor, a loose propeller, a "
        "weak supply",
        lasts, measured, commanded);
  if (error.kind == SpeedError::Kind::stalled)
    return fmt::format(
        "motor: the rotor is stalled for {:.2g} s: {:.0f} A at {:.0f} of {:.0f} RPM; check for a blocked rotor", lasts,
        error.motor_current.value(), measured, commanded);
  if (error.kind == SpeedError::Kind::none) return {};
  return fmt::format("motor: no speed reading for {:.2g} s although the module answers; check its line", lasts);
}

void SpeedWatch::command(Instant at, RadPerSec speed) noexcept {
  if (!watching_) {
    low_ = high_ = 0;
    now_ = seen_at_ = at;
  }
  watching_ = true;
  advance(at);
  ramping_ = false;
  commanded_ = speed.value();
}

void SpeedWatch::command_ramp(Instant at, RadPerSec speed) noexcept {
  command(at, speed);
  ramping_ = true;
  low_ = std::min(low_, commanded_);
  high_ = std::max(high_, commanded_);
}

void SpeedWatch::take(const MotorReading& reading) noexcept {
  if (!watching_ || error_.kind != SpeedError::Kind::none) return;
  const Instant at(reading.time_ns);
  if (reading.channel == MotorChannel::speed) {
    speed_ = direction_ * reading.value;
    seen_at_ = std::max(seen_at_, at);
    judge_speed(at);
  } else if (at - seen_at_ > kBlind + host_) {
    found(SpeedError::Kind::unseen, at - seen_at_);
  } else if (reading.channel == MotorChannel::motor_current) {
    current_ = reading.value;
    judge_current(at);
  }
}

double SpeedWatch::error_percent() const noexcept {
  if (!watching_ || commanded_ <= 0) return std::numeric_limits<double>::quiet_NaN();
  return 100 * std::max(0.0, std::max(low_ - speed_, speed_ - high_) - kFloor) / commanded_;
}

void SpeedWatch::advance(Instant at) noexcept {
  const double passed = to_seconds(std::max(Duration(0), at - now_));
  now_ = std::max(now_, at);
  if (ramping_) return;
  low_ = low_ < commanded_ ? std::min(commanded_, low_ + kSlowestRise * passed) : commanded_;
  high_ = high_ > commanded_ ? std::max(commanded_, high_ - kSlowestFall * passed) : commanded_;
}

void SpeedWatch::judge_speed(Instant at) noexcept {
  advance(at);
  const double tolerance = kFloor + share_ * commanded_;
  // Written so that NaN strays.
  if (speed_ >= low_ - tolerance && speed_ <= high_ + tolerance) {
    stray_since_ = kNever;
    return;
  }
  stray_since_ = std::min(stray_since_, at);
  if (at - stray_since_ >= kPatience + host_) found(SpeedError::Kind::strays, at - stray_since_);
}

void SpeedWatch::judge_current(Instant at) noexcept {
  if (std::abs(current_) < kStallCurrent || std::abs(speed_) >= kTurning) {
    stalled_since_ = kNever;
    return;
  }
  stalled_since_ = std::min(stalled_since_, at);
  if (at - stalled_since_ >= kStallPatience + host_) found(SpeedError::Kind::stalled, at - stalled_since_);
}

void SpeedWatch::found(SpeedError::Kind kind, Duration lasts) noexcept {
  error_ = {kind, RadPerSec(commanded_), RadPerSec(speed_), Amperes(current_), lasts};
}

}  // namespace kphi::daq
