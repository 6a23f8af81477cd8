// What an analysis adds to the report: the budget, the tests, the torque, the claims.
#pragma once

#include <span>
#include <string>

#include "fit/propellers/claims.hpp"
#include "fit/propellers/family.hpp"
#include "fit/uncertainty/analysis.hpp"

namespace kphi::fit {

/// Sections of HTML (well-formed XML), each with its heading; what an analysis does not hold has none.
[[nodiscard]] std::string analysis_sections(const Analysis& analysis);

/// What one must know of the line, as a box; empty without.
[[nodiscard]] std::string remark_section(std::span<const std::string> remarks);

/// Claim, value found, interval, verdict.
[[nodiscard]] std::string claims_section(std::span<const Claim> claims);
/// One slope for each diameter; empty without.
[[nodiscard]] std::string slopes_section(std::span<const SharedSlope> slopes);

}  // namespace kphi::fit
