#include "drivers/iq/stopping.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace kphi::iq {
namespace {

constexpr Duration kRampStep = std::chrono::milliseconds(20);
constexpr double kFalling = 0.95;  ///< of the speed at the coast

std::string seconds_text(const std::optional<Duration>& time) {
  return time ? fmt::format("{:.2f} s", to_seconds(*time)) : std::string("never");
}

}  // namespace

std::string StopReport::summary() const {
  constexpr const char* outcomes[] = {"stands",
                                      "is slowing down",
                                      "still turns although it coasts",
                                      "coasts unseen",
                                      "did not confirm that it coasts",
                                      "was told to move again"};
  return fmt::format("the motor {}: from {:.0f} to {:.0f} rad/s, coast confirmed after {}, standing after {}",
                     outcomes[static_cast<int>(outcome)], speed_at_start, speed_at_end, seconds_text(time_to_coast),
                     seconds_text(time_to_standing));
}

void Stopping::check(const StopSettings& settings) {
  const double deceleration = settings.deceleration.value_or(1000);
  const bool good = deceleration >= 100 && deceleration <= 1e5 && settings.coast_below >= 0 &&
                    settings.coast_below <= 1e4 && settings.standing_below > 0 && settings.limit > Duration{0};
  if (!good) throw std::invalid_argument("a stop needs a deceleration of 100..100000 rad/s² and speeds above zero");
}

void Stopping::begin(const StopSettings& settings, double speed, bool ramped, Instant now) noexcept {
  settings_ = settings;
  phase_ = ramped ? Phase::ramping : Phase::coasting;
  asked_ = next_ = coasted_ = now;
  speed_at_coast_ = speed_ = speed;
  measured_after_coast_ = false;
  report_.reset();
  open_ = {};
  open_.speed_at_start = speed;
}

std::optional<double> Stopping::ramp(Instant now) noexcept {
  if (phase_ != Phase::ramping || now < next_) return std::nullopt;
  next_ = now + kRampStep;
  const double left = std::abs(open_.speed_at_start) - *settings_.deceleration * to_seconds(now - asked_);
  return left > settings_.coast_below ? std::copysign(left, open_.speed_at_start) : 0.0;
}

void Stopping::coasted(Instant now) noexcept {
  if (phase_ != Phase::ramping) return;
  phase_ = Phase::coasting;
  coasted_ = now;
  speed_at_coast_ = speed_;
}

void Stopping::confirmed(Instant now) noexcept {
  if (phase_ == Phase::coasting && !open_.time_to_coast) open_.time_to_coast = now - asked_;
}

void Stopping::measured(double speed, Instant time) noexcept {
  if (phase_ == Phase::none) return;
  speed_ = speed;
  if (phase_ != Phase::coasting || time < coasted_) return;
  if (!measured_after_coast_) speed_at_coast_ = speed;
  measured_after_coast_ = true;
  speed_time_ = time;
  if (std::abs(speed) < settings_.standing_below && !open_.time_to_standing) open_.time_to_standing = time - asked_;
}

void Stopping::advance(Instant now) noexcept {
  if (phase_ != Phase::coasting) return;
  if (open_.time_to_coast && open_.time_to_standing) return end(StopReport::Outcome::standing);
  if (now < coasted_ + settings_.limit) return;
  if (!open_.time_to_coast) return end(StopReport::Outcome::unconfirmed);
  if (!measured_after_coast_) return end(StopReport::Outcome::unseen);
  const bool falling = std::abs(speed_) < kFalling * std::abs(speed_at_coast_);
  end(falling ? StopReport::Outcome::slowing : StopReport::Outcome::turning);
}

void Stopping::end(StopReport::Outcome outcome) noexcept {
  if (phase_ == Phase::none) return;
  phase_ = Phase::none;
  open_.outcome = outcome;
  open_.speed_at_end = speed_;
  report_ = open_;
}

Instant Stopping::deadline() const noexcept {
  if (phase_ == Phase::ramping) return next_;
  return phase_ == Phase::coasting ? coasted_ + settings_.limit : kNever;
}

}  // namespace kphi::iq
