// What `kphi fit` prints: the headline for people, everything for scripts.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "fit/model/identification.hpp"
#include "fit/uncertainty/analysis.hpp"

namespace kphi::fit {

/// K_T, intercept, slope, and K_T in standard air where the air is known; one line each.
[[nodiscard]] std::string headline_text(const Identification& identification);

/// The same with table, options and the whole analysis; `coefficients` is the file written.
[[nodiscard]] nlohmann::ordered_json to_json(const Identification& identification, const Analysis& analysis,
                                             const std::filesystem::path& coefficients);

/// What a reader must know besides, one line each: steps left out or flagged but kept, points that the robust loss gave
/// up, repetitions that stand out, remarks on the line, air unknown.
[[nodiscard]] std::string caution_text(const Identification& identification, const Analysis& analysis);

}  // namespace kphi::fit
