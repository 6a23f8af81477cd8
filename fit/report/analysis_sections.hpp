// Sections of the report about k(φ) and how far to believe it, each with its heading; empty if the data have none.
#pragma once

#include <string>

#include "fit/uncertainty/analysis.hpp"

namespace kphi::fit {

/// Thrust at the φ of `row` over the thrust at φ = 0, at the reference speed if there is one.
[[nodiscard]] double share_of_thrust(const Identification& identification, const OcclusionCoefficient& row);

/// k of each occlusion, and the curve beside it.
[[nodiscard]] std::string coefficient_section(const Fitted& fitted);

/// k in air of 1.225 kg/m³, or that the density is unknown.
[[nodiscard]] std::string standard_section(const Fitted& fitted);

/// Rejected points, budget, predictions, k against speed.
[[nodiscard]] std::string analysis_sections(const Analysis& analysis);
/// Tests, torque.
[[nodiscard]] std::string analysis_appendix(const Analysis& analysis);

}  // namespace kphi::fit
