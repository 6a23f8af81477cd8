#include "profiles/check.hpp"

#include <cstdio>
#include <vector>

#include "commands/commands.hpp"
#include "compensation/file/coefficient_file.hpp"
#include "compensation/file/coefficient_keys.hpp"
#include "drivers/sim/input_files.hpp"
#include "profiles/strict_yaml.hpp"

namespace kphi::commands {
namespace {

using namespace profiles;

struct CheckOptions {
  std::vector<std::string> paths;
  bool json = false;
};

/// What the curve's uncertainty does to the speed of a rotor, at the ends of the valid range.
std::string uncertainty_of(const compensation::ThrustCurve& curve) {
  if (!curve.uncertainty())
    return "  speeds     uncertainty unknown: the file lacks the covariance of the line or the error of K_T\n";
  const auto percent = [&](Radians phi) { return 50 * curve.relative_uncertainty(phi, Radians(0)); };
  return fmt::format("  speeds     known to {:.2g} % without occlusion, {:.2g} % at {:g}°\n", percent(Radians(0)),
                     percent(curve.largest_fitted()), to_degrees(curve.largest_fitted()));
}

std::string judge_coefficients(const std::string& path) {
  const compensation::Coefficients c = compensation::load_coefficients(path);
  return fmt::format(
      "  propeller  {} ({})\n"
      "  K_T        {:.6g} N/(rad/s)^2 = {:.6g} N/RPM^2\n"
      "  curve      k = {} N/(rad/s)^2{}\n"
      "  valid      {:g}° to {:g}°, overlap measured as {}\n"
      "{}",
      c.propeller.id, c.propeller.name, c.curve.thrust_coefficient().value(),
      to_newtons_per_rpm2(c.curve.thrust_coefficient()), words_of(c.curve), c.anchored ? ", anchored at K_T" : "",
      to_degrees(c.smallest_occlusion), to_degrees(c.curve.largest_fitted()), name_of(c.curve.overlap()),
      uncertainty_of(c.curve));
}

template <class Fault>
std::string in_words(const std::vector<Fault>& script, const sim::FaultTable<Fault>& table) {
  std::string words;
  for (const Fault& fault : script) {
    words += fmt::format("  at {:g} s  {}", to_seconds(fault.at), table.name_of(fault.kind));
    if (fault.lasts > Duration{0}) words += fmt::format(" for {:g} s", to_seconds(fault.lasts));
    if (fault.count > 0) words += fmt::format(", at most {} times", fault.count);
    words += "\n";
  }
  return words;
}

std::string judge_faults(const std::string& path) {
  const sim::FaultFile file = sim::parse_faults(profiles::read_text(path), path);
  return in_words(file.load_cell, sim::load_cell_faults()) + in_words(file.motor, sim::motor_faults()) +
         in_words(file.supply, sim::supply_faults()) + in_words(file.air, sim::ambient_faults());
}

std::string judge_motor(const std::string& path) {
  const sim::MotorParameters motor = sim::parse_motor_profile(profiles::read_text(path), path).motor;
  return fmt::format(
      "  motor      {:.4g} RPM/V, {:g} ohm, {:g} kg m^2 without propeller\n"
      "  supply     {:g} V behind {:g} ohm, at most {:g} A\n",
      to_rpm(RadPerSec(1 / motor.torque_constant)), motor.resistance, motor.rotor_inertia, motor.supply_volts,
      motor.source_resistance, motor.supply_current_max);
}

const std::vector<ForeignKind>& foreign_kinds() {
  static const std::vector<ForeignKind> kinds{{compensation::kCoefficientFormat, "coefficients", judge_coefficients},
                                              {"kphi-faults/1", "fault script", judge_faults},
                                              {"kphi-sim-motor/1", "simulated motor", judge_motor}};
  return kinds;
}

void print(const CheckedFile& file, bool json) {
  if (json) return print_json(file.report, -1);
  if (file.ok()) fmt::print("{}: valid {}\n{}", file.path, file.kind, file.summary);
  for (const std::string& error : file.errors) fmt::print(stderr, "{}\n", error);
}

ExitCode check(const CheckOptions& options) {
  ExitCode exit_code = ExitCode::ok;
  for (const CheckedFile& file : check_files(options.paths, foreign_kinds())) {
    print(file, options.json);
    if (!file.ok()) exit_code = ExitCode::usage;
  }
  return exit_code;
}

}  // namespace

void add_check(CLI::App& program, ExitCode& exit_code) {
  const auto [command, options] = add_verb<CheckOptions>(
      program, exit_code, "check",
      "check campaign, bench, vehicle, answers and coefficient files, fault scripts and simulated motors", check);
  add_argument(command, "FILE", options.paths,
               "files; campaigns are also checked against the benches and answers among them");
  command.add_flag("--json", options.json, "print one JSON object per file on a line of its own");
}

}  // namespace kphi::commands
