// Sections of the report about several propellers, each with its heading; empty if the data have none.
#pragma once

#include <span>
#include <string>

#include "fit/propellers/claims.hpp"
#include "fit/propellers/family.hpp"

namespace kphi::fit {

/// K_T and the slope of a line, side by side.
[[nodiscard]] std::string family_section(std::span<const Fitted> family);

/// K_T of logs without occlusions.
[[nodiscard]] std::string logs_section(std::span<const Fitted> logs);
/// One slope for each diameter.
[[nodiscard]] std::string slopes_section(std::span<const SharedSlope> slopes);

/// The paper's statements about several propellers.
[[nodiscard]] std::string claims_section(std::span<const Claim> claims);

}  // namespace kphi::fit
