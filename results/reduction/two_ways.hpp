// One run whose speeds were reached from below and from above.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "results/step_mean.hpp"

namespace kphi::results {

/// Thrust at one speed, reached from below and from above.
struct HysteresisPoint {
  double speed_rad_s = 0;      ///< of the rising step
  double up_minus_down_n = 0;  ///< thrust; the falling step scaled to that speed by ω²
  double u_n = 0;              ///< standard, from the noise within both steps; they share the zero
  [[nodiscard]] bool significant() const { return up_minus_down_n * up_minus_down_n > 4 * u_n * u_n; }
};

struct Hysteresis {
  std::vector<HysteresisPoint> speeds;  ///< ascending
  double share = 0;                     ///< k rising less k falling, as a share of k
  double u_share = 0;                   ///< standard
  [[nodiscard]] bool significant() const { return share * share > 4 * u_share * u_share; }
  /// "thrust going up minus going down: +0.12 ± 0.05 % of k …"
  [[nodiscard]] std::string to_words() const;
};

/// `run`: the steps of one run. nullopt if fewer than two speeds have a good step on both ways.
[[nodiscard]] std::optional<Hysteresis> hysteresis_of(std::span<const StepMean> run);

}  // namespace kphi::results
