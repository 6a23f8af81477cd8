#include "compensation/commands.hpp"

#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>
#include <string>

#include "compensation/compensate_rows.hpp"
#include "compensation/compensator.hpp"
#include "compensation/file/coefficient_file.hpp"
#include "compensation/file/overlap_mismatch.hpp"
#include "profiles/configuration_error.hpp"
#include "profiles/vehicle.hpp"

namespace kphi::compensation {
namespace {

struct Request {
  std::string coefficients;
  std::string vehicle;
  std::string law = "clamped";
  bool json = false;
};

Compensator compensator_of(const Request& request) {
  const ThrustLine line = thrust_line(load_coefficients(request.coefficients));
  const profiles::Vehicle vehicle = profiles::load_vehicle(request.vehicle);
  const auto mismatch = overlap_mismatch(line.overlap(), request.coefficients, vehicle.overlap, request.vehicle);
  if (mismatch) throw ConfigurationError(*mismatch);
  const ScalingLaw law = request.law == "published" ? ScalingLaw::published : ScalingLaw::clamped;
  const BuildOutcome outcome = Compensator::build({line, line, line, line}, profiles::airframe_of(vehicle), law);
  if (!outcome.compensator) throw ConfigurationError(request.vehicle + ": " + describe(outcome.refusal));
  if (outcome.doubts[0].gains_with_occlusion) {
    std::cerr << request.coefficients << ": the line does not fall with occlusion; is this the right file?\n";
  }
  if (outcome.doubts[0].steps_at_contact) {
    std::cerr << request.coefficients << ": the line misses K_T at 0 degrees, so speeds step at first contact; "
              << "an anchored fit does not\n";
  }
  return *outcome.compensator;
}

int compensate(const Request& request) {
  std::ios::sync_with_stdio(false);
  std::cin.tie(nullptr);
  try {
    Compensator compensator = compensator_of(request);
    const RowCounts counts = compensate_rows(std::cin, std::cout, std::cerr, compensator,
                                             request.json ? RowFormat::json_lines : RowFormat::csv);
    if (!std::cout) {
      std::cerr << "standard output cannot be written; " << counts.written << " rows were on their way\n";
      return 1;
    }
    if (counts.rejected == 0) return 0;
    std::cerr << counts.rejected << " of " << counts.rejected + counts.written << " rows were left out\n";
    return 5;
  } catch (const CoefficientError& error) {
    std::cerr << error.what() << '\n';
  } catch (const ConfigurationError& error) {
    std::cerr << error.what() << '\n';
  } catch (const RowHeaderError& error) {
    std::cerr << error.what() << '\n';
  }
  return 2;
}

}  // namespace

void add_compensate(CLI::App& program, int& exit_code) {
  auto request = std::make_shared<Request>();
  CLI::App* command = program.add_subcommand(
      "compensate", "CSV of arm angles and thrusts on stdin → occlusions, k_i and rotor speeds on stdout");
  command->footer("Columns: theta1_deg … theta4_deg, thrust1_n … thrust4_n; others are ignored.");
  command->add_option("--coefficients", request->coefficients, "coefficients.yaml of `kphi fit`")->required();
  command->add_option("--vehicle", request->vehicle, "Vehicle file, e.g. profiles/foldable_drone.yaml")->required();
  command->add_option("--law", request->law, "clamped, or published (equation 4 to the letter)")
      ->check(CLI::IsMember({"clamped", "published"}))
      ->capture_default_str();
  command->add_flag("--json", request->json, "One JSON object per row instead of CSV");
  command->callback([request, &exit_code] { exit_code = compensate(*request); });
}

}  // namespace kphi::compensation
