#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <thread>

#include "commands/commands.hpp"
#include "commands/inputs.hpp"
#include "commands/outputs.hpp"
#include "compensation/compensator.hpp"
#include "compensation/file/coefficient_file.hpp"
#include "compensation/flight/reproduction.hpp"
#include "compensation/flight/tables.hpp"
#include "compensation/flight/verdict.hpp"
#include "fit/report/gnuplot.hpp"
#include "profiles/vehicle_drawing.hpp"
#include "profiles/world.hpp"
#include "results/file_layer.hpp"

namespace kphi::commands {
namespace {

using namespace flight;

namespace fs = std::filesystem;

struct FlyRequest {
  std::vector<std::string> coefficients;
  std::string vehicle;
  std::string world;
  std::string open = "X", folded = "O";
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
  NineFlights on_bench;  ///< as much lost as on the bench: γ = 1
  std::vector<Draw> draws;
  std::vector<CogSign> signs;
  std::optional<BlindZone> blind;  ///< of a file that is fit to fly
  Findings findings;               ///< of the draws, or of the one set of circumstances
  Judgement judgement;             ///< by them; only if all nine were flown
};

void require_section(const profiles::Vehicle& file, bool is_given, const char* section) {
  if (is_given) return;
  throw ConfigurationError(
      fmt::format("{}: no section {}, which a simulated flight needs; copy it from profiles/foldable_drone.yaml",
                  file.path, section));
}

flight::Vehicle vehicle_of(const profiles::Vehicle& file, const FlyRequest& request) {
  flight::Vehicle vehicle;
  vehicle.airframe = profiles::airframe_of(file);
  vehicle.build = *file.dynamics;
  const std::vector<std::string> names = profiles::shapes_of(file);
  for (const std::string& name : {request.open, request.folded}) {
    if (std::ranges::count(names, name) == 0)
      throw ConfigurationError(
          fmt::format("{}: the experiments need the shape {}; it has {}: name two of them with --open and --folded, or "
                      "give {} in {}",
                      file.path, name, fmt::join(names, ", "), name, file.hubs.empty() ? "shapes_deg" : "shapes_m"));
  }
  if (file.hubs.empty()) {
    vehicle.x = file.shapes.at(request.open);
    vehicle.o = file.shapes.at(request.folded);
    return vehicle;
  }
  const auto from = profiles::hubs_of(file, request.open), to = profiles::hubs_of(file, request.folded);
  vehicle.x = flight::Angles(from.size(), Radians(0));
  vehicle.o = flight::Angles(from.size(), Radians(1));
  for (std::size_t i = 0; i < from.size(); ++i) vehicle.ways.add({from[i], to[i]});
  return vehicle;
}

AssumedWorld assumed_of(const FlyRequest& request, const flight::Vehicle& vehicle,
                        const compensation::Rotors<compensation::ThrustCurve>& curves) {
  const auto propeller = compensation::load_coefficients(request.coefficients.front()).propeller;
  return assumed_world(vehicle, {propeller.diameter_in, propeller.blades}, curves);
}

/// The coefficients of a flight as a world: their K_T, and γ by which the law of loss keeps as much as the flight did
/// at its widest φ. nullopt: the file is a world file.
std::optional<Truth> world_of_flight(const FlyRequest& request, Truth truth) {
  if (!results::read_text(request.world).starts_with("format: kphi-coefficients/")) return std::nullopt;
  const auto flown = load_sealed_coefficients(request.world, compensation::Need::thrust_coefficient);
  if (flown.provenance.flight.empty())
    throw ConfigurationError(request.world +
                             ": coefficients of a bench; the air of a simulated flight is a world file, or the "
                             "coefficients of a real one (kphi fit FLIGHT --vehicle V)");
  truth.thrust_coefficient = flown.curve.thrust_coefficient();
  if (flown.alone()) return truth;
  const Radians widest = flown.curve.largest_fitted();
  truth.gamma = (1 - flown.curve.at(widest) / flown.curve.thrust_coefficient()) /
                (1 - thrust_share(truth.law, to_degrees(widest)));
  return truth;
}

Truth world_of(const FlyRequest& request, const profiles::Vehicle& file, const flight::Vehicle& vehicle,
               const compensation::Rotors<compensation::ThrustCurve>& curves) {
  const auto assumed = [&] { return assumed_of(request, vehicle, curves).truth; };
  if (request.world.empty()) return assumed();
  if (const auto flown = world_of_flight(request, assumed())) return *flown;
  const profiles::World world = profiles::load_world(request.world);
  profiles::require_vehicle(world, file);
  Truth truth = world.truth;
  if (!world.drag) truth.drag = vehicle.build.air_drag_per_s;
  return truth;
}

Scene nominal_of(const FlyRequest& request) {
  const profiles::Vehicle file = profiles::load_vehicle(request.vehicle);
  const auto curves = load_curves_for(request.coefficients, file);
  require_section(file, file.dynamics.has_value(), "dynamics (mass_kg, hub_mass_kg, …)");
  require_section(file, file.control.has_value(), "control (the controller's gains)");
  const flight::Vehicle vehicle = vehicle_of(file, request);
  const auto built = compensation::Compensator::build(curves, vehicle.airframe);
  if (!built.compensator) throw ConfigurationError(request.vehicle + ": " + describe(built.refusal));
  if (vehicle.rotors() == compensation::kFewestRotors)
    throw ConfigurationError(request.vehicle +
                             ": three rotors make no yaw of their own, and no tail servo is simulated; kphi fly needs "
                             "four to eight");
  const Truth world = world_of(request, file, vehicle, curves);
  const double hover = kGravity * vehicle.build.mass_kg / static_cast<double>(vehicle.rotors());
  const auto& thrust_max = built.compensator->thrust_max();
  const double weakest = std::min_element(thrust_max.begin(), thrust_max.end())->value();
  if (weakest < 1.5 * hover) {
    throw ConfigurationError(fmt::format(
        "{}: a rotor gives at most {:.2f} N, and hovering with {} kg takes {:.2f} N per rotor; check K_T and "
        "speed_max_rpm",
        fmt::join(request.coefficients, ", "), weakest, vehicle.build.mass_kg, hover));
  }
  return nominal_scene(vehicle, *file.control, curves, world, request.seed);
}

void make_folder(const std::string& path) {
  std::error_code error;
  fs::create_directories(path, error);
  if (error) throw Error(fmt::format("{}: cannot create the folder: {}; choose another --out", path, error.message()));
}

/// Why it could not be drawn; empty if it was.
std::string write_figure(const fs::path& folder, const std::string& name, const std::string& script) {
  write_output(folder / (name + ".gp"), script);
  return fit::draw(folder / (name + ".gp"), folder / (name + ".svg"));
}

void write_out(const FlyRequest& request, const Flown& flown, const std::array<std::vector<TraceRow>, 9>& traces) {
  const fs::path folder(request.out);
  write_output(folder / "vehicle.svg", profiles::draw_shapes(profiles::load_vehicle(request.vehicle)));
  std::string skipped;
  for (std::size_t i = 0; i < traces.size(); ++i) {
    if (traces[i].empty()) continue;
    const std::string name(kExperiments[i].name);
    write_output(folder / (name + ".csv"), trace_csv(traces[i]));
    skipped = write_figure(folder, name, error_figure(kExperiments[i], traces[i]));
  }
  const struct {
    const char *name, *title;
    ExperimentIndex plain, compensated;
  } pairs[] = {{"hover_compared", "Hover: X, O, X", kHoverPlain, kHoverCompensated},
               {"level_compared", "Level circle: X, O", kLevelPlain, kLevelCompensated},
               {"rising_compared", "Rising circle: X, O", kRisingPlain, kRisingCompensated}};
  for (const auto& [name, title, plain, compensated] : pairs) {
    if (traces[plain].empty() || traces[compensated].empty()) continue;
    skipped =
        write_figure(folder, name, comparison_figure(title, kExperiments[plain], traces[plain], traces[compensated]));
  }
  if (!flown.draws.empty()) {
    write_output(folder / "draws.csv", draws_csv(flown.draws));
    skipped = write_figure(folder, "draws", draws_figure(flown.draws));
  }
  if (!skipped.empty()) fmt::print(stderr, "no figures: {}\n", skipped);
}

bool all_flown(const Flown& flown) {
  return std::ranges::all_of(flown.flights, [](const FlightResult& flight) { return flight.leg_count > 0; });
}

Flown fly_requested(const FlyRequest& request) {
  Flown flown{nominal_of(request), {}, {}, {}, {}, {}, {}, {}};
  Scene on_bench = flown.nominal;
  on_bench.truth.gamma = 1;
  const Shadow shadow(flown.nominal.vehicle);
  std::array<std::vector<TraceRow>, 9> traces;
  if (!request.out.empty()) make_folder(request.out);
  for (std::size_t i = 0; i < kExperiments.size(); ++i) {
    if (!request.experiment.empty() && request.experiment != kExperiments[i].name) continue;
    flown.flights[i] = fly_one(i, flown.nominal, shadow, request.out.empty() ? nullptr : &traces[i]);
    flown.on_bench[i] = fly_one(i, on_bench, shadow);
  }
  const std::size_t threads = request.threads > 0 ? request.threads : std::max(1u, std::thread::hardware_concurrency());
  flown.draws = fly_draws(flown.nominal, shadow, request.draws, threads);
  if (request.experiment.empty()) flown.signs = signs_of_cog(flown.nominal, shadow);
  flown.findings = findings_of(flown.draws.empty() ? std::vector<Draw>{{flown.nominal, flown.flights}} : flown.draws);
  flown.judgement = judgement_of(flown.findings);
  if (all_flown(flown) && flown.judgement.fitness == Fitness::fit_to_fly)
    flown.blind = blind_zone_of(flown.nominal, shadow);
  if (!request.out.empty()) write_out(request, flown, traces);
  return flown;
}

/// Of the first so many rotors.
compensation::Rotors<double> percent_off(const compensation::Rotors<double>& shares, std::size_t rotors) {
  compensation::Rotors<double> off(rotors);
  for (std::size_t i = 0; i < rotors; ++i) off[i] = 100 * (shares[i] - 1);
  return off;
}

/// Where the K_T of the air comes from.
std::string origin_of_k_t(const FlyRequest& request, const Scene& scene) {
  if (!request.world.empty()) return request.world;
  const AssumedWorld world = assumed_of(request, scene.vehicle, scene.curves);
  const double published = to_newtons_per_rpm2(world.published);
  if (world.as_in_file)
    return fmt::format("the file's own: within {:g} % of the {:.2g} N/RPM^2 published for such a propeller",
                       100 * kPublishedScatter, published);
  return fmt::format(
      "{:.2g} N/RPM^2, as published for such a propeller: the file's is off by {:+.0f} %; --world FILE tells another",
      published, 100 * (scene.curves[0].thrust_coefficient().value() / world.published.value() - 1));
}

std::string circumstances(const FlyRequest& request, const Scene& scene) {
  const Truth& truth = scene.truth;
  std::string known;
  for (std::size_t i = 0; i < request.coefficients.size(); ++i) {
    const compensation::ThrustCurve& curve = scene.curves[i];
    const auto share = [&](Radians phi) { return curve.at(phi) / curve.thrust_coefficient(); };
    known += fmt::format("{}K_T {:.4e} N/(rad/s)^2 and k/K_T from {:.4f} at 0° to {:.4f} at {:g}° ({})",
                         i == 0 ? "" : ",\n", curve.thrust_coefficient().value(), share(Radians(0)),
                         share(curve.largest_fitted()), to_degrees(curve.largest_fitted()), request.coefficients[i]);
  }
  const std::string off =
      fmt::format("mass {:+.1f} %, K_T of the rotors {:+.0f} %, centre of gravity {:+.1f} {:+.1f} mm",
                  100 * (truth.mass - 1), fmt::join(percent_off(truth.thrust, scene.vehicle.rotors()), " "),
                  1e3 * truth.cog_error.x(), 1e3 * truth.cog_error.y());
  const std::string shapes =
      request.open == "X" && request.folded == "O"
          ? ""
          : fmt::format("\nFlown for X: shape {}; for O: shape {}.", request.open, request.folded);
  const std::size_t rotors = scene.vehicle.rotors();
  const std::string unlike = rotors == 4 ? ""
                                         : fmt::format(
                                               "\nThe paper's drone has four rotors, this vehicle {}: the "
                                               "paper's numbers are no measure of it.",
                                               rotors);
  const std::string wired =
      !truth.wired_crosswise() ? "" : "\nThe controller takes one arm's angle for another's (arm_wiring).";
  return fmt::format(
      "The controller flies with {}.\n"
      "The air, which it does not know: K_T {:.4e} N/(rad/s)^2 ({}), loss \"{}\", gamma = {:g} times as on\n"
      "the bench. The vehicle differs from its file by: {}. Seed {}.{}\n\n",
      known, truth.thrust_coefficient.value(), origin_of_k_t(request, scene), name_of(truth.law), truth.gamma, off,
      request.seed, shapes + unlike + wired);
}

std::vector<PaperCell> cells_of(const Flown& flown) {
  return paper_cells(flown.on_bench, flown.flights, flown.draws, flown.nominal.pilot.gains);
}

bool k_t_judged(const FlyRequest& request, const Scene& scene) {
  return !request.world.empty() || !assumed_of(request, scene.vehicle, scene.curves).as_in_file;
}

void print_text(const FlyRequest& request, const Flown& flown) {
  const std::vector<PaperCell> cells = cells_of(flown);
  if (all_flown(flown)) fmt::print("{}", words_of(flown.judgement, flown.findings));
  if (flown.blind) fmt::print("{}", words_of(*flown.blind, k_t_judged(request, flown.nominal)));
  fmt::print("{}{}", circumstances(request, flown.nominal), reproduction_table(cells, flown.nominal.truth.gamma));
  if (!flown.signs.empty()) fmt::print("{}", cog_table(flown.signs));
  for (std::size_t i = 0; i < flown.flights.size(); ++i) {
    if (flown.flights[i].lost) fmt::print("{}: lost, more than 1 m from its reference\n", kExperiments[i].name);
  }
  if (!flown.draws.empty()) fmt::print("{}", findings_table(flown.findings));
  fmt::print("{}", not_reproduced(cells));
}

Json json_of(const Findings& found) {
  Json json;
  KPHI_JSON_MEMBERS(json, found, draws, kept, lost_plain, lost_compensated, hover_z_better, forward_better);
  for (std::size_t i = 0; i < kMerits.size(); ++i) {
    const auto& [p10, p50, p90] = found.merits[i];
    json[kMerits[i].key] = found.kept == 0 ? Json() : Json{{"p10", p10}, {"p50", p50}, {"p90", p90}};
  }
  json["by_loss_law"] = Json::object();
  for (std::size_t law = 0; law < found.by_law.size(); ++law) {
    const Findings::OfLaw& of = found.by_law[law];
    if (of.kept == 0) continue;
    json["by_loss_law"][name_of(static_cast<LossLaw>(law))] = {{"hover_z_ratio_p50", of.hover_z_ratio},
                                                               {"forward_ratio_p50", of.forward_ratio}};
  }
  return json;
}

Json json_of(const PaperCell& cell) {
  const auto number = [](const std::optional<double>& value) { return value ? Json(*value) : Json(); };
  Json json{
      {"row", cell.row},
      {"what", cell.what},
      {"paper", cell.paper},
      {"gamma_1", number(cell.bench)},
      {"world", number(cell.world)},
      {"reproduced", name_of(cell.reproduced)},
      {"reason",
       cell.reproduced == Reproduced::not_reproduced ? Json(kReasons[static_cast<std::size_t>(cell.reason)]) : Json()},
      {"draws", cell.draws}};
  if (cell.draws > 0) json["p10_p50_p90"] = {cell.spread.p10, cell.spread.p50, cell.spread.p90};
  return json;
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

void print_flights(const FlyRequest& request, const Flown& flown) {
  const Truth& truth = flown.nominal.truth;
  Json flights = Json::array();
  for (std::size_t i = 0; i < flown.flights.size(); ++i)
    if (flown.flights[i].leg_count > 0) flights.push_back(json_of(kExperiments[i], flown.flights[i]));
  const Json coefficients =
      request.coefficients.size() == 1 ? Json(request.coefficients[0]) : Json(request.coefficients);
  Json out{{"coefficients", coefficients},   {"vehicle", request.vehicle}, {"seed", request.seed},
           {"loss_law", name_of(truth.law)}, {"gamma", truth.gamma},       {"flights", flights}};
  if (!flown.draws.empty()) out["study"] = json_of(flown.findings);
  if (all_flown(flown)) {
    out["verdict"] = {{"fitness", name_of(flown.judgement.fitness)}, {"doubts", flown.judgement.doubts}};
    if (flown.blind) {
      const BlindZone& blind = *flown.blind;
      out["verdict"]["blind"] = {
          {"fall_share", {blind.least_fall, blind.most_fall}},
          {"k_t_share", k_t_judged(request, flown.nominal) ? Json{blind.least_k_t, blind.most_k_t} : Json()}};
    }
  }
  out["world"] = {{"file", request.world.empty() ? Json() : Json(request.world)},
                  {"k_t_n_per_rad2_s2", truth.thrust_coefficient.value()},
                  {"mass_share", truth.mass}};
  out["paper"] = Json::array();
  const std::vector<PaperCell> cells = cells_of(flown);
  for (const PaperCell& cell : cells) out["paper"].push_back(json_of(cell));
  out["not_reproduced"] = Json::array();
  for (const Reason reason : reasons_of(cells))
    out["not_reproduced"].push_back(kReasons[static_cast<std::size_t>(reason)]);
  print_json(out);
}

ExitCode fly_as_asked(const FlyRequest& request) {
  const Flown flown = fly_requested(request);
  request.json ? print_flights(request, flown) : print_text(request, flown);
  const bool fit = !all_flown(flown) || flown.judgement.fitness == Fitness::fit_to_fly;
  return fit ? ExitCode::ok : ExitCode::data_rejected;
}

}  // namespace

void add_fly(CLI::App& program, ExitCode& exit_code) {
  const auto [command, request] = add_verb<FlyRequest>(
      program, exit_code, "fly",
      "fly the paper's nine experiments in simulation with these coefficients, before propellers turn",
      "kphi fly --coefficients coefficients.yaml --vehicle vehicle.yaml --draws 400", fly_as_asked);
  add_notes(
      command,
      "Without --draws: one set of circumstances. With --draws N: N more sets, drawn from the seed, and percentiles.\n"
      "The exit code is 5 where the verdict is that the coefficients are not fit to fly.");
  add_flight_files(command, request.coefficients, request.vehicle);
  add_value(
      command, "--world", "FILE", request.world,
      "the air and what the vehicle differs by, which the controller never reads (profiles/world_example.yaml, or the "
      "coefficients of a flight log: its K_T and loss; "
      "default: K_T of the file if it is within 30 % of what is published for such a propeller, else that; no error)");
  add_value(command, "--open", "SHAPE", request.open, "shape of the vehicle file to fly for X (default: X)");
  add_value(command, "--folded", "SHAPE", request.folded, "shape to fly for O, such as H or T (default: O)");
  command.add_option("--draws", request.draws, "sets of circumstances to draw, such as 400 (default 0)")
      ->check(CLI::Range(0, 10000));
  add_value(command, "--out", "DIR", request.out, "folder for traces and draws (CSV) and figures (SVG)");
  command.add_flag("--json", request.json, "print the result as JSON");
  begin_group(command, "Developers");
  std::vector<std::string> names;
  for (const Experiment& experiment : kExperiments) names.emplace_back(experiment.name);
  add_value(command, "--experiment", "NAME", request.experiment,
            fmt::format("one of the nine (default: all): {}", fmt::join(names, ", ")))
      ->check(one_of(names));
  command.add_option("--seed", request.seed, "seed of noise and draws")->capture_default_str();
  command
      .add_option("--threads", request.threads,
                  "number of threads (default 0: one per core); the result does not depend on it")
      ->check(CLI::Range(0, 256));
}

}  // namespace kphi::commands
