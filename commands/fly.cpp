#include "commands/fly.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>

#include "base/error.hpp"
#include "compensation/compensator.hpp"
#include "compensation/file/coefficient_file.hpp"
#include "compensation/flight/paper.hpp"
#include "compensation/flight/records.hpp"
#include "compensation/flight/tables.hpp"
#include "fit/report/gnuplot.hpp"
#include "profiles/vehicle.hpp"
#include "results/file_layer.hpp"

namespace kphi::flight {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct Request {
  std::string coefficients;
  std::string vehicle;
  std::string experiment;
  std::size_t draws = 0;
  std::uint64_t seed = 1;
  std::size_t threads = 0;
  std::string out;
  bool json = false;
};

/// What one call flew.
struct Flown {
  Scene nominal;
  NineFlights flights;
  std::vector<Draw> draws;
};

Build build_of(const profiles::Dynamics& dynamics) {
  Build build;
  build.mass_kg = dynamics.mass_kg;
  build.hub_mass_kg = dynamics.hub_mass_kg;
  build.body_height_m = dynamics.body_height.value();
  if (dynamics.body_inertia_kg_m2) build.body_inertia = Eigen::Vector3d(dynamics.body_inertia_kg_m2->data());
  build.yaw_arm_m = dynamics.drag_torque_per_thrust.value();
  build.rotor_lag_s = dynamics.rotor_lag.value();
  build.air_drag_per_s = dynamics.air_drag_per_s;
  build.morph_s = dynamics.morph.value();
  for (std::size_t i = 0; i < 4; ++i) build.spin[i] = dynamics.rotor_spins[i];
  return build;
}

PilotSettings pilot_of(const profiles::Control& control) {
  const auto three = [](const std::array<double, 3>& values) { return Eigen::Vector3d(values.data()); };
  PilotSettings pilot;
  pilot.gains.position = three(control.position_gain_per_s2);
  pilot.gains.velocity = three(control.velocity_gain_per_s);
  pilot.gains.attitude = three(control.attitude_gain_per_s);
  pilot.gains.rate = three(control.rate_gain_per_s);
  pilot.gains.torque_weight = control.torque_weight;
  pilot.gains.position_error_max = three(control.position_error_max_m);
  pilot.gains.velocity_error_max = three(control.velocity_error_max_m_s);
  pilot.gains.smallest_collective = control.collective_min_m_s2;
  pilot.assured_yaw = control.assured_yaw.value();
  return pilot;
}

/// What flying needs of the file and other uses of it do not.
void require_flyable(const profiles::Vehicle& file) {
  if (!file.dynamics) {
    throw ConfigurationError(file.path +
                             ": a simulated flight needs the section dynamics (mass_kg, hub_mass_kg, …); "
                             "profiles/foldable_drone.yaml has one");
  }
  if (!file.control) {
    throw ConfigurationError(file.path +
                             ": a simulated flight needs the section control (the controller's gains); "
                             "profiles/foldable_drone.yaml has one");
  }
}

Vehicle vehicle_of(const profiles::Vehicle& file) {
  Vehicle vehicle;
  vehicle.airframe = profiles::airframe_of(file);
  vehicle.build = build_of(*file.dynamics);
  for (const auto& [name, angles] : {std::pair{"X", &vehicle.x}, std::pair{"O", &vehicle.o}}) {
    const auto shape = file.shapes.find(name);
    if (shape == file.shapes.end()) {
      throw ConfigurationError(file.path + ": the experiments need the shape " + name +
                               "; give its angles in shapes_deg");
    }
    *angles = shape->second;
  }
  return vehicle;
}

Scene nominal_of(const Request& request) {
  const compensation::ThrustCurve curve = compensation::load_coefficients(request.coefficients).curve;
  const profiles::Vehicle file = profiles::load_vehicle(request.vehicle);
  require_flyable(file);
  const auto mismatch =
      compensation::overlap_mismatch(curve.overlap(), request.coefficients, file.overlap, request.vehicle);
  if (mismatch) throw ConfigurationError(*mismatch);
  const Vehicle vehicle = vehicle_of(file);
  const auto built = compensation::Compensator::build({curve, curve, curve, curve}, vehicle.airframe);
  if (!built.compensator) throw ConfigurationError(request.vehicle + ": " + describe(built.refusal));
  const PilotSettings pilot = pilot_of(*file.control);
  if (!Pilot::build(vehicle, curve, pilot)) {
    throw ConfigurationError(request.vehicle +
                             ": its rotors cannot make every torque in X and in O; check shapes_deg and "
                             "rotor_spins (two of them 1, two -1, neighbours unlike)");
  }
  const double hover = kGravity * vehicle.build.mass_kg / 4;
  if (built.compensator->thrust_max()[0].value() < 1.5 * hover) {
    throw ConfigurationError(fmt::format(
        "{}: a rotor gives at most {:.2f} N, and hovering with {} kg takes {:.2f} N per rotor; check K_T and "
        "speed_max_rpm",
        request.coefficients, built.compensator->thrust_max()[0].value(), vehicle.build.mass_kg, hover));
  }
  return nominal_scene(vehicle, pilot, curve, request.seed);
}

std::size_t threads_of(const Request& request) {
  return request.threads > 0 ? request.threads : std::max(1u, std::thread::hardware_concurrency());
}

void write(const fs::path& path, const std::string& text) {
  results::MemoryOnlySync files;  // flown again at any time from the same files and seed
  results::write_text(path, text, files);
}

void make_folder(const std::string& path) {
  std::error_code error;
  fs::create_directories(path, error);
  if (error)
    throw std::runtime_error(path + ": cannot create the folder (" + error.message() + "); give another --out");
}

/// Why it could not be drawn; empty if it was.
std::string write_figure(const fs::path& folder, const std::string& name, const std::string& script) {
  write(folder / (name + ".gp"), script);
  return fit::draw(folder / (name + ".gp"), folder / (name + ".svg")).reason;
}

void write_out(const Request& request, const Flown& flown, const std::array<std::vector<TraceRow>, 9>& traces) {
  const fs::path folder(request.out);
  std::string skipped;
  for (std::size_t i = 0; i < traces.size(); ++i) {
    if (traces[i].empty()) continue;
    const std::string name(kExperiments[i].name);
    write(folder / (name + ".csv"), trace_csv(traces[i]));
    skipped = write_figure(folder, name, error_figure(kExperiments[i], traces[i]));
  }
  if (!flown.draws.empty()) {
    write(folder / "draws.csv", draws_csv(flown.draws));
    skipped = write_figure(folder, "draws", draws_figure(flown.draws));
  }
  if (!skipped.empty()) fmt::print(stderr, "no figures: {}\n", skipped);
}

Flown fly_requested(const Request& request) {
  Flown flown{nominal_of(request), {}, {}};
  const Shadow shadow(flown.nominal.vehicle.airframe);
  std::array<std::vector<TraceRow>, 9> traces;
  if (!request.out.empty()) make_folder(request.out);
  for (std::size_t i = 0; i < kExperiments.size(); ++i) {
    if (!request.experiment.empty() && request.experiment != kExperiments[i].name) continue;
    flown.flights[i] = fly_one(i, flown.nominal, shadow, request.out.empty() ? nullptr : &traces[i]);
  }
  flown.draws = fly_draws(flown.nominal, shadow, request.draws, threads_of(request));
  if (!request.out.empty()) write_out(request, flown, traces);
  return flown;
}

std::string circumstances(const Request& request, const Scene& scene) {
  const Truth& truth = scene.truth;
  const compensation::ThrustCurve& curve = scene.curve;
  const auto share = [&](Radians phi) { return curve.at(phi) / curve.thrust_coefficient(); };
  std::string errors;
  for (const double factor : truth.thrust) errors += fmt::format(" {:+.0f}", 100 * (factor - 1));
  return fmt::format(
      "The controller flies with K_T {:.4e} N/(rad/s)^2 and k/K_T from {:.4f} at 0° to {:.4f} at {:g}° ({}).\n"
      "It does not know that the air follows the loss model \"{}\", gamma = {:g} times as on the bench (gamma is "
      "fitted\nto the paper's hover height alone), nor these errors: mass {:+.1f} %, K_T of the rotors{} %, centre of "
      "gravity\n{:+.1f} {:+.1f} mm. Seed {}.\n\n",
      curve.thrust_coefficient().value(), share(Radians(0)), share(curve.largest_fitted()),
      to_degrees(curve.largest_fitted()), request.coefficients, name_of(truth.law), truth.gamma, 100 * (truth.mass - 1),
      errors, 1e3 * truth.cog_error.x(), 1e3 * truth.cog_error.y(), request.seed);
}

void print_text(const Request& request, const Flown& flown) {
  fmt::print("{}{}{}{}", circumstances(request, flown.nominal), hover_table(flown.flights),
             height_table(flown.flights, flown.nominal.pilot.gains), forward_table(flown.flights));
  for (std::size_t i = 0; i < flown.flights.size(); ++i) {
    if (flown.flights[i].lost) fmt::print("{}: lost, more than 1 m from its reference\n", kExperiments[i].name);
  }
  if (!flown.draws.empty()) fmt::print("{}", findings_table(findings_of(flown.draws)));
  fmt::print("{}", not_reproduced());
}

/// null without draws.
Json json_of(const Findings& found, const Percentiles& p) {
  if (found.kept == 0) return nullptr;
  return {{"p10", p.p10}, {"p50", p.p50}, {"p90", p.p90}};
}

Json json_of(const Findings& found) {
  Json by_law = Json::object();
  for (std::size_t law = 0; law < found.by_law.size(); ++law) {
    if (found.by_law[law].kept == 0) continue;
    by_law[name_of(static_cast<LossLaw>(law))] = {{"hover_z_ratio_p50", found.by_law[law].hover_z_ratio},
                                                  {"forward_ratio_p50", found.by_law[law].forward_ratio}};
  }
  return {{"draws", found.draws},
          {"kept", found.kept},
          {"lost_plain", found.lost_plain},
          {"lost_compensated", found.lost_compensated},
          {"hover_z_better", found.hover_z_better},
          {"forward_better", found.forward_better},
          {"hover_z_plain_m", json_of(found, found.hover_z_plain)},
          {"hover_z_compensated_m", json_of(found, found.hover_z_compensated)},
          {"hover_z_ratio", json_of(found, found.hover_z_ratio)},
          {"hover_xy_plain_m", json_of(found, found.hover_xy_plain)},
          {"hover_xy_compensated_m", json_of(found, found.hover_xy_compensated)},
          {"hover_xy_ratio", json_of(found, found.hover_xy_ratio)},
          {"forward_x_m", json_of(found, found.forward_x)},
          {"forward_plain_m", json_of(found, found.forward_plain)},
          {"forward_compensated_m", json_of(found, found.forward_compensated)},
          {"forward_ratio", json_of(found, found.forward_ratio)},
          {"square_speed_ratio", json_of(found, found.square_speed_ratio)},
          {"by_loss_law", by_law}};
}

Json json_of(const Experiment& experiment, const FlightResult& flight) {
  Json legs = Json::array();
  const std::size_t valid = flight.lost ? flight.lost_leg : flight.leg_count;
  for (std::size_t i = 0; i < valid; ++i) {
    const LegResult& leg = flight.legs[i];
    legs.push_back({{"shape", experiment.legs[i].shape == Shape::x ? "X" : "O"},
                    {"compensated", experiment.legs[i].compensated},
                    {"mean_error_m", {leg.mean_error.x(), leg.mean_error.y(), leg.mean_error.z()}},
                    {"mean_distance_m", leg.mean_distance},
                    {"deviation_m", leg.deviation},
                    {"mean_square_speed_rad2_s2", leg.mean_square_speed},
                    {"fastest_rad_s", leg.fastest}});
  }
  return {{"name", experiment.name}, {"lost", flight.lost}, {"conceded_steps", flight.concessions}, {"legs", legs}};
}

void print_json(const Request& request, const Flown& flown) {
  const Truth& truth = flown.nominal.truth;
  Json flights = Json::array();
  for (std::size_t i = 0; i < flown.flights.size(); ++i) {
    if (flown.flights[i].leg_count > 0) flights.push_back(json_of(kExperiments[i], flown.flights[i]));
  }
  Json told{{"coefficients", request.coefficients}, {"vehicle", request.vehicle}, {"seed", request.seed},
            {"loss_law", name_of(truth.law)},       {"gamma", truth.gamma},       {"flights", flights}};
  if (!flown.draws.empty()) told["study"] = json_of(findings_of(flown.draws));
  told["not_reproduced"] = kNotReproduced;
  fmt::print("{}\n", told.dump(2, ' ', false, Json::error_handler_t::replace));
}

int fly_command(const Request& request) {
  const Flown flown = fly_requested(request);
  request.json ? print_json(request, flown) : print_text(request, flown);
  return 0;
}

std::vector<std::string> experiment_names() {
  std::vector<std::string> names;
  for (const Experiment& experiment : kExperiments) names.emplace_back(experiment.name);
  return names;
}

}  // namespace

void add_fly(CLI::App& program, int& exit_code) {
  const auto request = std::make_shared<Request>();
  CLI::App* command = program.add_subcommand(
      "fly", "fly the paper's nine experiments in simulation with these coefficients, before propellers turn");
  command->footer(
      "Without --draws: one set of circumstances. With it: that many more, drawn from the seed; the output then has "
      "percentiles.");
  command->add_option("--coefficients", request->coefficients, "coefficients.yaml of `kphi fit`")->required();
  command->add_option("--vehicle", request->vehicle, "vehicle file, such as profiles/foldable_drone.yaml")->required();
  command->add_option("--experiment", request->experiment, "one of the nine (default: all)")
      ->check(CLI::IsMember(experiment_names()));
  command->add_option("--draws", request->draws, "sets of circumstances to draw, such as 400 (default: 0)")
      ->check(CLI::Range(0, 10000));
  command->add_option("--seed", request->seed, "seed of noise and draws")->capture_default_str();
  command->add_option("--threads", request->threads, "threads; 0: one per core. The result does not depend on it")
      ->check(CLI::Range(0, 256));
  command->add_option("--out", request->out, "folder for traces and draws (CSV) and figures (SVG)");
  command->add_flag("--json", request->json, "the result as JSON on stdout");
  command->callback([request, &exit_code] { exit_code = fly_command(*request); });
}

}  // namespace kphi::flight
