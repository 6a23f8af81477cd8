// What unlocks the motor.
#pragma once

namespace kphi::daq {

/// Somebody has said that this occlusion is mounted. Only an Operator gives one away, and no run can be ordered
/// without.
class MountConfirmation {
 public:
  [[nodiscard]] double occlusion_deg() const { return occlusion_deg_; }

 private:
  friend class Operator;
  explicit MountConfirmation(double occlusion_deg) : occlusion_deg_(occlusion_deg) {}
  double occlusion_deg_;
};

}  // namespace kphi::daq
