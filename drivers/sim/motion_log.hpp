// What the motor was told and what its power stage did about it, as found at every look: a program's ways out are held
// against this.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "drivers/sim/iq_device.hpp"
#include "drivers/sim/supply_circuit.hpp"

namespace kphi::sim {

[[nodiscard]] std::string_view name_of(MotorDrive::Mode mode) noexcept;

class MotionLog {
 public:
  /// Notes what has changed since the last look; of several commands since then, the last one. `speed` in rad/s.
  void look(const IqDevice& motor, double speed, Instant now);
  /// The same for the output of the supply.
  void look(const SupplyCircuit& supply, Instant now);
  /// One JSON object per line, bench time: {"at_ns", "motion_command": "velocity", "target_rad_s"}, other modes with
  /// their plain "target"; {"at_ns", "stage": "drive", "speed_rad_s"}, the stage is what the physics obeys;
  /// {"at_ns", "supply_output": true}.
  [[nodiscard]] std::string json_lines() const;

 private:
  struct Stage {
    Instant at;
    PowerStage::Mode mode;
    double speed;
  };
  std::vector<IqMotion> commands_;
  std::vector<Stage> stages_;
  std::vector<std::pair<Instant, bool>> outputs_;
};

}  // namespace kphi::sim
