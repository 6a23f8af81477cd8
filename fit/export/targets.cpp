#include "fit/export/targets.hpp"

#include <array>

namespace kphi::fit {

std::span<const Target> targets() {
  static constexpr std::array<Target, 7> kTargets{{
      {"agilicious", "thrust_map of a quadrotor file (YAML)", to_agilicious},
      {"px4", "CA_ROTORn_CT, THR_MDL_FAC (QGroundControl .params)", to_px4},
      {"gazebo", "gz-sim MulticopterMotorModel (SDF)", to_gazebo},
      {"ros2", "parameter file (YAML)", to_ros2},
      {"header", "constexpr C++ header", to_header},
      {"csv", "table per occlusion, or the samples of a run", to_csv},
      {"mcap", "for Foxglove and PlotJuggler; of a run: every sample", to_mcap},
  }};
  return kTargets;
}

}  // namespace kphi::fit
