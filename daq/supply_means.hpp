// What the bench supply showed in a step.
#pragma once

#include <cstdint>
#include <span>

#include "results/step_mean.hpp"
#include "results/supply_reading.hpp"

namespace kphi::daq {

/// Fills voltage, current and power with the means of the readings in [begin, end), bench time; nothing without any.
/// `readings` by time.
void take_supply(std::span<const results::SupplyReading> readings, std::int64_t begin, std::int64_t end,
                 results::StepMean& mean);

/// Bits of results::Doubt that the readings in [begin, end) raise, of which the speed has `settled`, as in the
/// interlock.
[[nodiscard]] std::uint32_t supply_doubts(std::span<const results::SupplyReading> readings, std::int64_t begin,
                                          std::int64_t end, bool settled);

}  // namespace kphi::daq
