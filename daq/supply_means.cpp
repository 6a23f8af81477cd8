#include "daq/supply_means.hpp"

#include <algorithm>

#include "daq/supply_interlock.hpp"

namespace kphi::daq {
namespace {

using results::Doubt;
using results::SupplyReading;

std::span<const SupplyReading> within(std::span<const SupplyReading> readings, std::int64_t begin, std::int64_t end) {
  const auto at = [&](std::int64_t time) {
    return std::partition_point(readings.begin(), readings.end(), [&](const auto& r) { return r.time_ns < time; });
  };
  const auto first = at(begin);
  return {first, std::max(first, at(end))};
}

}  // namespace

void take_supply(std::span<const SupplyReading> readings, std::int64_t begin, std::int64_t end,
                 results::StepMean& mean) {
  const auto seen = within(readings, begin, end);
  if (seen.empty()) return;
  const double n = static_cast<double>(seen.size());
  mean.supply_v = mean.supply_a = mean.supply_w = 0;
  for (const SupplyReading& reading : seen) {
    mean.supply_v += reading.voltage_v / n;
    mean.supply_a += reading.current_a / n;
    mean.supply_w += reading.voltage_v * reading.current_a / n;
  }
}

std::uint32_t supply_doubts(std::span<const SupplyReading> readings, std::int64_t begin, std::int64_t end,
                            bool settled) {
  std::uint32_t bits = 0;
  const auto note = [&](Doubt doubt, bool applies) { bits |= applies ? static_cast<std::uint32_t>(doubt) : 0u; };
  for (const SupplyReading& seen : within(readings, begin, end)) {
    const bool off = seen.output == 0 || seen.protection != results::SupplyProtection::none;
    note(Doubt::supply_off, off);
    if (!settled) continue;
    note(Doubt::supply_limited, seen.regulation == results::SupplyRegulation::constant_current);
    note(Doubt::supply_sag, !(seen.voltage_v >= (1 - kSupplySag) * seen.set_voltage_v));
    note(Doubt::supply_rise, seen.voltage_v > (1 + kSupplyRise) * seen.set_voltage_v);
  }
  return bits;
}

}  // namespace kphi::daq
