// What the columns of a stand's table measure: their roles, the names that people give them, and their units. Inside:
// s, µs, RPM, N, N m, V, A, degrees.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace kphi::fit {

enum class Role : std::uint8_t {
  time,
  throttle,
  speed,             ///< of the only source there is, or optical; several columns: one for each rotor
  electrical_speed,  ///< counted by the speed controller: needs the motor's pole count
  thrust,
  torque,
  voltage,
  current,
  occlusion,
  repetition,
  target_speed,  ///< what a script asked for
  propeller,     ///< this and the next two: text, rows of different ones are different things
  motor,
  direction,
};

/// "electrical_speed"
[[nodiscard]] const char* name_of(Role role);
[[nodiscard]] std::optional<Role> role_named(std::string_view name);
/// "time, throttle, …"
[[nodiscard]] std::string role_list();
/// Its column holds text that tells groups of rows apart.
[[nodiscard]] bool is_text(Role role);

/// What a column measures, and the unit inside: s, µs, RPM, N, N m, V, A, degree, 1.
enum class Measure : std::uint8_t { time, throttle, speed, thrust, torque, voltage, current, angle, count };
[[nodiscard]] Measure measure_of(Role role);

/// value inside = number · factor + offset
struct Unit {
  double factor = 1;
  double offset = 0;   ///< of the throttle alone: 0 % is 1000 µs
  bool clock = false;  ///< a time of day or a date with one, not a number
  [[nodiscard]] bool operator==(const Unit&) const = default;
};

/// nullopt for a unit that the measure does not have. Case counts only where two units differ by it (mN, MN).
[[nodiscard]] std::optional<Unit> unit_named(Measure measure, std::string_view unit);
/// The units of the measure, for messages: "N, mN, kN, gf, …".
[[nodiscard]] std::string unit_list(Measure measure);
/// Of any measure, brackets around it allowed: what a line of units below the header consists of.
[[nodiscard]] bool is_unit(std::string_view field);

struct HeaderName {
  std::string name;
  std::string unit;  ///< as written; empty: no unit
};

/// "Thrust (gf)" and "Thrust [gf]" → Thrust, gf. Without brackets all of it is the name.
[[nodiscard]] HeaderName split_header(std::string_view header);

/// The unit of the measure that a header has in brackets, or behind a '_', a blank, ',' or '/' at its end ("thrust_n",
/// "speed_rad_s", "Schub in N", "RPM"); of a unit in brackets that the measure does not have, that one; else empty.
[[nodiscard]] std::string unit_in(std::string_view header, Measure measure);

/// What a name says of a role: how surely, 0: it is something else.
struct NameMatch {
  Role role{};
  int certainty = 0;  ///< 2: people mean nothing else by it; 1: the word is in it
};
[[nodiscard]] std::vector<NameMatch> roles_of(std::string_view header);

/// Speeds that count turns of the field and not of the rotor: "eRPM".
[[nodiscard]] bool counts_electrical_turns(std::string_view header);

/// The name without its digits, where it has some: rpm1 and rpm2 are one kind of thing.
[[nodiscard]] std::optional<std::string> without_digits(std::string_view header);

struct ColumnRole {
  Role role{};
  std::string header;  ///< the whole header, or its part before the unit; of a table without header the column's number
  std::string unit;    ///< empty: the header gives it
};

/// "thrust=Load [g]", "speed=n:rpm": role, header and, behind the last ':', a unit that the header does not give.
/// Throws ConfigurationError that lists the roles.
[[nodiscard]] ColumnRole parse_column_role(std::string_view text);

}  // namespace kphi::fit
