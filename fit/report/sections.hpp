// The tables of the report: each a section of HTML (well-formed XML) with its heading; empty if the data have none.
#pragma once

#include <span>
#include <string>

#include "fit/coefficients/coefficients.hpp"
#include "fit/propellers/claims.hpp"
#include "fit/uncertainty/analysis.hpp"

namespace kphi::fit {

/// N/(rad/s)² → N/RPM², for numbers on the page.
[[nodiscard]] double per_rpm2(double k);
/// "19100"
[[nodiscard]] std::string rpm_text(double speed_rad_s);

/// Thrust at the φ of `row` over the thrust at φ = 0, at the reference speed if there is one.
[[nodiscard]] double share_of_thrust(const Identification& identification, const OcclusionCoefficient& row);

/// What to know before the line is flown, as a box.
[[nodiscard]] std::string remark_section(std::span<const std::string> remarks);
[[nodiscard]] std::string coefficient_section(const Identification& identification);
[[nodiscard]] std::string standard_section(const Identification& identification);
/// Rejected points, budget, predictions, k against speed, tests, torque.
[[nodiscard]] std::string analysis_sections(const Analysis& analysis);
/// A few steps of each φ, the fastest among them.
[[nodiscard]] std::string power_section(const Identification& identification);
/// Steps left out or flagged.
[[nodiscard]] std::string step_section(const StepSelection& selection);
[[nodiscard]] std::string run_section(const Provenance& provenance, const StepSelection& selection);
/// Where the numbers come from, and the hashes of the runs.
[[nodiscard]] std::string provenance_section(const Identification& identification, const Provenance& provenance);

/// Several propellers: their lines side by side, one slope for each diameter, the paper's statements.
[[nodiscard]] std::string family_section(std::span<const Identification* const> family);
[[nodiscard]] std::string slopes_section(std::span<const SharedSlope> slopes);
[[nodiscard]] std::string claims_section(std::span<const Claim> claims);

}  // namespace kphi::fit
