// Several propellers together: the paper's statements as a table (claim, value found, interval, verdict), slopes in
// common, and what to expect of a propeller that was not measured.
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "fit/propellers/family.hpp"

namespace kphi::fit {

enum class Verdict : std::uint8_t {
  holds,       ///< the whole 95 % interval lies within what the claim allows
  fails,       ///< the whole interval lies outside
  undecided,   ///< it reaches across the limit
  not_tested,  ///< the data do not cover the claim
};
[[nodiscard]] const char* name_of(Verdict verdict);

struct Claim {
  std::string id;         ///< short and stable: "slopes_5in"
  std::string statement;  ///< in words
  std::string unit;
  double value = std::numeric_limits<double>::quiet_NaN();
  double lower = value, upper = value;  ///< 95 % interval
  double allowed_lower = -std::numeric_limits<double>::infinity();
  double allowed_upper = std::numeric_limits<double>::infinity();
  Verdict verdict = Verdict::not_tested;
  bool is_p = false;  ///< the value is the p of a test that would reject the claim below `allowed_lower`; no interval
};

/// What the paper says of its 5-inch three-blade propeller: the share of the thrust that an occlusion leaves at 19,100
/// RPM, and between which shares "almost 90 %" and "25 %" still hold.
struct PaperShare {
  double phi_deg, share, lower, upper;
  const char* words;
};
inline constexpr PaperShare kPaperShares[] = {{45, 0.90, 0.87, 0.91, "almost 90 %"}, {270, 0.25, 0.22, 0.28, "25 %"}};
/// Empty for a propeller of which the paper gives no share.
[[nodiscard]] std::span<const PaperShare> paper_shares_of(const Identification& propeller);

/// All claims, also those that these propellers cannot test. The paper gives no tolerances; those in the table are
/// chosen so that its claims do not contradict each other (doubling per inch and both offsets cannot hold exactly
/// together). Propellers are compared in standard air if the air of all is known.
[[nodiscard]] std::vector<Claim> test_claims(std::span<const Fitted> family);

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

/// Predictions of every size at every φ that a member was measured at, ascending. Throws ConfigurationError for sizes
/// with fewer than three members.
[[nodiscard]] FamilyFindings findings_of(std::span<const Fitted> family, std::span<const PropellerSize> sizes);

/// Claim, value found, 95 % interval, verdict, unless there are no claims; then slopes and predictions.
[[nodiscard]] std::string family_text(const FamilyFindings& findings);

}  // namespace kphi::fit
