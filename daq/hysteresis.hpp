// What a run up and down tells: whether the thrust at a speed depends on the side from which the speed was reached.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "results/step_mean.hpp"

namespace kphi::daq {

struct HysteresisPoint {
  double speed_rad_s = 0;      ///< of the rising step
  double up_minus_down_n = 0;  ///< thrust, the falling step's scaled to that speed by ω²
  double u_n = 0;              ///< standard, from within the two steps; the zero's is common to both
  [[nodiscard]] bool significant() const { return up_minus_down_n * up_minus_down_n > 4 * u_n * u_n; }
};

struct Hysteresis {
  std::vector<HysteresisPoint> speeds;  ///< ascending
  double share = 0;                     ///< k rising less k falling, of k
  double u_share = 0;                   ///< standard
  [[nodiscard]] bool significant() const { return share * share > 4 * u_share * u_share; }
  /// "thrust up minus down: k +0.12 ± 0.05 % …", one line.
  [[nodiscard]] std::string to_words() const;
};

/// Of the steps of one run; nothing when fewer than two speeds were held on both ways without a doubt about k.
[[nodiscard]] std::optional<Hysteresis> hysteresis_of(std::span<const results::StepMean> run);

}  // namespace kphi::daq
