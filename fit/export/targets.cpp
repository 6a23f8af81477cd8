#include "fit/export/targets.hpp"

#include <fmt/format.h>

#include <array>
#include <sstream>

#include "base/error.hpp"

namespace kphi::fit {

std::vector<Turn> parse_turns(const std::string& text) {
  std::vector<Turn> turns;
  std::istringstream words(text);
  for (std::string word; std::getline(words, word, ',');) {
    if (word != "ccw" && word != "cw")
      throw ConfigurationError(
          fmt::format("--turns {}: \"{}\" is neither cw nor ccw; name each motor, such as ccw,ccw,cw,cw", text, word));
    turns.push_back(word == "cw" ? Turn::clockwise : Turn::counter_clockwise);
  }
  return turns;
}

std::span<const Target> targets() {
  static constexpr std::array<Target, 10> kTargets{{
      {"c", "the whole curve, and the vehicle, as kphi_curve and kphi_airframe (C99)", to_c},
      {"agilicious", "thrust_map of a quadrotor file (YAML)", to_agilicious},
      {"px4", "CA_ROTORn_…, THR_MDL_FAC, with --vehicle also KPHI_… of the morphing child (QGroundControl .params)",
       to_px4},
      {"gazebo", "gz-sim MulticopterMotorModel (SDF)", to_gazebo},
      {"ros2", "parameters of kphi's node, or any other (YAML)", to_ros2},
      {"ardupilot",
       "with --vehicle a Lua script for the scripted motor matrix; else MOT_THST_EXPO of a log with throttle",
       to_ardupilot},
      {"betaflight", "thrust_linear of a log with throttle (CLI)", to_betaflight},
      {"crazyflie", "VMOTOR2THRUSTn of a log with throttle and voltage (C header)", to_crazyflie},
      {"csv", "table per occlusion, or the samples of a run", to_csv},
      {"mcap", "for Foxglove and PlotJuggler; of a run: every sample", to_mcap},
  }};
  return kTargets;
}

}  // namespace kphi::fit
