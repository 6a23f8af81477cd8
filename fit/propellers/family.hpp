// Several propellers together: lines with one slope per diameter, and a prediction for a propeller not measured.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "fit/uncertainty/analysis.hpp"

namespace kphi::fit {

/// The air in which propellers are compared: standard air if the density of all is known, since days differ by a few
/// percent.
enum class Air : std::uint8_t { measured, standard };
[[nodiscard]] Air common_air(std::span<const Fitted> family);

/// Lines of one diameter with a common slope.
struct SharedSlope {
  double diameter_in = 0;
  Estimate slope;       ///< N/(rad/s)²/deg, in the common air; u from the scatter of runs and steps
  double common_u = 0;  ///< of the errors that all share: cell, clock, density
  std::vector<std::string> propellers;
  HypothesisTest equal_slopes;

  /// Half of the 95 % interval of the slope, both uncertainties together.
  [[nodiscard]] double expanded() const;
};

/// For every diameter with two or more members.
[[nodiscard]] std::vector<SharedSlope> shared_slopes(std::span<const Fitted> family);

struct FamilyPrediction {
  double diameter_in = 0;
  int blades = 0;
  double phi_deg = 0;
  Estimate k;                   ///< N/(rad/s)², in the common air, u includes the scatter of propellers about the rule
  double lower = 0, upper = 0;  ///< 95 %
};

/// k of a propeller that was not measured, by the rule k = D⁴ (a + b·blades + c φ) through the occluded points of all
/// members (K_T by its own rule). Its degrees of freedom are the number of propellers less the terms of the rule: the
/// interval becomes useful with two propellers more than terms. nullopt with fewer than three members.
[[nodiscard]] std::optional<FamilyPrediction> predict(std::span<const Fitted> family, double diameter_in, int blades,
                                                      double phi_deg);

}  // namespace kphi::fit
