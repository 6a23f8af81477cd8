#include "profiles/commands.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "compensation/file/coefficient_file.hpp"
#include "drivers/sim/fault_file.hpp"
#include "drivers/sim/motor_file.hpp"
#include "profiles/check.hpp"
#include "profiles/strict_yaml.hpp"

namespace kphi::profiles {
namespace {

struct CheckOptions {
  std::vector<std::string> paths;
  bool json = false;
};

/// What the line's uncertainty does to the speed of a rotor, at the ends of the valid range.
std::string uncertainty_of(const compensation::Coefficients& c) {
  const compensation::ThrustLine line = thrust_line(c);
  if (!line.uncertainty())
    return "  speeds     of unknown uncertainty: the file tells no covariance or no error of K_T\n";
  const auto percent = [&](Radians phi) { return 50 * line.relative_uncertainty(phi, Radians(0)); };
  return fmt::format("  speeds     to {:.2g} % without occlusion, {:.2g} % at {:g} degrees\n", percent(Radians(0)),
                     percent(c.largest_occlusion), to_degrees(c.largest_occlusion));
}

std::string judge_coefficients(const std::string& path) {
  const compensation::Coefficients c = compensation::load_coefficients(path);
  return fmt::format(
      "  propeller  {} ({})\n"
      "  K_T        {:.6g} N/(rad/s)^2 = {:.6g} N/RPM^2\n"
      "  line       k = {:.6g} {:+.6g} * phi/rad N/(rad/s)^2{}\n"
      "  valid      {:g} to {:g} degrees, overlap measured as {}\n"
      "{}",
      c.propeller.id, c.propeller.name, c.thrust_coefficient.value(), to_newtons_per_rpm2(c.thrust_coefficient),
      c.line.intercept.value(), c.line.slope_per_rad, c.line.anchored ? ", anchored at K_T" : "",
      to_degrees(c.smallest_occlusion), to_degrees(c.largest_occlusion), name_of(c.overlap), uncertainty_of(c));
}

template <class Fault>
std::string in_words(const Fault& fault, const char* device = "") {
  std::string words = fmt::format("  at {:g} s  {}{}", to_seconds(fault.at), device, name_of(fault.kind));
  if (fault.lasts > Duration{0}) words += fmt::format(" for {:g} s", to_seconds(fault.lasts));
  if (fault.count > 0) words += fmt::format(", {} times at most", fault.count);
  return words + "\n";
}

std::string judge_faults(const std::string& path) {
  const std::string text = read_text(path);
  (void)sim::parse_habits(text, path);
  std::string summary;
  const auto tell = [&](const auto& script) {
    for (const auto& fault : script) summary += in_words(fault);
  };
  tell(sim::parse_faults(text, path));
  tell(sim::parse_motor_faults(text, path));
  tell(sim::parse_supply_faults(text, path));
  for (const auto& fault : sim::parse_ambient_faults(text, path)) summary += in_words(fault, "ambient_");
  return summary;
}

std::string judge_motor(const std::string& path) {
  const sim::MotorParameters motor = sim::parse_motor_profile(read_text(path), path).motor;
  return fmt::format(
      "  motor      {:.4g} RPM/V, {:g} ohm, {:g} kg m^2 without propeller\n"
      "  supply     {:g} V behind {:g} ohm, at most {:g} A\n",
      to_rpm(RadPerSec(1 / motor.torque_constant)), motor.resistance, motor.rotor_inertia, motor.supply_volts,
      motor.source_resistance, motor.supply_current_max);
}

const std::vector<ForeignKind>& foreign_kinds() {
  static const std::vector<ForeignKind> kinds{{"kphi-coefficients/1", "coefficients", judge_coefficients},
                                              {"kphi-faults/1", "fault script", judge_faults},
                                              {"kphi-sim-motor/1", "simulated motor", judge_motor}};
  return kinds;
}

void print(const CheckedFile& file, bool json) {
  if (json) {
    fmt::print("{}\n", file.report.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
    return;
  }
  if (file.ok()) fmt::print("{}: {} in order\n{}", file.path, file.kind, file.summary);
  for (const std::string& error : file.errors) fmt::print(stderr, "{}\n", error);
}

}  // namespace

void add_check(CLI::App& program, int& exit_code) {
  auto* command = program.add_subcommand(
      "check", "check campaign, bench, vehicle and coefficient files, fault scripts and simulated motors");
  auto options = std::make_shared<CheckOptions>();
  command->add_option("FILE", options->paths, "Files; campaigns are also held against the benches among them")
      ->required();
  command->add_flag("--json", options->json, "One JSON object per file, one per line");
  command->callback([options, &exit_code] {
    exit_code = 0;
    for (const CheckedFile& file : check_files(options->paths, foreign_kinds())) {
      print(file, options->json);
      if (!file.ok()) exit_code = 2;
    }
  });
}

}  // namespace kphi::profiles
