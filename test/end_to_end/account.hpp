// The truth log of a simulated bench that has ended: what its motor was told and did, and what its supply did.
#pragma once

#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

namespace kphi::test {

/// What the simulated motor says of itself after the end; times in ms of the bench.
struct Account {
  struct Command {
    double at;
    std::string mode;
    double target;
  };
  std::vector<Command> commands;
  std::vector<std::pair<double, std::string>> stages;
  std::vector<bool> outputs;       ///< of the supply
  std::vector<double> outputs_at;  ///< when it was switched so

  /// The supply was switched, last of all off.
  [[nodiscard]] bool ends_without_power() const { return !outputs.empty() && !outputs.back(); }
  /// When the motor began to coast for good; NaN: it does not.
  [[nodiscard]] double coasts_at() const {
    return !stages.empty() && stages.back().second == "coast" ? stages.back().first : std::nan("");
  }

  [[nodiscard]] std::string stage_at(double time) const {
    std::string stage = "coast";
    for (const auto& [at, name] : stages) {
      if (at <= time) stage = name;
    }
    return stage;
  }
  [[nodiscard]] double last_speed_at() const {
    double last = -1;
    for (const Command& command : commands) {
      if (command.mode == "velocity") last = command.at;
    }
    return last;
  }
  /// The first coast after the last speed; that of the last speed without one.
  [[nodiscard]] double coast_told_at() const {
    for (const Command& command : commands) {
      if (command.mode == "coast" && command.at > last_speed_at()) return command.at;
    }
    return last_speed_at();
  }
};

inline Account account_of(const std::string& log) {
  Account account;
  std::istringstream text(log);
  for (std::string line; std::getline(text, line);) {
    if (line.rfind("{\"at_ns\"", 0) != 0) continue;
    const nlohmann::json item = nlohmann::json::parse(line);
    const double at = 1e-6 * item["at_ns"].get<double>();
    if (item.contains("motion_command")) {
      const std::string mode = item["motion_command"];
      account.commands.push_back({at, mode, item[mode == "velocity" ? "target_rad_s" : "target"].get<double>()});
    }
    if (item.contains("supply_output")) {
      account.outputs.push_back(item["supply_output"]);
      account.outputs_at.push_back(at);
    }
    if (item.contains("stage")) account.stages.emplace_back(at, item["stage"]);
  }
  return account;
}

}  // namespace kphi::test
