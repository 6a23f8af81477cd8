// Units as the headers of CSV tables write them: "Thrust (gf)", "Drehzahl [1/min]", "force_n".
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace kphi::fit {

/// What a column measures, and the unit inside: s, µs, RPM, N, N m, V, A, degree, 1.
enum class Measure { time, throttle, speed, thrust, torque, voltage, current, angle, count };

struct HeaderName {
  std::string name;
  std::string unit;  ///< as written; empty: no unit
};

/// "Thrust (gf)" and "Thrust [gf]" → Thrust, gf. Without brackets all of it is the name.
[[nodiscard]] HeaderName split_header(std::string_view header);

/// The unit after a '_' at the end of a header without brackets ("thrust_n", "speed_rad_s"); empty if the measure has
/// no such unit.
[[nodiscard]] std::string unit_suffix(std::string_view name, Measure measure);

/// Factor from `unit` to the unit inside; nullopt for a unit that the measure does not have. Case counts only where two
/// units differ by it (mN, MN).
[[nodiscard]] std::optional<double> unit_factor(Measure measure, std::string_view unit);

/// The units of the measure, for messages: "N, mN, kN, gf, …".
[[nodiscard]] std::string unit_list(Measure measure);

}  // namespace kphi::fit
