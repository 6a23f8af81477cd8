#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <string_view>
#include <vector>

#include "base/number.hpp"
#include "base/text.hpp"
#include "commands/at_the_bench.hpp"
#include "commands/commands.hpp"
#include "commands/inputs.hpp"
#include "compensation/file/coefficient_file.hpp"
#include "compensation/file/plausibility.hpp"
#include "compensation/occlusion.hpp"
#include "daq/campaign/dry_run.hpp"
#include "drivers/sim/input_files.hpp"
#include "fit/coefficients/error_in_flight.hpp"
#include "fit/export/targets.hpp"
#include "fit/flights/flight_layout.hpp"
#include "fit/logs/layout.hpp"
#include "profiles/answers.hpp"
#include "profiles/plan.hpp"
#include "profiles/schema.hpp"
#include "profiles/vehicle.hpp"
#include "profiles/vehicle_drawing.hpp"
#include "profiles/world.hpp"

namespace kphi::commands {
namespace {

using namespace profiles;

struct CheckOptions {
  std::vector<std::string> paths;
  bool json = false;
};

struct CheckedFile {
  std::string path;
  std::string kind;             ///< empty: unknown
  std::string summary;          ///< a few lines; empty if refused
  Json errors = Json::array();  ///< message; of a finding also line, column, what, next_move
  bool changed = false;         ///< since kphi wrote it, or what it was made from
  // For the checks of one file against another.
  std::optional<Campaign> campaign;
  std::optional<BenchConfig> bench;
  std::optional<Answers> answers;
  std::optional<Vehicle> vehicle;
  std::optional<compensation::Coefficients> coefficients;
};

/// On a bench with the usual rate.
Plan plan_of(const Campaign& campaign) { return make_plan(campaign, BenchConfig{}); }

std::string lines_of(const Campaign& campaign) {
  std::string doubts;
  for (const std::string& doubt : doubts_of(campaign)) doubts += "  doubtful   " + doubt + "\n";
  return fmt::format("  {}\n  order {}\n{}", daq::plan_text(campaign, {}, plan_of(campaign)), to_words(campaign.order),
                     doubts);
}

std::string lines_of(const BenchConfig& bench) {
  const std::string simulated =
      !bench.simulation ? "no"
      : bench.simulation->in_process
          ? fmt::format("in process, seed {}", bench.simulation->seed)
          : fmt::format("{:g} times faster, seed {}{}", bench.simulation->time_scale, bench.simulation->seed,
                        simulator_is_missing(bench) ? "; it does not run: start it with kphi sim " + bench.path : "");
  return fmt::format(
      "  load cell  {}, {:g} Hz{}\n"
      "  motor      {} at {} baud{}, spin {:+}, at most {:.6g} RPM\n"
      "  thrust     along {}F{}\n"
      "  simulated  {}\n",
      profiles::load_cell_words(bench), bench.netbox.rate_hz,
      bench.load_cell ? ""
                      : fmt::format(", RDT port {}, HTTP port {}, {} records per datagram", bench.netbox.rdt_port,
                                    bench.netbox.http_port, bench.netbox.records_per_datagram),
      profiles::motor_words(bench), bench.iq.baud, bench.motor ? "" : fmt::format(", module {}", bench.iq.module_id),
      bench.iq.spin, to_rpm(bench.iq.speed_max), bench.thrust_sign > 0 ? '+' : '-', "xyz"[bench.thrust_axis],
      simulated);
}

std::string lines_of(const Answers& answers) {
  std::string mountings;
  for (const auto& [angle, mark] : answers.mountings) mountings += fmt::format(" {:g}", angle);
  return fmt::format("  mountings {}°\n  run again  {} decisions\n", mountings, answers.run_again.size());
}

std::string in_words(const Vehicle& vehicle) {
  if (!vehicle.body) return fmt::format("half side {:g} m", vehicle.half_side.value());
  std::string words = fmt::format("{}", vehicle.body->outline.size());
  for (const auto& part : vehicle.body->more) words += part ? fmt::format(" and {}", part->size()) : "";
  return words + " corners";
}

/// A shape with the occlusion of each rotor.
std::string lines_of_shape(const std::string& name, const Vehicle& vehicle) {
  const bool by_hubs = !vehicle.hubs.empty();
  std::string arms, occlusions;
  for (std::size_t i = 0; i < rotors_of(vehicle); ++i) {
    if (by_hubs) {
      const compensation::HubPosition& hub = vehicle.hubs.at(name)[i];
      arms += fmt::format(" ({:.6g}, {:.6g})", hub.x.value(), hub.y.value());
    } else {
      arms += fmt::format(" {:.6g}", to_degrees(vehicle.shapes.at(name)[i]));
    }
  }
  for (const Radians phi : profiles::occlusions_of(vehicle, name))
    occlusions += fmt::format(" {:.4g}", to_degrees(phi));
  return fmt::format("  shape {:<4} {} at{}{}, occluded by{}°\n", name, by_hubs ? "hubs" : "arms", arms,
                     by_hubs ? " m" : "°", occlusions);
}

std::string lines_of(const flight::Build& build, const flight::Gains& gains) {
  return fmt::format(
      "  dynamics   {:g} kg, of which {:g} kg at each hub; {:.3g} N per rotor carry it\n"
      "  control    position {:g} 1/s2, velocity {:g} 1/s, attitude {:g} 1/s, rates {:g} 1/s\n",
      build.mass_kg, build.hub_mass_kg, flight::kGravity * build.mass_kg / static_cast<double>(build.spin.size()),
      fmt::join(gains.position, " "), fmt::join(gains.velocity, " "), fmt::join(gains.attitude, " "),
      fmt::join(gains.rate, " "));
}

/// "; drag torque points up for 1 3, down for 2 4"
std::string spins_of(const Vehicle& vehicle) {
  if (!vehicle.dynamics) return "";
  std::string up, down;
  for (std::size_t i = 0; i < vehicle.dynamics->spin.size(); ++i)
    (vehicle.dynamics->spin[i] > 0 ? up : down) += fmt::format(" {}", i + 1);
  return fmt::format("; drag torque up of{}, down of{}", up, down);
}

std::string what_flies(const Vehicle& vehicle) {
  if (vehicle.dynamics && vehicle.control)
    return lines_of(*vehicle.dynamics, vehicle.control->gains) +
           (rotors_of(vehicle) == compensation::kFewestRotors
                ? "  kphi fly   cannot fly it: three rotors make no yaw of their own\n"
                : "");
  return fmt::format("  kphi fly   cannot fly it without {}\n", vehicle.dynamics  ? "control"
                                                                : vehicle.control ? "dynamics"
                                                                                  : "dynamics and control");
}

std::string lines_of(const Vehicle& vehicle) {
  std::string shapes;
  for (const std::string& name : shapes_of(vehicle)) shapes += lines_of_shape(name, vehicle);
  return fmt::format(
      "  body       {}, {}, propeller radius {:g} m\n"
      "  rotors     {}{}\n"
      "  speeds     {:.6g} to {:.6g} RPM\n"
      "  overlap    {}\n{}{}\n{}\n",
      in_words(vehicle),
      vehicle.hubs.empty() ? fmt::format("arms {:g} m", vehicle.arm_length.value()) : "hubs given for each shape",
      vehicle.propeller_radius.value(), rotors_of(vehicle), spins_of(vehicle), to_rpm(vehicle.speed_min),
      to_rpm(vehicle.speed_max), compensation::name_of(vehicle.overlap), shapes, what_flies(vehicle),
      fmt::join(profiles::shapes_in_characters(vehicle), "\n"));
}

std::string lines_of(const profiles::World& world) {
  const flight::Truth& truth = world.truth;
  return fmt::format(
      "  air        K_T {:.4g} N/RPM2, loss {}, gamma {:g}\n"
      "  vehicle    {:g} times its mass, centre of gravity {:+g} {:+g} mm off\n"
      "  arms       lag {:g} s, backlash {:.3g}°, told {:g} s late{}\n",
      to_newtons_per_rpm2(truth.thrust_coefficient), name_of(truth.law), truth.gamma, truth.mass,
      1e3 * truth.cog_error.x(), 1e3 * truth.cog_error.y(), truth.arms.lag_s, to_degrees(Radians(truth.arms.backlash)),
      truth.arms.feedback_delay_s,
      !truth.wired_crosswise() ? "" : ", WIRED CROSSWISE: the controller takes one arm's angle for another's");
}

/// What the curve's uncertainty does to the speed of a rotor, at the ends of the valid range.
std::string uncertainty_of(const compensation::Coefficients& file) {
  const compensation::ThrustCurve& curve = file.curve;
  if (file.alone())
    return file.thrust_coefficient
               ? fmt::format("  speeds     known to {} % without occlusion, standard\n",
                             two_digits(50 * file.thrust_coefficient->u / curve.thrust_coefficient().value()))
               : "";
  if (!curve.has_uncertainty()) return "  speeds     uncertainty unknown: the file has no `uncertainty.covariance`\n";
  const auto percent = [&](Radians phi) { return 50 * curve.relative_uncertainty(phi, Radians(0)); };
  std::string more;
  if (!file.assumed.empty()) more += fmt::format("; assumed in it: {}", fmt::join(file.assumed, ", "));
  if (!file.not_known.empty()) more += fmt::format("; unknown and not in it: {}", fmt::join(file.not_known, ", "));
  return fmt::format("  speeds     known to {} % without occlusion, {} % at {:g}°, standard{}\n",
                     two_digits(percent(Radians(0))), two_digits(percent(curve.largest_fitted())),
                     to_degrees(curve.largest_fitted()), more);
}

std::string trend_of(const compensation::ThrustCurve& curve) {
  const auto& [per_rad_s, reference] = curve.speed_trend();
  if (per_rad_s == 0) return {};
  return fmt::format("  speed      k {} by {} % each 1000 RPM; it is k(φ) at {:.0f} RPM\n",
                     per_rad_s > 0 ? "rises" : "falls", two_digits(100 * std::abs(per_rad_s) * from_rpm(1000).value()),
                     to_rpm(reference));
}

std::string curve_of(const compensation::Coefficients& c) {
  if (c.alone()) return "  curve      none: no occlusion was measured\n";
  return fmt::format(
      "  curve      k = {} N/(rad/s)^2{}\n"
      "  valid      {:g}° to {:g}°, overlap measured as {}\n",
      words_of(c.curve), c.anchored && c.form == "line" ? ", anchored at K_T" : "", to_degrees(c.smallest_occlusion),
      to_degrees(c.curve.largest_fitted()), name_of(c.curve.overlap()));
}

std::string lines_of(const compensation::Coefficients& c) {
  std::string doubts;
  for (const std::string& doubt : compensation::doubts_of(c)) doubts += "  doubtful   " + doubt + "\n";
  return fmt::format(
      "  propeller  {} ({})\n"
      "  origin     {}\n"
      "  verdict    {}\n"
      "  K_T        {:.6g} N/(rad/s)^2 = {:.6g} N/RPM^2\n"
      "{}{}{}{}",
      c.propeller.id, c.propeller.name, fit::origin_words(c), fit::verdict_words(c),
      c.curve.thrust_coefficient().value(), to_newtons_per_rpm2(c.curve.thrust_coefficient()), curve_of(c),
      trend_of(c.curve), uncertainty_of(c), doubts);
}

std::string lines_of(const sim::FaultFile& file) {
  std::string words;
  for (const sim::Fault& fault : file.faults) {
    words += fmt::format("  at {:g} s  {}", to_seconds(fault.at), sim::name_of(fault.kind));
    if (fault.lasts > Duration{0}) words += fmt::format(" for {:g} s", to_seconds(fault.lasts));
    if (fault.count > 0) words += fmt::format(", at most {} times", fault.count);
    words += "\n";
  }
  return words;
}

std::string lines_of(const sim::MotorParameters& motor) {
  return fmt::format(
      "  motor      {:.4g} RPM/V, {:g} ohm, {:g} kg m^2 without propeller\n"
      "  supply     {:g} V behind {:g} ohm, at most {:g} A\n",
      to_rpm(RadPerSec(1 / motor.torque_constant)), motor.resistance, motor.rotor_inertia, motor.supply_volts,
      motor.source_resistance, motor.supply_current_max);
}

/// How a kind of file is known: by its line `format: …`, or else by one of its keys.
struct Kind {
  const char* word;
  const char* format;
  std::string (*judge)(const std::string& text, CheckedFile& file);  ///< returns the summary, or throws
  std::vector<const char*> keys{};
};

Kind ours(FileKind kind, decltype(Kind::judge) judge, std::vector<const char*> keys) {
  return {info(kind).word, info(kind).format, judge, std::move(keys)};
}

const std::vector<Kind>& kinds() {
  using Text = const std::string&;
  using File = CheckedFile&;
  static const std::vector<Kind> all{
      ours(FileKind::campaign,
           [](Text text, File file) { return lines_of(file.campaign.emplace(parse_campaign(text, file.path))); },
           {"occlusions_deg", "profile"}),
      ours(FileKind::bench,
           [](Text text, File file) { return lines_of(file.bench.emplace(parse_bench(text, file.path))); },
           {"netbox", "iq"}),
      ours(FileKind::vehicle,
           [](Text text, File file) { return lines_of(file.vehicle.emplace(parse_vehicle(text, file.path))); },
           {"shapes_deg", "half_side_m"}),
      ours(FileKind::answers,
           [](Text text, File file) { return lines_of(file.answers.emplace(parse_answers(text, file.path))); },
           {"mountings"}),
      ours(FileKind::world, [](Text text, File file) { return lines_of(profiles::parse_world(text, file.path)); },
           {"k_t_n_per_rpm2", "loss_law"}),
      ours(FileKind::layout, [](Text text, File file) { return fit::describe(fit::parse_layout(text, file.path)); },
           {"header_line"}),
      ours(FileKind::flight_layout,
           [](Text text, File file) { return fit::describe(fit::parse_flight_layout(text, file.path)); }, {"series"}),
      {"coefficients", compensation::kCoefficientFormat,
       [](Text, File file) {
         return lines_of(
             file.coefficients.emplace(load_standing_coefficients(file.path, compensation::Need::thrust_coefficient)));
       }},
      {"fault script", "kphi-faults/1",
       [](Text text, File file) { return lines_of(sim::parse_faults(text, file.path)); }},
      {"simulated motor", "kphi-sim-motor/1",
       [](Text text, File file) { return lines_of(sim::parse_motor_profile(text, file.path).motor); }},
  };
  return all;
}

/// Value of the first line `format: …`: enough for a file that is not YAML.
std::string format_line(const std::string& text) {
  constexpr std::string_view kKey = "format:";
  std::size_t begin = text.compare(0, kKey.size(), kKey) == 0 ? 0 : text.find("\nformat:");
  if (begin == std::string::npos) return "";
  begin = text.find(':', begin) + 1;
  begin = std::min(text.find_first_not_of(" \"'", begin), text.size());
  return text.substr(begin, text.find_first_of(" \"'\r\n#", begin) - begin);
}

/// Without a known format by its keys, so that all findings come at once.
const Kind& kind_of(const std::string& text, const std::string& path) {
  const auto named = [](const std::string& format) { return std::ranges::find(kinds(), format, &Kind::format); };
  if (const auto known = named(format_line(text)); known != kinds().end()) return *known;
  const SourceDocument document = parse_strict_yaml(text, path);
  std::string format;
  if (document.value.is_object() && document.value.contains("format") && document.value["format"].is_string())
    format = document.value["format"];
  if (const auto known = named(format); known != kinds().end()) return *known;
  std::vector<std::string> formats;
  for (const Kind& kind : kinds()) {
    formats.emplace_back(kind.format);
    for (const char* key : kind.keys)
      if (document.value.is_object() && document.value.contains(key)) return kind;
  }
  const auto near = nearest_name(format, formats);
  throw RefusedFile(path,
                    {{document.value_mark("/format"), "/format",
                      format.empty() ? "unknown kind of file: no format given" : "unknown format " + format,
                      near ? fmt::format("did you mean format: {}?", *near)
                           : fmt::format("begin the file with format: and one of {}", fmt::join(formats, ", "))}});
}

/// Adds to the file what `check` refuses.
template <class Check>
void attempt(CheckedFile& file, Check&& check) {
  const std::size_t before = file.errors.size();
  try {
    check();
  } catch (const RefusedFile& refused) {
    for (const FileFinding& finding : refused.findings()) {
      Json& error = file.errors.emplace_back(Json{{"message", describe(file.path, finding)}});
      KPHI_JSON_MEMBERS(error, finding, what, next_move);
      KPHI_JSON_MEMBERS(error, finding.mark, line, column);
    }
  } catch (const DataRejected& refused) {
    file.changed = true;
    file.errors.push_back({{"message", refused.what()}});
  } catch (const std::runtime_error& refused) {
    file.errors.push_back({{"message", refused.what()}});
  }
  if (file.errors.size() > before) file.summary.clear();
}

CheckedFile check_alone(const std::string& path) {
  CheckedFile file;
  file.path = path;
  attempt(file, [&] {
    if (std::filesystem::is_directory(path))
      throw ConfigurationError(path + ": is a folder; `kphi verify` checks a campaign folder");
    const std::string text = read_text(path);
    const Kind& kind = kind_of(text, path);
    file.kind = kind.word;
    file.summary = kind.judge(text, file);
  });
  return file;
}

/// Every campaign against every bench, all answers against every campaign, and coefficients where each vehicle flies.
void check_together(std::vector<CheckedFile>& files) {
  for (CheckedFile& file : files) {
    for (const CheckedFile& other : files) {
      if (file.campaign && other.bench) attempt(file, [&] { require_within(*file.campaign, *other.bench); });
      if (file.answers && other.campaign)
        attempt(file, [&] { require_mountings(*file.answers, plan_of(*other.campaign)); });
      if (!file.coefficients || !other.vehicle) continue;
      if (const auto there = fit::error_in_flight(*file.coefficients, *other.vehicle))
        file.summary += "  in flight  " + fit::words(*there, *other.vehicle) + "\n";
    }
  }
}

void print_report(const CheckedFile& file) {
  Json report{{"file", file.path},
              {"kind", file.kind.empty() ? Json() : Json(file.kind)},
              {"ok", file.errors.empty()},
              {"errors", file.errors}};
  if (file.campaign) report["plan"] = daq::to_json(plan_of(*file.campaign), {});
  print_json(report, -1);
}

void print(const CheckedFile& file) {
  if (file.errors.empty())
    fmt::print("{}: valid {}\n{}", file.path, file.kind, printable(file.summary, LineEnds::keep));
  for (const Json& error : file.errors)
    fmt::print(stderr, "{}\n", printable(error["message"].get<std::string>(), LineEnds::keep));
}

ExitCode check(const CheckOptions& options) {
  std::vector<CheckedFile> files;
  for (const std::string& path : options.paths) files.push_back(check_alone(path));
  check_together(files);
  for (const CheckedFile& file : files) options.json ? print_report(file) : print(file);
  const bool ok = std::ranges::all_of(files, [](const CheckedFile& file) { return file.errors.empty(); });
  const bool changed = std::ranges::all_of(files, [](const auto& file) { return file.changed || file.errors.empty(); });
  return ok ? ExitCode::ok : changed ? ExitCode::data_rejected : ExitCode::usage;
}

}  // namespace

void add_check(CLI::App& program, ExitCode& exit_code) {
  const auto [command, options] = add_verb<CheckOptions>(
      program, exit_code, "check",
      "check campaign, bench, vehicle, answers, layout and coefficient files, fault scripts and simulated motors",
      "kphi check my_bench.yaml my_campaign.yaml", check);
  add_argument(command, "FILE", options.paths,
               "files; campaigns are also checked against the benches and answers among them, coefficients against the "
               "vehicles");
  command.add_flag("--json", options.json, "print one JSON object per file on a line of its own");
}

}  // namespace kphi::commands
