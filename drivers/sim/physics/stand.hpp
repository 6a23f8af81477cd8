// What a simulated stand has beside the propellers of truth.hpp: another law of thrust, mountings that differ, and
// plates that are not what they are taken for.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "drivers/sim/physics/truth.hpp"

namespace kphi::sim {

/// In N/(rad/s)²: at φ = 0, and the line of the occluded points (slope per degree).
struct ThrustLaw {
  double K_T = 0, intercept = 0, slope_per_deg = 0;
};

/// An occlusion that is another one than its name says.
struct Plate {
  double named_deg = 0, true_deg = 0;
};

struct StandParameters {
  std::optional<ThrustLaw> law;  ///< of whatever propeller is mounted; nullopt: its own
  double bend = 0;  ///< of k(φ) above the line, share of K_T: a parabola, highest at 135°, 0 at 0° and 270°
  double rise_per_krad_s = 0;                    ///< of k with the speed, share; k is as given at 1000 rad/s
  double mounting = 0;                           ///< standard deviation of k from mounting to mounting, share
  std::optional<std::uint64_t> mounting_seed{};  ///< nullopt: by that of the plant
  std::vector<Plate> plates;
  int spin = +1;  ///< sense in which the propellers pull, +1 counter-clockwise

  /// At 1000 rad/s and 1.225 kg/m³, N/(rad/s)², before the scatter of the mountings. Degrees, [0, 360).
  [[nodiscard]] double k(const PropellerTruth& propeller, double true_deg) const;
  [[nodiscard]] double true_deg(double named_deg) const;
};

/// The truth as YAML: per propeller K_T, k per occlusion and the line, all in N/(rad/s)² (slope per degree).
[[nodiscard]] std::string truth_yaml(std::uint64_t seed, const StandParameters& stand = {});

}  // namespace kphi::sim
