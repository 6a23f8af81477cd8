#include "drivers/sim/netbox/signal.hpp"

#include <algorithm>
#include <cmath>

#include "drivers/sim/physics/motor.hpp"

namespace kphi::sim {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kGageFullScale = 32768;  // gage counts of an axis at its full range
constexpr int kAxiaHold = 32;             // samples for which an Axia keeps the bit

using Matrix = std::array<std::array<double, 3>, 3>;

Matrix product(const Matrix& a, const Matrix& b) noexcept {
  Matrix c{};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) c[i][j] = a[i][0] * b[0][j] + a[i][1] * b[1][j] + a[i][2] * b[2][j];
  }
  return c;
}

/// Components along axes that were turned about x, then about the new y, then about the new z.
Matrix turned(double rx, double ry, double rz) noexcept {
  const auto [cx, sx, cy, sy, cz, sz] =
      std::array{std::cos(rx), std::sin(rx), std::cos(ry), std::sin(ry), std::cos(rz), std::sin(rz)};
  const Matrix x{{{1, 0, 0}, {0, cx, sx}, {0, -sx, cx}}};
  const Matrix y{{{cy, 0, -sy}, {0, 1, 0}, {sy, 0, cy}}};
  const Matrix z{{{cz, sz, 0}, {-sz, cz, 0}, {0, 0, 1}}};
  return product(z, product(y, x));
}

std::int32_t clamped(std::int64_t counts) noexcept {
  return static_cast<std::int32_t>(std::clamp<std::int64_t>(counts, INT32_MIN, INT32_MAX));
}

}  // namespace

LowPass::LowPass(double cutoff_hz) noexcept {
  const double w = std::tan(kPi * cutoff_hz / kTicksPerSecond);
  const double norm = 1 / (1 + std::sqrt(2.0) * w + w * w);
  b_ = w * w * norm;
  a1_ = 2 * (w * w - 1) * norm;
  a2_ = (1 - std::sqrt(2.0) * w + w * w) * norm;
}

double LowPass::step(double in) noexcept {
  if (!settled_) {
    settled_ = true;
    s2_ = (b_ - a2_) * in;
    s1_ = (2 * b_ - a1_) * in + s2_;
  }
  const double out = b_ * in + s1_;
  s1_ = 2 * b_ * in - a1_ * out + s2_;
  s2_ = b_ * in - a2_ * out;
  return out;
}

void NetBoxSignal::configure(const NetBoxSettings& settings) noexcept {
  axia_ = settings.quirks.axia;
  monitoring_ = settings.monitoring;
  conditions_ = settings.conditions;
  const Slot& slot = settings.slots[static_cast<std::size_t>(settings.active_slot)];
  range_ = slot.calibration == 0 ? settings.range : Wrench{};
  for (std::size_t axis = 0; axis < 6; ++axis) {
    const bool force = axis < 3;
    const double per_unit =
        force ? counts_per_force(settings, settings.active_slot) : counts_per_torque(settings, settings.active_slot);
    scale_[axis] = per_unit / (force ? unit(kForceUnits, slot.force_unit) : unit(kTorqueUnits, slot.torque_unit)).si;
    gage_bias_[axis] = settings.bias_vector[axis] * range_[axis] / kGageFullScale;
  }
  const auto& t = slot.tool_transform;
  moved_ = std::any_of(t.begin(), t.end(), [](double v) { return v != 0; });
  const double metre = unit(kDistanceUnits, slot.distance_unit).si;
  const double radian = unit(kAngleUnits, slot.angle_unit).si;
  lever_ = {t[0] * metre, t[1] * metre, t[2] * metre};
  turn_ = turned(t[3] * radian, t[4] * radian, t[5] * radian);
  if (filter_ == settings.filter) return;
  filter_ = settings.filter;
  const double cutoff = kFilterCutoffsHz[static_cast<std::size_t>(filter_)];
  filters_.fill(cutoff > 0 ? LowPass(cutoff) : LowPass());
}

void NetBoxSignal::measure(const Wrench& wrench) noexcept {
  Wrench value = wrench;
  bool beyond = false;
  for (std::size_t axis = 0; axis < 6; ++axis) {
    const double range = range_[axis];
    if (value[axis] > range || value[axis] < -range) {
      value[axis] = value[axis] > 0 ? range : -range;
      beyond = true;
    }
  }
  if (forced_axes_ != 0) {
    beyond = true;
    for (std::size_t axis = 0; axis < 6; ++axis) {
      if ((forced_axes_ >> axis & 1u) != 0) value[axis] = range_[axis];
    }
  }
  if (saturation_left_ > 0) --saturation_left_;
  if (beyond) saturation_left_ = axia_ ? kAxiaHold : 1;
  for (std::size_t axis = 0; axis < 6; ++axis) value[axis] -= gage_bias_[axis];
  if (filter_ != 0) {
    for (std::size_t axis = 0; axis < 6; ++axis) value[axis] = filters_[axis].step(value[axis]);
  }
  if (moved_) transform(value);
  for (std::size_t axis = 0; axis < 6; ++axis) {
    const double counts = value[axis] * scale_[axis];
    counts_[axis] = clamped(static_cast<std::int64_t>(counts + (counts < 0 ? -0.5 : 0.5)) - software_bias_[axis]);
  }
  if (monitoring_) judge();
}

void NetBoxSignal::transform(Wrench& w) const noexcept {
  const std::array<double, 3> force{w[0], w[1], w[2]};
  // Torque about the tool's origin, which lies at `lever_` from the cell's.
  const std::array<double, 3> torque{w[3] - (lever_[1] * force[2] - lever_[2] * force[1]),
                                     w[4] - (lever_[2] * force[0] - lever_[0] * force[2]),
                                     w[5] - (lever_[0] * force[1] - lever_[1] * force[0])};
  for (std::size_t i = 0; i < 3; ++i) {
    w[i] = turn_[i][0] * force[0] + turn_[i][1] * force[1] + turn_[i][2] * force[2];
    w[i + 3] = turn_[i][0] * torque[0] + turn_[i][1] * torque[1] + turn_[i][2] * torque[2];
  }
}

void NetBoxSignal::take_software_bias() noexcept {
  for (std::size_t axis = 0; axis < 6; ++axis) software_bias_[axis] += counts_[axis];
}

void NetBoxSignal::judge() noexcept {
  if (!latched_) {
    breached_ = 0;
    output_ = 0;
  }
  for (std::size_t i = 0; i < conditions_.size(); ++i) {
    const MonitorCondition& condition = conditions_[i];
    if (!condition.enabled || condition.axis < 0) continue;
    const std::int32_t counts = counts_[static_cast<std::size_t>(condition.axis)];
    if (condition.comparison > 0 ? counts <= condition.counts : counts >= condition.counts) continue;
    latched_ = true;
    breached_ |= 1u << i;
    output_ |= condition.output;
  }
}

}  // namespace kphi::sim
