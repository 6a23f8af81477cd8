#include "drivers/netbox/configuration/changes.hpp"

namespace kphi::netbox {
namespace {

struct Row {
  Change change;
  const char* name;
  bool (*differs)(const Configuration&, const Configuration&);
};

template <auto Member>
constexpr bool differ(const Configuration& a, const Configuration& b) {
  return !(a.*Member == b.*Member);
}

using C = Configuration;
constexpr Row kTable[] = {
    {Change::product, "product",
     [](const C& a, const C& b) { return a.product != b.product || a.kind != b.kind || a.serial != b.serial; }},
    {Change::firmware, "firmware", differ<&C::firmware>},
    {Change::calibration, "calibration", differ<&C::calibration_serial>},
    {Change::slot, "configuration slot", differ<&C::slot>},
    {Change::units, "units",
     [](const C& a, const C& b) { return a.force_unit != b.force_unit || a.torque_unit != b.torque_unit; }},
    {Change::counts_per_unit, "counts per unit",
     [](const C& a, const C& b) {
       return a.counts_per_newton != b.counts_per_newton || a.counts_per_newton_metre != b.counts_per_newton_metre;
     }},
    {Change::ranges, "ranges", differ<&C::range>},
    {Change::rate, "rate",
     [](const C& a, const C& b) { return a.divisor != b.divisor || a.device_rate_hz != b.device_rate_hz; }},
    {Change::records_per_datagram, "records per datagram", differ<&C::records_per_datagram>},
    {Change::filter, "filter", differ<&C::filter_code>},
    {Change::tool_transform, "tool transform",
     [](const C& a, const C& b) {
       return a.tool_transform != b.tool_transform || a.tool_distance_unit != b.tool_distance_unit ||
              a.tool_angle_unit != b.tool_angle_unit;
     }},
    {Change::gage_bias, "gage bias", differ<&C::gage_bias>},
};

}  // namespace

Changes compare(const Configuration& before, const Configuration& after) {
  Changes changes = 0;
  for (const Row& row : kTable) {
    if (row.differs(before, after)) changes |= static_cast<Changes>(row.change);
  }
  return changes;
}

std::string to_words(Changes changes) {
  std::string words;
  for (const Row& row : kTable) {
    if (has(changes, row.change)) words += (words.empty() ? "" : ", ") + std::string(row.name);
  }
  return words;
}

bool forgot_peaks(const Configuration& before, const Configuration& after) noexcept {
  if (!before.peaks || !after.peaks) return false;
  for (std::size_t axis = 0; axis < 6; ++axis) {
    if (after.peaks->high[axis] < before.peaks->high[axis] || after.peaks->low[axis] > before.peaks->low[axis])
      return true;
  }
  return false;
}

}  // namespace kphi::netbox
