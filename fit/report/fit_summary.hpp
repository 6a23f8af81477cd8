// What `kphi fit` and `kphi compare` print: a headline to read, JSON for scripts (units in the keys; an unknown number
// is null).
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "fit/model/identification.hpp"
#include "fit/propellers/claims.hpp"
#include "fit/signal/blade_pass.hpp"
#include "fit/signal/dynamics.hpp"
#include "fit/uncertainty/analysis.hpp"

namespace kphi::fit {

/// "1.5500e-06 ± 1.2e-09": the value to the second digit of its standard error; without one, six digits.
[[nodiscard]] std::string with_error(double value, double standard_error);

/// K_T, intercept, slope, and K_T in standard air if the air is known; one line each.
[[nodiscard]] std::string headline_text(const Identification& identification);

/// Cautions, one line each: steps left out or kept with a flag, points that the robust loss rejected, repetitions that
/// stand out, remarks on the line, air unknown.
[[nodiscard]] std::string caution_text(const Identification& identification, const Analysis& analysis);

/// Headline, table, options and the whole analysis; `coefficients` is the file written.
[[nodiscard]] nlohmann::ordered_json to_json(const Identification& identification, const Analysis& analysis,
                                             const std::filesystem::path& coefficients);
[[nodiscard]] nlohmann::ordered_json to_json(const Analysis& analysis);
[[nodiscard]] nlohmann::ordered_json to_json(const Budget& budget);
[[nodiscard]] nlohmann::ordered_json to_json(const HypothesisTest& test);
[[nodiscard]] nlohmann::ordered_json to_json(const FamilyFindings& findings);
/// What the raw samples show; null where they cannot.
[[nodiscard]] nlohmann::ordered_json raw_to_json(const std::optional<Dynamics>& dynamics,
                                                 const std::optional<BladePassCheck>& blade_pass);

}  // namespace kphi::fit
