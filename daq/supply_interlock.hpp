// When the supply must stop the bench.
#pragma once

#include <optional>

#include "daq/interlock.hpp"
#include "profiles/supply_place.hpp"
#include "results/supply_reading.hpp"

namespace kphi::daq {

inline constexpr double kSupplySag = 0.05;   ///< share of the set voltage that may be missing
inline constexpr double kSupplyRise = 0.03;  ///< share above it: more than a meter errs by, so the motor feeds back

/// What is wrong with one reading while the motor may turn; nothing: no trip. Protection, output, constant current,
/// settings that somebody has changed, sag, rise.
[[nodiscard]] std::optional<Trip> check(const results::SupplyReading& seen, const profiles::SupplyPlace& wanted);

}  // namespace kphi::daq
