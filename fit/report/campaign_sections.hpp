// Sections of the report about the campaign: power, steps left out, runs, provenance and hashes.
#pragma once

#include <string>

#include "fit/coefficients/coefficients.hpp"

namespace kphi::fit {

[[nodiscard]] std::string campaign_sections(const Identification& identification, const Provenance& provenance);

}  // namespace kphi::fit
