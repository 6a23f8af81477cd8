#include "daq/guard/vibration.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace kphi::daq {
namespace {

constexpr double kHighest = 0.45;     // of the sample rate
constexpr std::size_t kFewest = 100;  // samples of a window

}  // namespace

VibrationMeter::VibrationMeter(int axis, int blades, double sample_rate_hz, double counts_per_newton,
                               double counts_per_newton_metre)
    : axis_(static_cast<std::size_t>(axis)),
      blades_(blades),
      rate_hz_(sample_rate_hz),
      scale_{counts_per_newton, counts_per_newton_metre},
      window_(std::max(kFewest, static_cast<std::size_t>(kWindow * sample_rate_hz))) {}

bool VibrationMeter::add(const std::array<std::int32_t, 6>& counts, double speed_rad_s) noexcept {
  if (n_ == 0) begin(counts, speed_rad_s);
  for (std::size_t axis = 0; axis < 6; ++axis) {
    const double differs = static_cast<double>(counts[axis]) - first_[axis];
    sum_[axis] += differs;
    squares_[axis] += differs * differs;
  }
  if (line_hz_ > 0) {
    const double thrust = static_cast<double>(counts[axis_]) - first_[axis_];
    for (int part = 0; part < 2; ++part) {
      found_[part] += thrust * phase_[part];
      constant_[part] += phase_[part];
    }
    const double cosine = phase_[0] * turn_[0] - phase_[1] * turn_[1];
    phase_[1] = phase_[0] * turn_[1] + phase_[1] * turn_[0];
    phase_[0] = cosine;
  }
  if (++n_ < window_) return false;
  end();
  return true;
}

void VibrationMeter::begin(const std::array<std::int32_t, 6>& counts, double speed_rad_s) noexcept {
  first_ = counts;
  sum_ = squares_ = {};
  const double hz = blades_ * speed_rad_s / (2 * std::numbers::pi);
  line_hz_ = hz >= 2 / kWindow && hz <= kHighest * rate_hz_ ? hz : 0;
  const double angle = 2 * std::numbers::pi * line_hz_ / rate_hz_;
  turn_[0] = std::cos(angle);
  turn_[1] = std::sin(angle);
  phase_[0] = 1;
  phase_[1] = found_[0] = found_[1] = constant_[0] = constant_[1] = 0;
}

void VibrationMeter::end() noexcept {
  const double n = static_cast<double>(n_);
  for (std::size_t axis = 0; axis < 6; ++axis) {
    const double mean = sum_[axis] / n;
    newest_.rms[axis] = std::sqrt(std::max(0.0, squares_[axis] / n - mean * mean)) / scale_[axis < 3 ? 0 : 1];
  }
  newest_.blade_pass_hz = line_hz_ > 0 ? line_hz_ : Vibration::kNone;
  const double mean = sum_[axis_] / n;
  newest_.blade_pass_n =
      line_hz_ > 0 ? 2 / n * std::hypot(found_[0] - mean * constant_[0], found_[1] - mean * constant_[1]) / scale_[0]
                   : Vibration::kNone;
  n_ = 0;
}

}  // namespace kphi::daq
