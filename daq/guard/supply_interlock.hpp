// When the supply must stop the bench.
#pragma once

#include <optional>

#include "daq/guard/interlock.hpp"
#include "profiles/bench_config.hpp"
#include "results/supply_reading.hpp"

namespace kphi::daq {

/// "supply: over-current protection switched the output off".
[[nodiscard]] std::string tripped_words(const results::SupplyReading& seen);

/// Checks one reading while the motor may turn: protection, output, settings changed on the front panel; and, once the
/// speed has `settled`, constant current, sag and rise, which a change of speed may bring. nullopt: no trip.
[[nodiscard]] std::optional<Trip> check(const results::SupplyReading& seen, const profiles::SupplyConfig& wanted,
                                        bool settled);

}  // namespace kphi::daq
