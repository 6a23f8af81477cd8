// The paper's statements across propellers as a table: claim, value found, interval, verdict.
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
  not_tested,  ///< the data lack what the claim is about
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
};

/// Every claim stands in the table, also those that these propellers cannot test. The paper gives no tolerances: those
/// allowed here stand in the table, chosen so that its claims do not contradict each other (doubling per inch and both
/// offsets cannot hold exactly together). Propellers are compared in standard air where the air of all is known.
[[nodiscard]] std::vector<Claim> test_claims(std::span<const FamilyMember> family);

}  // namespace kphi::fit
