#include "fit/logs/column_unit.hpp"

#include <array>

#include "compensation/units.hpp"

namespace kphi::fit {
namespace {

struct UnitRow {
  Measure measure;
  const char* unit;
  double factor;
  bool other_name = false;  ///< of a unit above it; not listed in messages
};

constexpr double kPoundForce = 4.4482216152605;  // N, exactly (0.45359237 kg × 9.80665 m/s²)
constexpr double kInch = 0.0254;                 // m, exactly
constexpr double kGramForce = from_gram_force(1).value();

constexpr std::array kUnits{
    UnitRow{Measure::time, "s", 1},
    UnitRow{Measure::time, "ms", 1e-3},
    UnitRow{Measure::time, "µs", 1e-6},
    UnitRow{Measure::time, "us", 1e-6, true},
    UnitRow{Measure::time, "min", 60},
    UnitRow{Measure::throttle, "µs", 1},
    UnitRow{Measure::throttle, "us", 1, true},
    UnitRow{Measure::throttle, "ms", 1e3},
    UnitRow{Measure::speed, "RPM", 1},
    UnitRow{Measure::speed, "rpm", 1, true},
    UnitRow{Measure::speed, "1/min", 1, true},
    UnitRow{Measure::speed, "rad/s", 1 / kRadPerSecPerRpm},
    UnitRow{Measure::speed, "rad_s", 1 / kRadPerSecPerRpm, true},
    UnitRow{Measure::speed, "Hz", 60},
    UnitRow{Measure::speed, "hz", 60, true},
    UnitRow{Measure::speed, "1/s", 60, true},
    UnitRow{Measure::speed, "rev/s", 60, true},
    UnitRow{Measure::speed, "krpm", 1000},
    UnitRow{Measure::thrust, "N", 1},
    UnitRow{Measure::thrust, "n", 1, true},
    UnitRow{Measure::thrust, "mN", 1e-3},
    UnitRow{Measure::thrust, "kN", 1e3},
    UnitRow{Measure::thrust, "gf", kGramForce},
    UnitRow{Measure::thrust, "g", kGramForce, true},
    UnitRow{Measure::thrust, "kgf", 1000 * kGramForce},
    UnitRow{Measure::thrust, "kg", 1000 * kGramForce, true},
    UnitRow{Measure::thrust, "lbf", kPoundForce},
    UnitRow{Measure::thrust, "lb", kPoundForce, true},
    UnitRow{Measure::thrust, "ozf", kPoundForce / 16},
    UnitRow{Measure::thrust, "oz", kPoundForce / 16, true},
    UnitRow{Measure::torque, "N·m", 1},
    UnitRow{Measure::torque, "Nm", 1, true},
    UnitRow{Measure::torque, "nm", 1, true},
    UnitRow{Measure::torque, "N m", 1, true},
    UnitRow{Measure::torque, "mN·m", 1e-3},
    UnitRow{Measure::torque, "mNm", 1e-3, true},
    UnitRow{Measure::torque, "N·mm", 1e-3},
    UnitRow{Measure::torque, "Nmm", 1e-3, true},
    UnitRow{Measure::torque, "ozf·in", kPoundForce / 16 * kInch},
    UnitRow{Measure::torque, "ozf-in", kPoundForce / 16 * kInch, true},
    UnitRow{Measure::torque, "lbf·in", kPoundForce* kInch},
    UnitRow{Measure::torque, "lbf·ft", kPoundForce * 12 * kInch},
    UnitRow{Measure::torque, "gf·cm", kGramForce * 1e-2},
    UnitRow{Measure::voltage, "V", 1},
    UnitRow{Measure::voltage, "v", 1, true},
    UnitRow{Measure::voltage, "mV", 1e-3},
    UnitRow{Measure::current, "A", 1},
    UnitRow{Measure::current, "a", 1, true},
    UnitRow{Measure::current, "mA", 1e-3},
    UnitRow{Measure::angle, "deg", 1},
    UnitRow{Measure::angle, "°", 1, true},
    UnitRow{Measure::angle, "rad", 180 / kPi},
};

}  // namespace

HeaderName split_header(std::string_view header) {
  for (const auto& [open, close] : {std::pair('(', ')'), std::pair('[', ']')}) {
    if (header.empty() || header.back() != close) continue;
    const std::size_t begin = header.rfind(open);
    if (begin == std::string_view::npos) continue;
    std::string_view name = header.substr(0, begin);
    while (!name.empty() && name.back() == ' ') name.remove_suffix(1);
    return {std::string(name), std::string(header.substr(begin + 1, header.size() - begin - 2))};
  }
  return {std::string(header), ""};
}

std::string unit_suffix(std::string_view name, Measure measure) {
  for (std::size_t bar = name.find('_'); bar != std::string_view::npos; bar = name.find('_', bar + 1)) {
    const std::string_view end = name.substr(bar + 1);
    if (unit_factor(measure, end)) return std::string(end);
  }
  return {};
}

std::optional<double> unit_factor(Measure measure, std::string_view unit) {
  if (measure == Measure::count) return 1.0;
  for (const UnitRow& row : kUnits)
    if (row.measure == measure && row.unit == unit) return row.factor;
  return std::nullopt;
}

std::string unit_list(Measure measure) {
  std::string list;
  for (const UnitRow& row : kUnits) {
    if (row.measure != measure || row.other_name) continue;
    list += (list.empty() ? "" : ", ") + std::string(row.unit);
  }
  return list;
}

}  // namespace kphi::fit
