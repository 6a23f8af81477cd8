// Several propellers in words and numbers: the paper's statements, slopes in common, and what to expect of a propeller
// that nobody measured.
#pragma once

#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "fit/propellers/claims.hpp"
#include "fit/propellers/family.hpp"

namespace kphi::fit {

/// A propeller to be predicted: "7x3" is 7 inches, three blades.
struct PropellerSize {
  double diameter_in = 0;
  int blades = 0;
};
/// Throws ConfigurationError.
[[nodiscard]] PropellerSize parse_propeller_size(const std::string& text);

struct FamilyFindings {
  Air air = Air::measured;  ///< in which propellers are compared
  std::vector<Claim> claims;
  std::vector<SharedSlope> slopes;
  std::vector<FamilyPrediction> predictions;
};

/// Predictions of every size at every φ that a member was measured at, ascending. Throws ConfigurationError when sizes
/// are asked for and there are fewer than three members.
[[nodiscard]] FamilyFindings findings_of(std::span<const FamilyMember> family, std::span<const PropellerSize> sizes);

/// Claim, value found, 95 % interval, verdict; then slopes and predictions.
[[nodiscard]] std::string family_text(const FamilyFindings& findings);
[[nodiscard]] nlohmann::ordered_json to_json(const FamilyFindings& findings);

}  // namespace kphi::fit
