// What truly happened on a simulated bench, as text: `kphi sim --truth-log`. One JSON object per line, bench time.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "drivers/sim/iq/line.hpp"
#include "drivers/sim/netbox/fault_injector.hpp"
#include "drivers/sim/supply/circuit.hpp"

namespace kphi::sim {

/// The events, the datagrams of the log, then {"totals": …}.
[[nodiscard]] std::string json_lines(const WireTruth& truth);
/// The totals that are not zero, in one line: "sent 700, records_sent 28000, …".
[[nodiscard]] std::string summary(const WireTruth& truth);
/// The events, the replies of the log, then {"motor_totals": …}.
[[nodiscard]] std::string json_lines(const IqTruth& truth);

[[nodiscard]] std::string_view name_of(MotorDrive::Mode mode) noexcept;

/// The commands that the motor received and what its power stage did, sampled by look(). Tests check every way out of a
/// program against this log.
class MotionLog {
 public:
  /// Notes what has changed since the last look; of several commands since then, the last one. `speed` in rad/s.
  void look(const IqDevice& motor, double speed, Instant now);
  /// The same for the output of the supply.
  void look(const SupplyCircuit& supply, Instant now);
  /// In the order of the looks: {"at_ns", "motion_command": "velocity", "target_rad_s"}, other modes with their plain
  /// "target"; {"at_ns", "stage": "drive", "speed_rad_s"}, the stage is what the physics obeys; {"at_ns",
  /// "supply_output": true}.
  [[nodiscard]] const std::string& json_lines() const noexcept { return lines_; }

 private:
  std::string lines_;
  // As last seen.
  IqMotion command_{Instant{-1}};
  std::optional<PowerStage::Mode> stage_;
  std::optional<bool> output_;
};

}  // namespace kphi::sim
