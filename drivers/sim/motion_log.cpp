#include "drivers/sim/motion_log.hpp"

#include <array>
#include <nlohmann/json.hpp>

namespace kphi::sim {
namespace {

std::string_view name_of(PowerStage::Mode mode) noexcept {
  constexpr std::array<std::string_view, 3> kNames{"coast", "brake", "drive"};
  return kNames[static_cast<std::size_t>(mode)];
}

}  // namespace

std::string_view name_of(MotorDrive::Mode mode) noexcept {
  constexpr std::array<std::string_view, 5> kNames{"brake", "coast", "volts", "pwm", "velocity"};
  return kNames[static_cast<std::size_t>(mode)];
}

void MotionLog::look(const IqDevice& motor, double speed, Instant now) {
  const IqMotion& motion = motor.last_motion();
  const bool commanded =
      motion.at >= Instant{0} && (commands_.empty() || commands_.back().at != motion.at ||
                                  commands_.back().mode != motion.mode || commands_.back().target != motion.target);
  if (commanded) commands_.push_back(motion);
  const PowerStage::Mode mode = motor.stage().mode;
  if (stages_.empty() || stages_.back().mode != mode) stages_.push_back({now, mode, speed});
}

void MotionLog::look(const SupplyCircuit& supply, Instant now) {
  if (outputs_.empty() || outputs_.back().second != supply.output()) outputs_.emplace_back(now, supply.output());
}

std::string MotionLog::json_lines() const {
  using nlohmann::ordered_json;
  std::string out;
  const auto add = [&](const ordered_json& line) { out += line.dump() + "\n"; };
  for (const IqMotion& command : commands_) {
    const char* target = command.mode == MotorDrive::Mode::velocity ? "target_rad_s" : "target";
    add({{"at_ns", command.at.count()}, {"motion_command", name_of(command.mode)}, {target, command.target}});
  }
  for (const Stage& stage : stages_)
    add({{"at_ns", stage.at.count()}, {"stage", name_of(stage.mode)}, {"speed_rad_s", stage.speed}});
  for (const auto& [at, on] : outputs_) add({{"at_ns", at.count()}, {"supply_output", on}});
  return out;
}

}  // namespace kphi::sim
