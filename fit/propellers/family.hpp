// Several propellers together: lines with one slope per diameter, and what they let expect of one not tested.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "fit/uncertainty/analysis.hpp"

namespace kphi::fit {

/// One fitted propeller.
struct FamilyMember {
  Identification identification;
  Analysis analysis;
};

/// In which air k is compared from propeller to propeller: in standard air, where that of all of them is known, since
/// days differ by some percent.
enum class Air : std::uint8_t { measured, standard };
[[nodiscard]] Air common_air(std::span<const FamilyMember> family);

/// Lines of one diameter with a slope in common.
struct SharedSlope {
  double diameter_in = 0;
  Estimate slope;                    ///< N/(rad/s)²/deg, in the common air; u by what runs and steps scatter
  double common_u = 0;               ///< besides, of what is the same for all of them: cell, clock, density
  std::vector<Estimate> intercepts;  ///< one per member of that diameter, in their order
  std::vector<std::string> propellers;
  HypothesisTest equal_slopes;

  /// Half of the 95 % interval of the slope, both uncertainties together.
  [[nodiscard]] double expanded() const;
};

/// For every diameter of which there are two members or more.
[[nodiscard]] std::vector<SharedSlope> shared_slopes(std::span<const FamilyMember> family);

struct FamilyPrediction {
  double diameter_in = 0;
  int blades = 0;
  double phi_deg = 0;
  Estimate k;                   ///< N/(rad/s)², in the common air, u with the scatter of propellers about the rule
  double lower = 0, upper = 0;  ///< 95 %
};

/// k of a propeller that nobody tested, by the rule k = D⁴ (a + b·blades + c φ) through the occluded points of all
/// members (K_T by one of its own). Its freedom is the number of propellers less those that the rule uses up: with two
/// propellers more than terms the interval becomes bearable. Nothing with fewer than three members.
[[nodiscard]] std::optional<FamilyPrediction> predict(std::span<const FamilyMember> family, double diameter_in,
                                                      int blades, double phi_deg);

}  // namespace kphi::fit
