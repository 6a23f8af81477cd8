// Betaflight and Crazyflie: the law of thrust over throttle, which is all that they hold of a propeller.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "base/error.hpp"
#include "base/number.hpp"
#include "fit/export/facts.hpp"

namespace kphi::fit {
namespace {

/// Lines for the CLI; `mark` makes comments of them.
std::string thrust_linear(const compensation::Coefficients& file, const char* name, const char* versions,
                          const char* mark, Export& result) {
  const auto& law = throttle_law_for(file, name);
  const double fitted = number_of(file, law, "thrust_linear"), taken = std::clamp(std::round(fitted), 0.0, 150.0);
  if (std::abs(taken - fitted) > 1)
    result.lost.push_back(
        fmt::format("thrust_linear {:.3g} ({}): Betaflight takes 0 to 150; {:g} is written", fitted, versions, taken));
  return fmt::format("# {}: {}\n{}set thrust_linear = {:g}\n", versions, words_of(law, "thrust_linear"), mark, taken);
}

}  // namespace

/// Betaflight changed its curve with 2026.6: a number for each, the older one as a comment.
Export to_betaflight(const compensation::Coefficients& file, const ExportOptions&) {
  Export result;
  result.lost = {"k, torque: Betaflight has no such numbers",
                 "motor_idle: counted as 5.5 %, Betaflight's default; with another thrust_linear is another",
                 "the version of the firmware: for 2025.12 and older take the line that is a comment"};
  result.text = comment(file, "# ") + thrust_linear(file, "betaflight", "2026.6 and later", "", result) +
                thrust_linear(file, "betaflight_4_2", "4.2 to 2025.12", "# ", result);
  return result;
}

/// The firmware solves the cubic for the voltage in closed form, which needs it to rise everywhere.
Export to_crazyflie(const compensation::Coefficients& file, const ExportOptions&) {
  const auto& law = throttle_law_for(file, "crazyflie");
  std::array<double, 4> c{};
  for (std::size_t i = 0; i < c.size(); ++i) c[i] = number_of(file, law, fmt::format("VMOTOR2THRUST{}", i));
  if (!(c[3] > 0) || !(3 * c[1] * c[3] > c[2] * c[2]))
    throw ConfigurationError(
        file.path +
        ": the cubic of thrust over voltage does not rise everywhere, so the firmware could not solve it; "
        "log more throttles, from idle to full, and less noise");
  Export result;
  result.text =
      comment(file, "// ") + "// T = c0 + c1 v + c2 v^2 + c3 v^3, N; v = PWM / 65535 times the battery's voltage\n";
  for (std::size_t i = 0; i < c.size(); ++i)
    result.text += fmt::format("// {}\n#define VMOTOR2THRUST{} {}f\n", words_of(law, fmt::format("VMOTOR2THRUST{}", i)),
                               i, yaml_number(c[i]));
  if (const auto torque = torque_per_thrust(file, 0))
    result.text += fmt::format("#define THRUST2TORQUE {}f  // {}\n", yaml_number(torque->value), words_of(*torque));
  else
    result.lost.emplace_back(kNoTorque);
  result.lost.insert(result.lost.end(),
                     {"THRUST_MIN, THRUST_MAX: what to allow at a low battery is a choice; keep the platform's",
                      "k: the Crazyflie's motors take thrust in N and know no speed"});
  return result;
}

}  // namespace kphi::fit
