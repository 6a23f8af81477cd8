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
  static constexpr auto kTargets = std::to_array<Target>({
      {.name = "c",
       .what = "the whole curve, and the vehicle, as kphi_curve and kphi_airframe (C99)",
       .write = to_c,
       .takes_vehicle = true,
       .needs_curve = true},
      {"agilicious", "thrust_map of a quadrotor file (YAML)", to_agilicious},
      {.name = "px4",
       .what = "CA_ROTORn_…, THR_MDL_FAC, with --vehicle also KPHI_… of the morphing child (QGroundControl .params)",
       .write = to_px4,
       .takes_vehicle = true,
       .for_each_motor = true},
      {.name = "gazebo", .what = "gz-sim MulticopterMotorModel (SDF)", .write = to_gazebo, .for_each_motor = true},
      {.name = "ros2",
       .what = "parameters of kphi's node, or any other (YAML)",
       .write = to_ros2,
       .takes_vehicle = true},
      {.name = "ardupilot",
       .what = "with --vehicle a Lua script for the scripted motor matrix; else MOT_THST_EXPO of a log with throttle",
       .write = to_ardupilot,
       .takes_vehicle = true},
      {"betaflight", "thrust_linear of a log with throttle (CLI)", to_betaflight},
      {"crazyflie", "VMOTOR2THRUSTn of a log with throttle and voltage (C header)", to_crazyflie},
      {"csv", "table per occlusion, or the samples of a run", to_csv},
      {"mcap", "for Foxglove and PlotJuggler; of a run: every sample", to_mcap},
  });
  return kTargets;
}

}  // namespace kphi::fit
