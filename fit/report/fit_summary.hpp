// What `kphi fit` and `kphi compare` print: a headline to read, JSON for scripts (units in the keys; an unknown number
// is null).
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "fit/model/identification.hpp"
#include "fit/propellers/claims.hpp"
#include "fit/signal/blade_pass.hpp"
#include "fit/signal/dynamics.hpp"
#include "fit/uncertainty/analysis.hpp"

namespace kphi::fit {

/// "± is 95 % by the GUM; unknown and not in it: cell calibration (see --u)": of every headline.
[[nodiscard]] std::string plus_minus_words(const Budget& budget);

/// Whether to fly, and what speaks against it; then K_T, the parameters of the curve, and K_T in standard air if the
/// air is known, one line each; what their ± says.
[[nodiscard]] std::string headline_text(const Fitted& fitted);

/// Cautions, one line each: steps left out or kept with a flag, points that the robust loss rejected, repetitions that
/// stand out, remarks on the curve, air unknown.
[[nodiscard]] std::string caution_text(const Identification& identification, const Analysis& analysis);

/// Headline, table, options and the whole analysis; `coefficients` is the file written.
[[nodiscard]] nlohmann::ordered_json fit_json(const Identification& identification, const Analysis& analysis,
                                              const std::filesystem::path& coefficients);
void to_json(nlohmann::ordered_json& json, const Analysis& analysis);
void to_json(nlohmann::ordered_json& json, const HypothesisTest& test);
void to_json(nlohmann::ordered_json& json, const FamilyFindings& findings);
void to_json(nlohmann::ordered_json& json, const Dynamics& dynamics);
void to_json(nlohmann::ordered_json& json, const BladePassCheck& check);

}  // namespace kphi::fit
