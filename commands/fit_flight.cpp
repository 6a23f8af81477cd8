#include "commands/fit_flight.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string_view>

#include "commands/commands.hpp"
#include "commands/inputs.hpp"
#include "commands/outputs.hpp"
#include "compensation/file/coefficient_file.hpp"
#include "fit/coefficients/coefficients.hpp"
#include "fit/coefficients/error_in_flight.hpp"
#include "fit/flights/flight_fit.hpp"
#include "fit/flights/flight_layout.hpp"
#include "fit/flights/flight_log.hpp"
#include "fit/flights/flight_result.hpp"
#include "fit/flights/speed_check.hpp"
#include "fit/report/fit_summary.hpp"
#include "fit/report/flight_figures.hpp"
#include "fit/report/report.hpp"
#include "profiles/vehicle.hpp"
#include "profiles/vehicle_drawing.hpp"
#include "results/digest.hpp"
#include "results/file_layer.hpp"
#include "results/version.hpp"

namespace kphi::commands {
namespace {

using namespace fit;

namespace fs = std::filesystem;

/// The vehicle file, the mass it flew with, and, where the log does not tell its arms, the shape.
LoggedVehicle flown_vehicle(const FlightFitRequest& request, const profiles::Vehicle& file, const FlightLog& log) {
  LoggedVehicle vehicle;
  vehicle.name = file.name;
  vehicle.airframe = profiles::airframe_of(file);
  if (file.dynamics) {
    vehicle.build = *file.dynamics;
    vehicle.build_known = true;
    vehicle.mass_kg = file.dynamics->mass_kg;
  }
  if (request.mass_kg) vehicle.mass_kg = vehicle.build.mass_kg = *request.mass_kg, vehicle.weighed = true;
  if (!(vehicle.mass_kg > 0))
    throw ConfigurationError(file.path +
                             ": no dynamics.mass_kg; weigh the vehicle with its battery and give --mass KG");
  if (!request.shape.empty() && !file.shapes.contains(request.shape) && !file.hubs.contains(request.shape))
    throw ConfigurationError(fmt::format("{}: no shape {}; it has {}", file.path, request.shape,
                                         fmt::join(profiles::shapes_of(file), ", ")));
  if (!file.hubs.empty()) {
    if (request.shape.empty())
      throw ConfigurationError(
          fmt::format("{}: its hubs are told by shapes_m, and a log has no channels of hubs; name "
                      "the one shape that it flew in (--shape {})",
                      file.path, fmt::join(profiles::shapes_of(file), "|")));
    vehicle.hubs = file.hubs.at(request.shape);
  } else if (!request.shape.empty()) {
    if (!log.arm_angle.empty()) throw ConfigurationError(request.path + ": the log has arm angles; leave --shape out");
    vehicle.arms = file.shapes.at(request.shape);
  }
  vehicle.shape = request.shape;
  return vehicle;
}

/// What errors of a reading hide is said; what would make k wrong is refused by the fit itself.
void print_log_findings(const FlightLog& log) {
  for (const Finding& finding : log.findings) fmt::print(stderr, "log           {}\n", finding.line());
}

}  // namespace

bool is_flight_log(const std::string& path, const std::string& layout) {
  if (!layout.empty()) return true;
  if (!fs::is_regular_file(path)) return false;
  std::array<char, 7> begin{};
  std::ifstream(path, std::ios::binary).read(begin.data(), begin.size());
  const std::string_view bytes(begin.data(), begin.size());
  return bytes.starts_with("ULog\x01\x12\x35") || bytes.front() == '\xBC';
}

ExitCode fit_flight_log(const FlightFitRequest& request) try {
  if (request.vehicle.empty())
    throw ConfigurationError(request.path +
                             ": a flight log; its vehicle file tells arms, propellers and mass (--vehicle FILE)");
  const profiles::Vehicle file = profiles::load_vehicle(request.vehicle);
  const FlightLayout layout =
      request.layout.empty() ? FlightLayout{} : parse_flight_layout(results::read_text(request.layout), request.layout);
  FlightLog log = read_flight(request.path, layout);
  print_log_findings(log);
  LoggedVehicle vehicle = flown_vehicle(request, file, log);
  FlightPriors priors;
  if (vehicle.build_known) {
    if (vehicle.build.rotor_lag_s > 0) priors.lag = vehicle.build.rotor_lag_s;
    if (vehicle.build.air_drag_per_s > 0) priors.drag = vehicle.build.air_drag_per_s;
  }
  for (const std::string& text : request.uncertainties) set_flight_uncertainty(priors, vehicle, text);
  const SpeedCheck speeds = check_speeds(log, profiles::rotors_of(file), request.blades);
  correct_speeds(log, speeds, priors);
  const FlownBins flown = flown_bins(log, vehicle);
  const FlightFit fit = fit_flight(flown, vehicle, priors);

  IdentificationOptions options{.curve = {.form = request.form},
                                .propeller = request.propeller.empty() ? file.name : request.propeller,
                                .diameter_in = 2 * file.propeller_radius.value() / 0.0254,
                                .blades = request.blades,
                                .overlap = file.overlap};
  const Fitted fitted = fitted_of(fit, flown, vehicle, speeds, options, request.limits);
  Provenance provenance;
  provenance.origin = log.format == "table" ? Origin::unknown : Origin::measured;
  provenance.tool_version = kVersion;
  provenance.campaign = provenance.source = fs::path(request.path).filename().string();
  provenance.flight = flight_line(fit, flown, vehicle, log.format);
  provenance.runs.push_back({provenance.source, results::sha256_of_file(request.path), "", std::nullopt});

  const fs::path out =
      request.out.empty() ? fs::path(request.path).replace_extension(".coefficients.yaml") : fs::path(request.out);
  const std::string text = format_coefficients(fitted, provenance);
  if (out.has_parent_path()) fs::create_directories(out.parent_path());
  write_output(out, text);
  if (request.json) {
    Json json = fit_json(fitted.identification, fitted.analysis, out);
    json["flight"] = flight_json(fit, flown, speeds);
    print_json(json);
  } else {
    fmt::print("{}{}", flight_words(fit, flown, vehicle, speeds), headline_text(fitted));
  }
  std::string there;
  if (const auto error = error_in_flight(compensation::parse_coefficients(text, out.string()), file)) {
    there = words(*error, file);
    fmt::print(stderr, "in flight     {}\n", there);
  }
  fmt::print(stderr, "{}coefficients  {}\n", caution_text(fitted.identification, fitted.analysis), out.string());
  if (!request.no_report) {
    std::optional<compensation::Coefficients> bench;
    if (!request.bench.empty()) bench = load_standing_coefficients(coefficient_file_of(request.bench).string());
    const std::string name = out.stem().string();
    const Figures figures =
        draw(flight_figures(fit, flown, fitted, bench ? &*bench : nullptr), out.parent_path() / (name + "_figures"));
    if (!figures.skipped.empty()) fmt::print(stderr, "kphi: figures skipped: {}\n", figures.skipped);
    const fs::path page = out.parent_path() / (name + ".html");
    write_output(page, format_report(fitted, {provenance, figures, {}, there, profiles::draw_shapes(file)}));
    fmt::print(stderr, "report        {}\n", page.string());
  }
  if (fitted.analysis.flight.readiness() != Readiness::not_yet || request.accept) return ExitCode::ok;
  fmt::print(stderr, "kphi fit: do not fly yet (see above); --accept takes the result all the same\n");
  return ExitCode::data_rejected;
} catch (const FitError& why) {  // a refusal names the file
  throw FitError(fmt::format("{}: {}", request.path, why.what()));
}

}  // namespace kphi::commands
