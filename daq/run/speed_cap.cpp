#include "daq/run/speed_cap.hpp"

#include <algorithm>
#include <cmath>

#include "results/reduction/quality_flags.hpp"

namespace kphi::daq {
namespace {

using results::QualityFlag;
using results::StepMean;

bool has(const StepMean& step, QualityFlag flag) {
  return (step.quality_flags & static_cast<std::uint32_t>(flag)) != 0;
}

/// Of its drive at the voltage that it should have: a sagging supply says nothing about the motor.
bool at_its_end(const StepMean& step) {
  const bool sags = has(step, QualityFlag::supply_sag) || has(step, QualityFlag::supply_out_of_band);
  return (has(step, QualityFlag::drive_saturated) && !sags) || has(step, QualityFlag::derated) ||
         has(step, QualityFlag::supply_limited);
}

}  // namespace

bool is_out_of_drive(RadPerSec commanded, RadPerSec reached, double drive_pwm) {
  const bool is_short = commanded.value() - reached.value() > results::speed_tolerance(commanded.value());
  return is_short && std::abs(drive_pwm) >= results::kFullDrive;
}

std::optional<CapLesson> SpeedCap::learn(std::span<const StepMean> run) {
  const StepMean* lowest = nullptr;
  for (const StepMean& step : run) {
    const bool lower = lowest == nullptr || step.commanded_speed_rad_s < lowest->commanded_speed_rad_s;
    if (lower && has(step, QualityFlag::speed_not_reached) && at_its_end(step) &&
        step.speed_rad_s < step.commanded_speed_rad_s)
      lowest = &step;
  }
  if (lowest == nullptr) return std::nullopt;
  double held = 0;
  for (const StepMean& step : run) {
    if (step.commanded_speed_rad_s >= lowest->commanded_speed_rad_s) continue;
    if (!has(step, QualityFlag::speed_not_reached) && !at_its_end(step))
      held = std::max(held, step.commanded_speed_rad_s);
  }
  if (held <= 0 || (cap_ && cap_->value() <= held)) return std::nullopt;
  cap_ = RadPerSec(held);
  return CapLesson{RadPerSec(lowest->commanded_speed_rad_s), RadPerSec(lowest->speed_rad_s), *cap_};
}

void SpeedCap::apply(std::vector<profiles::PlannedStep>& steps) const {
  constexpr double kSlack = 1e-9;  // levels may come from files
  if (cap_) std::erase_if(steps, [&](const auto& step) { return step.speed.value() > cap_->value() * (1 + kSlack); });
}

}  // namespace kphi::daq
