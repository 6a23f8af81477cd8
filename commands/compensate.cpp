#include <unistd.h>

#include <cmath>
#include <iostream>

#include "commands/commands.hpp"
#include "commands/compensate_rows.hpp"
#include "commands/inputs.hpp"
#include "compensation/compensator.hpp"

namespace kphi::commands {
namespace {

using namespace compensation;

struct Request {
  std::string coefficients;
  std::string vehicle;
  std::string law = "clamped";
  bool json = false;
};

Compensator compensator_of(const Request& request, const profiles::Vehicle& vehicle) {
  const ThrustCurve curve = load_curve_for(request.coefficients, vehicle);
  const ScalingLaw law = request.law == "published" ? ScalingLaw::published : ScalingLaw::clamped;
  const BuildOutcome outcome = Compensator::build({curve, curve, curve, curve}, profiles::airframe_of(vehicle), law);
  if (!outcome.compensator) throw ConfigurationError(request.vehicle + ": " + describe(outcome.refusal));
  if (outcome.doubts[0].gains_with_occlusion) {
    std::cerr << request.coefficients << ": k(φ) does not fall with the occlusion; check that this is the right file\n";
  }
  if (outcome.doubts[0].steps_at_contact) {
    std::cerr << request.coefficients << ": k(φ) misses K_T at 0°, so the speeds step at first contact; "
              << "`kphi fit --anchored` avoids this\n";
  }
  return *outcome.compensator;
}

/// Reports rows that were skipped or out of reach; returns the exit code.
ExitCode verdict(const RowCounts& counts, const profiles::Vehicle& vehicle) {
  if (!std::cout) {
    std::cerr << "cannot write to standard output; " << counts.written << " rows were computed\n";
    return ExitCode::failure;
  }
  if (counts.out_of_reach > 0) {
    std::cerr << counts.out_of_reach << " of " << counts.written << " rows have an arm angle outside "
              << std::round(to_degrees(vehicle.arm_angle_min)) << " to "
              << std::round(to_degrees(vehicle.arm_angle_max)) << "°, the range of the servos of " << vehicle.path
              << "; they were computed all the same\n";
  }
  if (counts.rejected == 0) return ExitCode::ok;
  std::cerr << counts.rejected << " of " << counts.rejected + counts.written << " rows were skipped\n";
  return ExitCode::data_rejected;
}

ExitCode compensate(const Request& request) {
  std::ios::sync_with_stdio(false);
  std::cin.tie(nullptr);
  const profiles::Vehicle vehicle = profiles::load_vehicle(request.vehicle);
  Compensator compensator = compensator_of(request, vehicle);
  if (isatty(STDIN_FILENO) != 0) std::cerr << "reading CSV from the keyboard; Ctrl-D ends the input\n";
  const RowCounts counts =
      compensate_rows(std::cin, std::cout, std::cerr, compensator, {vehicle.arm_angle_min, vehicle.arm_angle_max},
                      request.json ? RowFormat::json_lines : RowFormat::csv);
  return verdict(counts, vehicle);
}

}  // namespace

void add_compensate(CLI::App& program, ExitCode& exit_code) {
  const auto [command, request] = add_verb<Request>(
      program, exit_code, "compensate",
      "turn rows of arm angles and thrusts (CSV on stdin) into occlusions, k_i and rotor speeds", compensate);
  command.footer(
      "Columns in: theta1_deg … theta4_deg, thrust1_n … thrust4_n, in any order; others are ignored.\n"
      "Columns out: phi1_deg …, k1 … (k_i of equation 4), speed1_rpm …, flags (rotor:what, separated by blanks).\n"
      "A row that cannot be used is skipped and reported on stderr; the exit code is then 5.");
  add_flight_files(command, request.coefficients, request.vehicle);
  command
      .add_option("--law", request.law,
                  "how k(φ) becomes k_i: clamped to [0.1, 1], or published (equation 4 to the letter)")
      ->check(CLI::IsMember({"clamped", "published"}))
      ->capture_default_str();
  command.add_flag("--json", request.json, "print one JSON object per row instead of CSV");
}

}  // namespace kphi::commands
