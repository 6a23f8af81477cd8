#include "drivers/sim/iq_ending.hpp"

#include <cmath>

namespace kphi::sim {
namespace {

constexpr double kSongVolts = 0.12;
constexpr Duration kHalfWave = std::chrono::microseconds(570);  // a note of 877 Hz
constexpr Duration kSong = std::chrono::milliseconds(600);      // three beeps
constexpr Duration kBeep = std::chrono::milliseconds(100);

double note(Duration since_begin) noexcept {
  if (since_begin / kBeep % 2 != 0) return 0;
  return since_begin / kHalfWave % 2 == 0 ? kSongVolts : -kSongVolts;
}

}  // namespace

void IqEnding::begin(const Plan& plan, Instant now) noexcept {
  plan_ = plan;
  since_ = now;
  slow_since_ = kNever;
  phase_ = plan.behavior == 0 ? Phase::singing : Phase::slowing;
}

void IqEnding::step(double speed, Instant now, MotorDrive& drive) noexcept {
  drive.addition = 0;
  if (phase_ == Phase::slowing) slow_down(speed, now);
  if (phase_ == Phase::slowing) {
    drive.mode = MotorDrive::Mode::volts;
    drive.target = 0;
    return;
  }
  drive.mode = MotorDrive::Mode::coast;
  drive.target = 0;
  if (plan_.song == 2 || (plan_.song == 1 && now - since_ < kSong)) {
    drive.addition = note(now - since_);
    return;
  }
  phase_ = Phase::none;
  if (plan_.behavior == 2) drive.mode = MotorDrive::Mode::brake;
}

void IqEnding::slow_down(double speed, Instant now) noexcept {
  if (std::abs(speed) >= plan_.stopped_speed) {
    slow_since_ = kNever;
    return;
  }
  if (slow_since_ == kNever) slow_since_ = now;
  if (now - slow_since_ < from_seconds(plan_.stopped_time)) return;
  phase_ = Phase::singing;
  since_ = now;
}

}  // namespace kphi::sim
