#include "fit/logs/column_roles.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>

#include "base/error.hpp"
#include "base/text.hpp"
#include "compensation/units.hpp"

namespace kphi::fit {
namespace {

struct UnitRow {
  Measure measure;
  Unit unit;
  std::array<const char*, 9> names{};  ///< messages list the first
};

constexpr double kPoundForce = 4.4482216152605;  // N, exactly (0.45359237 kg × 9.80665 m/s²)
constexpr double kInch = 0.0254;                 // m, exactly
constexpr double kGramForce = from_gram_force(1).value();
constexpr double kIdleThrottleUs = 1000;

constexpr std::array kUnits{
    UnitRow{Measure::time, {1}, {"s", "sec", "secs", "second", "seconds", "Sekunden"}},
    UnitRow{Measure::time, {1e-3}, {"ms", "msec", "millis", "milliseconds"}},
    UnitRow{Measure::time, {1e-6}, {"µs", "us", "μs", "usec", "micros", "microseconds"}},
    UnitRow{Measure::time, {60}, {"min", "minutes"}},
    UnitRow{Measure::time, {1, 0, true}, {"clock"}},
    UnitRow{Measure::throttle, {1}, {"µs", "us", "μs", "usec", "microseconds"}},
    UnitRow{Measure::throttle, {1e3}, {"ms"}},
    UnitRow{Measure::throttle, {10, kIdleThrottleUs}, {"%", "percent", "pct", "Prozent"}},
    UnitRow{Measure::throttle, {1000, kIdleThrottleUs}, {"0..1", "0-1", "share"}},
    UnitRow{Measure::speed, {1}, {"RPM", "rpm", "1/min", "min-1", "min^-1", "rev/min", "U/min", "tr/min", "Rpm"}},
    UnitRow{Measure::speed, {1}, {"r/min", "upm", "UPM", "min⁻¹", "rot/min", "turns/min"}},
    UnitRow{Measure::speed, {1 / kRadPerSecPerRpm}, {"rad/s", "rad_s", "rad/sec", "rad s-1"}},
    UnitRow{Measure::speed, {60}, {"Hz", "hz", "1/s", "rev/s", "rps", "RPS", "U/s", "s-1"}},
    UnitRow{Measure::speed, {1000}, {"krpm", "kRPM"}},
    UnitRow{Measure::thrust, {1}, {"N", "n", "newton", "newtons", "Newton", "Newtons"}},
    UnitRow{Measure::thrust, {1e-3}, {"mN"}},
    UnitRow{Measure::thrust, {1e3}, {"kN"}},
    UnitRow{Measure::thrust, {kGramForce}, {"gf", "g", "gram", "grams", "gr", "Gramm", "gramf", "grammes"}},
    UnitRow{Measure::thrust, {1000 * kGramForce}, {"kgf", "kg", "kilogram", "kilograms", "kp", "Kg", "KG", "kgs"}},
    UnitRow{Measure::thrust, {kPoundForce}, {"lbf", "lb", "lbs", "pounds"}},
    UnitRow{Measure::thrust, {kPoundForce / 16}, {"ozf", "oz", "ounces"}},
    UnitRow{Measure::torque, {1}, {"N·m", "Nm", "nm", "N m", "N*m", "N.m", "N-m", "newton_metre"}},
    UnitRow{Measure::torque, {1e-3}, {"mN·m", "mNm", "mN m", "mN*m", "mN.m"}},
    UnitRow{Measure::torque, {1e-3}, {"N·mm", "Nmm", "N mm", "N*mm"}},
    UnitRow{Measure::torque, {1e-2}, {"N·cm", "Ncm", "N cm"}},
    UnitRow{Measure::torque, {kPoundForce / 16 * kInch}, {"ozf·in", "ozf-in", "oz-in", "oz·in"}},
    UnitRow{Measure::torque, {kPoundForce * kInch}, {"lbf·in", "lbf-in", "lb-in", "in-lbf", "in-lb"}},
    UnitRow{Measure::torque, {kPoundForce * 12 * kInch}, {"lbf·ft", "lbf-ft", "ft-lbf", "ft-lb"}},
    UnitRow{Measure::torque, {kGramForce * 1e-2}, {"gf·cm", "gf-cm", "g·cm"}},
    UnitRow{Measure::voltage, {1}, {"V", "v", "volt", "volts", "Volt", "Volts"}},
    UnitRow{Measure::voltage, {1e-3}, {"mV"}},
    UnitRow{Measure::current, {1}, {"A", "a", "amp", "amps", "Amp", "Amps", "ampere", "Ampere"}},
    UnitRow{Measure::current, {1e-3}, {"mA"}},
    UnitRow{Measure::angle, {1}, {"deg", "°", "degree", "degrees", "Grad", "º"}},
    UnitRow{Measure::angle, {180 / kPi}, {"rad"}},
};

struct RoleRow {
  Role role;
  const char* name;
  Measure measure;
  bool text = false;
};

constexpr std::array<RoleRow, 14> kRoles{{
    {Role::time, "time", Measure::time},
    {Role::throttle, "throttle", Measure::throttle},
    {Role::speed, "speed", Measure::speed},
    {Role::electrical_speed, "electrical_speed", Measure::speed},
    {Role::thrust, "thrust", Measure::thrust},
    {Role::torque, "torque", Measure::torque},
    {Role::voltage, "voltage", Measure::voltage},
    {Role::current, "current", Measure::current},
    {Role::occlusion, "occlusion", Measure::angle},
    {Role::repetition, "repetition", Measure::count},
    {Role::target_speed, "target_speed", Measure::speed},
    {Role::propeller, "propeller", Measure::count, true},
    {Role::motor, "motor", Measure::count, true},
    {Role::direction, "direction", Measure::count, true},
}};

constexpr const RoleRow& row_of(Role role) { return kRoles[static_cast<std::size_t>(role)]; }

/// Names in small letters, words apart by one blank, as people write them (English, German, French, Spanish).
struct NameRow {
  Role role;
  std::vector<const char*> names;  ///< the whole of a name
  std::vector<const char*> words;  ///< one of a name's words
};

const std::vector<NameRow>& name_rows() {
  static const std::vector<NameRow> rows{
      {Role::time,
       {"time", "zeit", "temps", "tiempo", "t", "timestamp", "time stamp", "elapsed time", "elapsed", "seconds",
        "date time", "datetime", "uhrzeit", "zeitstempel"},
       {"time", "zeit", "timestamp"}},
      {Role::throttle,
       {"throttle",    "esc",        "esc signal",       "esc pwm",          "pwm",
        "gas",         "gaz",        "throttle command", "throttle setting", "motor command",
        "esc command", "pwm signal", "pwm value",        "stellsignal",      "throttle input",
        "command",     "cmd",        "motor pwm",        "esc throttle",     "drossel"},
       {"throttle", "pwm"}},
      {Role::speed,
       {"rpm",
        "speed",
        "motor speed",
        "rotor speed",
        "prop speed",
        "propeller speed",
        "rotation speed",
        "n",
        "omega",
        "rotational speed",
        "motor rpm",
        "prop rpm",
        "propeller rpm",
        "rotor rpm",
        "drehzahl",
        "motordrehzahl",
        "vitesse de rotation",
        "vitesse",
        "régime",
        "regime",
        "velocidad",
        "angular velocity",
        "angular speed",
        "rotation rate",
        "rotational frequency",
        "motor optical speed",
        "optical speed",
        "optical rpm",
        "rps",
        "krpm",
        "ω",
        "drehfrequenz",
        "revs",
        "umdrehungen"},
       {"rpm", "drehzahl", "speed", "omega"}},
      {Role::electrical_speed,
       {"motor electrical speed", "electrical speed", "electrical rpm", "elektrische drehzahl", "erpm", "e rpm",
        "esc rpm"},
       {"erpm"}},
      {Role::thrust,
       {"thrust",
        "schub",
        "schubkraft",
        "poussée",
        "poussee",
        "empuje",
        "spinta",
        "propeller thrust",
        "motor thrust",
        "static thrust",
        "zugkraft",
        "force",
        "load",
        "kraft",
        "lift",
        "auftrieb",
        "f",
        "weight",
        "thrust force",
        "pull",
        "load cell",
        "loadcell"},
       {"thrust", "schub", "poussée"}},
      {Role::torque, {"torque", "drehmoment", "moment", "couple", "motor torque", "par"}, {"torque", "drehmoment"}},
      {Role::voltage,
       {"voltage", "volt", "volts", "spannung", "tension", "vbat", "battery voltage", "supply voltage", "bus voltage",
        "input voltage", "u", "v", "batteriespannung"},
       {"voltage", "spannung"}},
      {Role::current,
       {"current", "strom", "courant", "corriente", "amps", "motor current", "esc current", "i", "stromstärke"},
       {"current", "strom"}},
      {Role::occlusion, {"occlusion", "phi", "φ", "occlusion angle", "covered angle"}, {"occlusion"}},
      {Role::repetition, {"repetition", "rep", "repeat", "wiederholung"}, {"repetition"}},
      {Role::target_speed,
       {"target rpm", "target speed", "rpm target", "set speed", "setpoint rpm", "rpm setpoint", "commanded rpm",
        "commanded speed", "rpm cmd", "rpm command", "desired rpm", "solldrehzahl", "speed setpoint", "speed command"},
       {}},
      {Role::propeller,
       {"propeller", "prop", "propeller name", "prop name", "propeller type", "hélice", "helice", "propellertyp",
        "propeller id"},
       {}},
      {Role::motor, {"motor", "motor name", "motor type", "moteur", "motor id"}, {}},
      {Role::direction, {"direction", "richtung", "rotation direction", "sens", "dir", "drehrichtung"}, {}},
  };
  return rows;
}

/// A name with one of these is of something else, whatever else is in it.
constexpr std::array kNotItself{
    "efficiency", "wirkungsgrad", "coefficient", "coeff",      "std",       "sd",         "stdev",       "sigma",
    "error",      "err",          "min",         "max",        "minimum",   "maximum",    "target",      "setpoint",
    "set",        "cmd",          "command",     "commanded",  "desired",   "ratio",      "loss",        "limit",
    "zero",       "tare",         "offset",      "ref",        "reference", "wind",       "air",         "per",
    "flow",       "uncertainty",  "ripple",      "soll",       "rate",      "derivative", "temperature", "temp",
    "date",       "vibration",    "sound",       "electrical", "tip"};
/// Words that change nothing.
constexpr std::array kFillers{"mean", "average", "avg",      "measured",  "in",
                              "the",  "of",      "mittlere", "mittlerer", "total"};

/// Small letters, words apart: "TargetRPM" → target rpm, "thrust_n" → thrust n, "rpm1" → rpm 1.
std::vector<std::string> words_of(std::string_view name) {
  std::vector<std::string> words(1);
  const auto kind = [](char c) {
    const auto byte = static_cast<unsigned char>(c);
    return byte >= 0x80u || std::islower(byte) != 0 ? 'a'
           : std::isupper(byte) != 0                ? 'A'
           : std::isdigit(byte) != 0                ? '0'
                                                    : ' ';
  };
  char before = ' ';
  for (const char c : name) {
    const char now = kind(c);
    const bool apart = now == ' ' || (before == 'a' && now == 'A') || (now == '0') != (before == '0');
    if (apart && !words.back().empty()) words.emplace_back();
    if (now != ' ') words.back() += static_cast<char>(now == 'A' ? std::tolower(c) : c);
    before = now;
  }
  if (words.back().empty()) words.pop_back();
  return words;
}

std::string as_name(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : " ") + word;
  return text;
}

bool contains(const auto& list, const std::string& word) {
  return std::ranges::any_of(list, [&](const char* one) { return word == one; });
}

/// The unit after the first of `apart` from the left whose rest is one.
std::string unit_behind(std::string_view name, std::string_view apart, Measure measure) {
  for (std::size_t at = name.find(apart); at != std::string_view::npos; at = name.find(apart, at + 1)) {
    std::string_view end = name.substr(at + apart.size());
    while (!end.empty() && end.front() == ' ') end.remove_prefix(1);
    if (unit_named(measure, end)) return std::string(end);
  }
  return {};
}

bool ends_with_word(std::string_view name, std::string_view end) {
  return name.size() > end.size() && name.ends_with(end) &&
         std::isalnum(static_cast<unsigned char>(name[name.size() - end.size() - 1])) == 0;
}

/// The header without its unit.
std::string bare_name(std::string_view header, Measure measure) {
  std::string name = split_header(header).name;
  const std::string unit = unit_in(name, measure);
  if (!unit.empty() && ends_with_word(name, unit)) name.resize(name.size() - unit.size());
  return name;
}

NameMatch match(const NameRow& row, std::string_view header) {
  std::vector<std::string> words = words_of(bare_name(header, measure_of(row.role)));
  std::erase_if(words, [](const std::string& word) { return contains(kFillers, word); });
  if (words.size() > 1 && std::ranges::all_of(words.back(), [](unsigned char c) { return std::isdigit(c) != 0; }))
    words.pop_back();
  if (contains(row.names, as_name(words))) return {row.role, 2};
  const bool other = std::ranges::any_of(words, [](const std::string& word) { return contains(kNotItself, word); });
  const bool in_it = std::ranges::any_of(words, [&](const std::string& word) { return contains(row.words, word); });
  return {row.role, in_it && !other ? 1 : 0};
}

}  // namespace

const char* name_of(Role role) { return row_of(role).name; }

std::optional<Role> role_named(std::string_view name) {
  for (const RoleRow& row : kRoles)
    if (name == row.name) return row.role;
  return std::nullopt;
}

std::string role_list() {
  std::string list;
  for (const RoleRow& row : kRoles) list += (list.empty() ? "" : ", ") + std::string(row.name);
  return list;
}

bool is_text(Role role) { return row_of(role).text; }

Measure measure_of(Role role) { return row_of(role).measure; }

std::optional<Unit> unit_named(Measure measure, std::string_view unit) {
  if (measure == Measure::count) return Unit{};
  for (const UnitRow& row : kUnits)
    for (const char* name : row.names)
      if (row.measure == measure && name != nullptr && unit == name) return row.unit;
  return std::nullopt;
}

std::string unit_list(Measure measure) {
  std::string list;
  for (const UnitRow& row : kUnits) {
    const bool listed = list.find(row.names.front()) != std::string::npos && list.size() < 3;
    if (row.measure == measure && !listed) list += (list.empty() ? "" : ", ") + std::string(row.names.front());
  }
  return list;
}

bool is_unit(std::string_view field) {
  if (field.size() > 2 && (field.front() == '(' || field.front() == '[')) field = field.substr(1, field.size() - 2);
  constexpr std::array kOthers{"W",  "w",  "kW",  "g/W",   "gf/W", "N/W", "°C", "C",
                               "ºC", "Pa", "m/s", "kg/m3", "mAh",  "Wh",  "dB", "K"};
  if (std::ranges::any_of(kOthers, [&](const char* other) { return field == other; })) return true;
  return std::ranges::any_of(kUnits, [&](const UnitRow& row) {
    return std::ranges::any_of(row.names, [&](const char* name) { return name != nullptr && field == name; });
  });
}

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

std::string unit_in(std::string_view header, Measure measure) {
  if (measure == Measure::count) return {};
  const HeaderName parts = split_header(header);
  if (!parts.unit.empty()) return parts.unit;
  if (unit_named(measure, header) && measure == Measure::speed && header.size() > 2) return std::string(header);
  for (const std::string_view apart : {"_", " in ", " ", ", ", "/", "-"})
    if (std::string unit = unit_behind(header, apart, measure); !unit.empty()) return unit;
  // "MotorRPM", "rpm1", "RPM left": the word itself is a unit.
  if (measure == Measure::speed)
    for (const std::string& word : words_of(header))
      if (word == "rpm" || word == "rps" || word == "krpm") return word;
  return {};
}

std::vector<NameMatch> roles_of(std::string_view header) {
  std::vector<NameMatch> matches;
  for (const NameRow& row : name_rows())
    if (const NameMatch one = match(row, header); one.certainty > 0) matches.push_back(one);
  return matches;
}

bool counts_electrical_turns(std::string_view header) {
  const auto words = words_of(split_header(header).name);
  return match(name_rows()[static_cast<std::size_t>(Role::electrical_speed)], header).certainty > 0 &&
         as_name(words) != "motor electrical speed";
}

std::optional<std::string> without_digits(std::string_view header) {
  std::string name = split_header(header).name;
  const std::size_t before = name.size();
  std::erase_if(name, [](unsigned char c) { return std::isdigit(c) != 0; });
  return name.size() < before ? std::optional(name) : std::nullopt;
}

ColumnRole parse_column_role(std::string_view text) {
  const std::size_t equals = text.find('=');
  const auto role = role_named(text.substr(0, equals));
  if (!role || equals == std::string_view::npos || equals + 1 == text.size()) {
    throw ConfigurationError(
        fmt::format("--column {}: expected ROLE=HEADER or ROLE=HEADER:UNIT with ROLE one of {}", text, role_list()));
  }
  ColumnRole column{*role, std::string(text.substr(equals + 1)), ""};
  const std::size_t colon = column.header.rfind(':');
  if (colon != std::string::npos && measure_of(*role) != Measure::count &&
      unit_named(measure_of(*role), column.header.substr(colon + 1))) {
    column.unit = column.header.substr(colon + 1);
    column.header.resize(colon);
  }
  return column;
}

}  // namespace kphi::fit
