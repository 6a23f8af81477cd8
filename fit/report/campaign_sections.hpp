// Sections of the report about the campaign, each with its heading.
#pragma once

#include <string>

#include "fit/coefficients/coefficients.hpp"

namespace kphi::fit {

/// Provenance.
[[nodiscard]] std::string campaign_sections(const Identification& identification, const Provenance& provenance);
/// Power, steps left out, runs and their hashes.
[[nodiscard]] std::string campaign_appendix(const Identification& identification, const Provenance& provenance);

}  // namespace kphi::fit
