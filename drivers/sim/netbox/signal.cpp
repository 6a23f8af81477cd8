#include "drivers/sim/netbox/signal.hpp"

#include <algorithm>
#include <cmath>

#include "drivers/sim/physics/motor.hpp"

namespace kphi::sim {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kGageFullScale = 32768;  // gage counts of an axis at its full range
constexpr int kAxiaHold = 32;             // samples for which an Axia keeps the bit

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
  const int active = settings.active_slot;
  const Slot& slot = settings.slots[static_cast<std::size_t>(active)];
  range_ = active == 0 ? settings.range : Wrench{};
  for (std::size_t axis = 0; axis < 6; ++axis) {
    scale_[axis] = axis < 3 ? counts_per_force(settings, active) / unit(kForceUnits, slot.force_unit).si
                            : counts_per_torque(settings, active) / unit(kTorqueUnits, slot.torque_unit).si;
    gage_bias_[axis] = settings.bias_vector[axis] * range_[axis] / kGageFullScale;
  }
  if (filter_ == settings.filter) return;
  filter_ = settings.filter;
  const double cutoff = kFilterCutoffsHz[static_cast<std::size_t>(filter_)];
  filters_.fill(cutoff > 0 ? LowPass(cutoff) : LowPass());
}

void NetBoxSignal::measure(const Wrench& wrench) noexcept {
  bool beyond = false;
  for (std::size_t axis = 0; axis < 6; ++axis) {
    const bool forced = (forced_axes_ >> axis & 1u) != 0;
    double value = forced ? range_[axis] : std::clamp(wrench[axis], -range_[axis], range_[axis]);
    beyond = beyond || forced || value != wrench[axis];
    value -= gage_bias_[axis];
    if (filter_ != 0) value = filters_[axis].step(value);
    const double counts = value * scale_[axis];
    const std::int64_t whole = static_cast<std::int64_t>(counts + (counts < 0 ? -0.5 : 0.5)) - software_bias_[axis];
    if ((frozen_axes_ >> axis & 1u) != 0) continue;
    counts_[axis] = static_cast<std::int32_t>(std::clamp<std::int64_t>(whole, INT32_MIN, INT32_MAX));
  }
  if (saturation_left_ > 0) --saturation_left_;
  if (beyond) saturation_left_ = axia_ ? kAxiaHold : 1;
}

void NetBoxSignal::take_software_bias() noexcept {
  for (std::size_t axis = 0; axis < 6; ++axis) software_bias_[axis] += counts_[axis];
}

}  // namespace kphi::sim
