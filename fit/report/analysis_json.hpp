// An analysis as JSON: numbers with units in the keys, a number that nobody knows is null.
#pragma once

#include <nlohmann/json.hpp>
#include <span>

#include "fit/propellers/claims.hpp"
#include "fit/signal/blade_pass.hpp"
#include "fit/signal/dynamics.hpp"
#include "fit/uncertainty/analysis.hpp"

namespace kphi::fit {

[[nodiscard]] nlohmann::ordered_json to_json(const Budget& budget);
[[nodiscard]] nlohmann::ordered_json to_json(const HypothesisTest& test);
[[nodiscard]] nlohmann::ordered_json to_json(const Analysis& analysis);
[[nodiscard]] nlohmann::ordered_json to_json(std::span<const Claim> claims);
/// What the raw samples tell; null where they cannot.
[[nodiscard]] nlohmann::ordered_json raw_to_json(const std::optional<Dynamics>& dynamics,
                                                 const std::optional<BladePassCheck>& blade_pass);

}  // namespace kphi::fit
