// When the supply must stop the bench.
#pragma once

#include <optional>

#include "daq/interlock.hpp"
#include "profiles/supply_place.hpp"
#include "results/supply_reading.hpp"

namespace kphi::daq {

inline constexpr double kSupplySag = 0.05;   ///< share of the set voltage that may be missing
inline constexpr double kSupplyRise = 0.03;  ///< share above it: more than a meter errs by, so the motor feeds back

/// "supply: its over-current protection has switched it off".
[[nodiscard]] std::string tripped_words(const results::SupplyReading& seen);

/// What is wrong with one reading while the motor may turn; nothing: no trip. Protection, output, settings that
/// somebody has changed; and, once the speed has `settled`, constant current, sag and rise, which a change of speed may
/// bring.
[[nodiscard]] std::optional<Trip> check(const results::SupplyReading& seen, const profiles::SupplyPlace& wanted,
                                        bool settled);

}  // namespace kphi::daq
