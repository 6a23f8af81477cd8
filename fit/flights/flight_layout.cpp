#include "fit/flights/flight_layout.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "base/number.hpp"
#include "base/text.hpp"
#include "compensation/units.hpp"
#include "fit/logs/column_roles.hpp"
#include "profiles/profile_reader.hpp"

namespace kphi::fit {
namespace {

struct FlightQuantityRow {
  FlightQuantity quantity;
  const char* name;
  std::size_t channels;
  std::optional<Measure> measure;  ///< whose units it has
  Unit inside;                     ///< from the unit inside of a table of a stand to that of a FlightLog
  const char* units;               ///< for messages
};

using Q = FlightQuantity;
constexpr std::array kFlightQuantities{
    FlightQuantityRow{Q::time, "time", 1, Measure::time, {}, "s, ms, us"},
    FlightQuantityRow{Q::specific_force, "specific_force", 3, {}, {}, "m/s^2, g"},
    FlightQuantityRow{Q::angular_rate, "angular_rate", 3, {}, {}, "rad/s, deg/s"},
    FlightQuantityRow{Q::angular_acceleration, "angular_acceleration", 3, {}, {}, "rad/s^2, deg/s^2"},
    FlightQuantityRow{Q::rotor_speed, "rotor_speed", 12, Measure::speed, {kRadPerSecPerRpm}, "rad/s, RPM, Hz"},
    FlightQuantityRow{Q::command, "command", 12, Measure::throttle, {1e-3, -1}, "0..1, %, us"},
    FlightQuantityRow{Q::arm_angle, "arm_angle", 12, Measure::angle, {kPi / 180}, "rad, deg"},
    FlightQuantityRow{Q::voltage, "voltage", 1, Measure::voltage, {}, "V, mV"},
    FlightQuantityRow{Q::density, "density", 1, {}, {}, "kg/m^3"},
    FlightQuantityRow{Q::height, "height", 1, {}, {}, "m, cm, mm"},
    FlightQuantityRow{Q::climb, "climb", 1, {}, {}, "m/s, cm/s, mm/s"}};

struct FlightUnit {
  Q quantity;
  const char* name;
  double factor;
};

/// Of quantities that a stand's table has not.
constexpr std::array kFlightUnits{FlightUnit{Q::specific_force, "m/s^2", 1},
                                  FlightUnit{Q::specific_force, "g", 9.80665},
                                  FlightUnit{Q::angular_rate, "rad/s", 1},
                                  FlightUnit{Q::angular_rate, "deg/s", kPi / 180},
                                  FlightUnit{Q::angular_acceleration, "rad/s^2", 1},
                                  FlightUnit{Q::angular_acceleration, "deg/s^2", kPi / 180},
                                  FlightUnit{Q::density, "kg/m^3", 1},
                                  FlightUnit{Q::height, "m", 1},
                                  FlightUnit{Q::height, "cm", 1e-2},
                                  FlightUnit{Q::height, "mm", 1e-3},
                                  FlightUnit{Q::climb, "m/s", 1},
                                  FlightUnit{Q::climb, "cm/s", 1e-2},
                                  FlightUnit{Q::climb, "mm/s", 1e-3}};

const FlightQuantityRow& flight_row(Q quantity) {
  return *std::ranges::find(kFlightQuantities, quantity, &FlightQuantityRow::quantity);
}

std::optional<Unit> flight_unit(const FlightQuantityRow& row, const std::string& name) {
  if (row.measure) {
    const auto unit = unit_named(*row.measure, name);
    if (!unit || unit->clock) return std::nullopt;
    return Unit{unit->factor * row.inside.factor, unit->offset * row.inside.factor + row.inside.offset};
  }
  const auto found = std::ranges::find_if(
      kFlightUnits, [&](const FlightUnit& unit) { return unit.quantity == row.quantity && name == unit.name; });
  return found == kFlightUnits.end() ? std::nullopt : std::optional(Unit{found->factor});
}

FlightSource read_source(profiles::ProfileReader& file, const std::string& at, bool z_down) {
  const FlightQuantityRow& row = *std::ranges::find_if(
      kFlightQuantities, [name = file.text(at + "/channel")](const auto& one) { return name == one.name; });
  FlightSource source{row.quantity, static_cast<std::size_t>(file.get_or<int>(at + "/number", 1)) - 1,
                      file.text(at + "/series"), file.get_or(at + "/factor", 1.0), file.get_or(at + "/offset", 0.0)};
  if (source.index >= row.channels)
    file.refuse(at + "/number", fmt::format("there are {} of {}", row.channels, row.name), "number them from 1");
  if (source.factor == 0) file.refuse(at + "/factor", "0", "name what one unit of the series is");
  const auto unit = flight_unit(row, file.text(at + "/unit"));
  if (!unit)
    file.refuse(at + "/unit", fmt::format("not a unit of {}", row.name), fmt::format("known are {}", row.units));
  const Unit known = unit.value_or(Unit{});
  const double sign = z_down && row.channels == 3 && source.index > 0 ? -1 : 1;
  source.factor *= sign * known.factor;
  source.offset = sign * (source.offset * known.factor + known.offset);
  return source;
}

}  // namespace

const char* name_of(FlightQuantity quantity) { return flight_row(quantity).name; }

bool FlightLayout::has(FlightQuantity quantity) const {
  return std::ranges::find(sources, quantity, &FlightSource::quantity) != sources.end();
}

FlightLayout parse_flight_layout(const std::string& text, const std::string& path) {
  profiles::ProfileReader file(text, path, profiles::FileKind::flight_layout);
  FlightLayout layout;
  const bool z_down = file.get_or<std::string>("/frame", "FLU") == "FRD";
  if (const auto decimal = file.find<std::string>("/decimal")) layout.decimal = *decimal == "point" ? '.' : ',';
  for (std::size_t i = 0; i < file.size("/series"); ++i) {
    const std::string at = fmt::format("/series/{}", i);
    const FlightSource source = read_source(file, at, z_down);
    if (std::ranges::any_of(layout.sources, [&](const FlightSource& other) {
          return other.quantity == source.quantity && other.index == source.index;
        }))
      file.refuse(at, fmt::format("a second {} {}", name_of(source.quantity), source.index + 1), "name one");
    layout.sources.push_back(source);
  }
  file.finish();
  return layout;
}

std::string describe(const FlightLayout& layout) {
  std::string text;
  for (const FlightSource& one : layout.sources)
    text += fmt::format("  {:<22}{} · {}{}\n", fmt::format("{} {}", name_of(one.quantity), one.index + 1),
                        in_quotes(one.series), shortest(one.factor),
                        one.offset == 0 ? "" : fmt::format(" + {}", shortest(one.offset)));
  return text;
}

}  // namespace kphi::fit
