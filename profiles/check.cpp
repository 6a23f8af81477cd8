#include "profiles/check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string_view>
#include <utility>

#include "compensation/occlusion.hpp"
#include "profiles/answers.hpp"
#include "profiles/plan.hpp"
#include "profiles/schema.hpp"
#include "profiles/vehicle.hpp"

namespace kphi::profiles {
namespace {

/// The files of one call, for the checks of one against another.
struct Loaded {
  std::vector<std::pair<std::size_t, Campaign>> campaigns;  ///< with the file's number
  std::vector<BenchConfig> benches;
  std::vector<std::pair<std::size_t, Answers>> answers;  ///< with the file's number
};

std::string minutes(Seconds time) {
  const auto seconds = std::llround(time.value());
  return seconds < 120 ? fmt::format("{} s", seconds) : fmt::format("{} min {:02} s", seconds / 60, seconds % 60);
}

std::string summary_of(const Campaign& campaign, const Plan& plan, double rate_hz) {
  const StepProfile& profile = campaign.profile;
  const double increment = (to_rpm(profile.last) - to_rpm(profile.first)) / (profile.steps - 1);
  return fmt::format(
      "  propeller  {} ({}, {} in, {} blades)\n"
      "  runs       {}: occlusions {:g}°, {} repetitions of each, {} mountings\n"
      "  order      {}\n"
      "  steps      {}: {} per run, {:.6g} to {:.6g} RPM by {:.6g} RPM, {:g} s each\n"
      "  time       {} spinning, {} with the zeros, without mounting\n"
      "  disk       {:.3g} million samples at {:g} Hz, {:.3g} MB\n",
      campaign.propeller.id, campaign.propeller.name, campaign.propeller.diameter_in, campaign.propeller.blades,
      plan.runs.size(), fmt::join(campaign.occlusions_deg, ", "), campaign.repetitions, plan.mountings,
      to_words(campaign.order), plan.steps, plan.runs.front().steps.size(), to_rpm(profile.first), to_rpm(profile.last),
      increment, profile.dwell.value(), minutes(plan.spinning), minutes(plan.bench),
      static_cast<double>(plan.samples) / 1e6, rate_hz, static_cast<double>(plan.bytes) / 1e6);
}

nlohmann::ordered_json report_of(const Plan& plan) {
  return {{"runs", plan.runs.size()},      {"mountings", plan.mountings},
          {"steps", plan.steps},           {"spinning_s", plan.spinning.value()},
          {"bench_s", plan.bench.value()}, {"samples_in_steps", plan.samples_in_steps},
          {"samples", plan.samples},       {"bytes", plan.bytes}};
}

std::string summary_of(const BenchConfig& bench) {
  const std::string simulated =
      !bench.simulation ? "no"
      : bench.simulation->in_process
          ? fmt::format("in process, seed {}", bench.simulation->seed)
          : fmt::format("{:g} times faster, seed {}", bench.simulation->time_scale, bench.simulation->seed);
  return fmt::format(
      "  net box    {}, RDT port {}, HTTP port {}, {:g} Hz, {} records per datagram\n"
      "  motor      {} at {} baud, module {}, spin {:+}, at most {:.6g} RPM\n"
      "  thrust     along {}F{}\n"
      "  simulated  {}\n",
      bench.netbox.host, bench.netbox.rdt_port, bench.netbox.http_port, bench.netbox.rate_hz,
      bench.netbox.records_per_datagram, bench.iq.device, bench.iq.baud, bench.iq.module_id, bench.iq.spin,
      to_rpm(bench.iq.speed_max), bench.thrust_sign > 0 ? '+' : '-', "xyz"[bench.thrust_axis], simulated);
}

std::string summary_of(const Answers& answers) {
  std::string mountings;
  for (const auto& [angle, mark] : answers.mountings) mountings += fmt::format(" {:g}", angle);
  return fmt::format("  mountings {}°\n  run again  {} decisions\n", mountings, answers.run_again.size());
}

std::string in_words(const Vehicle& vehicle) {
  if (!vehicle.body) return fmt::format("half side {:g} m", vehicle.half_side.value());
  return fmt::format("{} corners", vehicle.body->outline.size());
}

/// A shape with the occlusion of each arm.
std::string summary_of_shape(const std::string& name, const std::array<Radians, 4>& angles,
                             const compensation::Airframe& airframe) {
  std::string arms, occlusions;
  for (std::size_t i = 0; i < angles.size(); ++i) {
    arms += fmt::format(" {:.6g}", to_degrees(angles[i]));
    occlusions += fmt::format(" {:.4g}", to_degrees(compensation::occlusion_of_arm(airframe, i, angles[i])));
  }
  return fmt::format("  shape {:<4} arms at{}°, occluded by{}°\n", name, arms, occlusions);
}

std::string summary_of(const flight::Build& build, const flight::Gains& gains) {
  return fmt::format(
      "  dynamics   {:g} kg, of which {:g} kg at each hub; {:.3g} N per rotor carry it\n"
      "  control    position {:g} 1/s2, velocity {:g} 1/s, attitude {:g} 1/s, rates {:g} 1/s\n",
      build.mass_kg, build.hub_mass_kg, flight::kGravity * build.mass_kg / 4, fmt::join(gains.position, " "),
      fmt::join(gains.velocity, " "), fmt::join(gains.attitude, " "), fmt::join(gains.rate, " "));
}

std::string what_flies(const Vehicle& vehicle) {
  if (vehicle.dynamics && vehicle.control) return summary_of(*vehicle.dynamics, vehicle.control->gains);
  return fmt::format("  kphi fly   cannot fly it without {}\n", vehicle.dynamics  ? "control"
                                                                : vehicle.control ? "dynamics"
                                                                                  : "dynamics and control");
}

std::string summary_of(const Vehicle& vehicle) {
  std::string shapes;
  const compensation::Airframe airframe = airframe_of(vehicle);
  for (const auto& [name, angles] : vehicle.shapes) shapes += summary_of_shape(name, angles, airframe);
  return fmt::format(
      "  body       {}, arms {:g} m, propeller radius {:g} m\n"
      "  speeds     {:.6g} to {:.6g} RPM\n"
      "  overlap    {}\n{}{}",
      in_words(vehicle), vehicle.arm_length.value(), vehicle.propeller_radius.value(), to_rpm(vehicle.speed_min),
      to_rpm(vehicle.speed_max), compensation::name_of(vehicle.overlap), shapes, what_flies(vehicle));
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

std::string format_of(const std::string& text, const std::string& path) {
  try {
    const SourceDocument document = parse_strict_yaml(text, path);
    const auto* object = document.value.get_ptr<const nlohmann::json::object_t*>();
    if (object == nullptr) return "";
    const auto format = object->find("format");
    return format != object->end() && format->second.is_string() ? format->second.get<std::string>() : "";
  } catch (const RefusedFile&) {
    return format_line(text);
  }
}

std::optional<FileKind> kind_by_keys(const SourceDocument& document) {
  static constexpr std::pair<const char*, FileKind> kTelltales[] = {{"occlusions_deg", FileKind::campaign},
                                                                    {"profile", FileKind::campaign},
                                                                    {"netbox", FileKind::bench},
                                                                    {"iq", FileKind::bench},
                                                                    {"shapes_deg", FileKind::vehicle},
                                                                    {"half_side_m", FileKind::vehicle},
                                                                    {"mountings", FileKind::answers}};
  if (!document.value.is_object()) return std::nullopt;
  for (const auto& [key, kind] : kTelltales) {
    if (document.value.contains(key)) return kind;
  }
  return std::nullopt;
}

/// By its format; without a known one by its keys, so that all findings come at once.
FileKind recognise(const std::string& text, const std::string& path, const std::string& format,
                   const std::vector<ForeignKind>& foreign) {
  const auto known = std::ranges::find(kFileKinds, format, &FileKindInfo::format);
  if (known != kFileKinds.end()) return known->kind;
  const SourceDocument document = parse_strict_yaml(text, path);
  if (const auto kind = kind_by_keys(document)) return *kind;
  std::vector<std::string> formats;
  for (const ForeignKind& candidate : foreign) formats.push_back(candidate.format);
  for (const FileKindInfo& candidate : kFileKinds) formats.emplace_back(candidate.format);
  const auto near = nearest_name(format, formats);
  throw RefusedFile(path, {{document.value_mark("/format"), "/format",
                            format.empty() ? "unknown kind of file: no format given" : "unknown format " + format,
                            near ? fmt::format("did you mean format: {}?", *near)
                                 : fmt::format("begin it with format: and one of {}", fmt::join(formats, ", "))}});
}

void judge(CheckedFile& file, std::size_t number, const std::vector<ForeignKind>& foreign, Loaded& loaded) {
  const std::string text = read_text(file.path);
  const std::string format = format_of(text, file.path);
  for (const ForeignKind& candidate : foreign) {
    if (format != candidate.format) continue;
    file.kind = candidate.word;
    file.summary = candidate.judge(file.path);
    return;
  }
  const FileKind kind = recognise(text, file.path, format, foreign);
  file.kind = info(kind).word;
  if (kind == FileKind::campaign) {
    const Campaign campaign = parse_campaign(text, file.path);
    const BenchConfig usual;
    const Plan plan = make_plan(campaign, usual);
    file.summary = summary_of(campaign, plan, usual.netbox.rate_hz);
    file.report["plan"] = report_of(plan);
    loaded.campaigns.emplace_back(number, campaign);
  } else if (kind == FileKind::bench) {
    loaded.benches.push_back(parse_bench(text, file.path));
    file.summary = summary_of(loaded.benches.back());
  } else if (kind == FileKind::answers) {
    loaded.answers.emplace_back(number, parse_answers(text, file.path));
    file.summary = summary_of(loaded.answers.back().second);
  } else {
    file.summary = summary_of(parse_vehicle(text, file.path));
  }
}

void refuse(CheckedFile& file, const std::string& error, nlohmann::ordered_json details = {}) {
  file.errors.push_back(error);
  details["message"] = error;
  file.report["errors"].push_back(std::move(details));
  file.summary.clear();
}

CheckedFile check_file(const std::string& path, std::size_t number, const std::vector<ForeignKind>& foreign,
                       Loaded& loaded) {
  CheckedFile file;
  file.path = path;
  file.report = {{"file", path}, {"kind", nullptr}, {"ok", true}, {"errors", nlohmann::ordered_json::array()}};
  try {
    judge(file, number, foreign, loaded);
  } catch (const RefusedFile& refused) {
    for (const FileFinding& finding : refused.findings()) {
      refuse(file, describe(path, finding),
             {{"line", finding.mark.line},
              {"column", finding.mark.column},
              {"what", finding.what},
              {"next_move", finding.next_move}});
    }
  } catch (const std::runtime_error& refused) {
    refuse(file, refused.what());
  }
  return file;
}

/// Adds to the file what `check` refuses.
template <class Check>
void attempt(CheckedFile& file, Check&& check) {
  try {
    check();
  } catch (const ConfigurationError& refused) {
    refuse(file, refused.what());
  }
}

}  // namespace

std::vector<CheckedFile> check_files(const std::vector<std::string>& paths, const std::vector<ForeignKind>& foreign) {
  std::vector<CheckedFile> files;
  Loaded loaded;
  for (const std::string& path : paths) files.push_back(check_file(path, files.size(), foreign, loaded));
  for (const auto& [number, campaign] : loaded.campaigns) {
    for (const BenchConfig& bench : loaded.benches)
      attempt(files[number], [&, &asked = campaign] { require_within(asked, bench); });
  }
  for (const auto& [number, answers] : loaded.answers) {
    for (const auto& [of_campaign, campaign] : loaded.campaigns) {
      const auto angles = make_plan(campaign, BenchConfig{}).mounting_angles();
      attempt(files[number], [&, &given = answers] { require_mountings(given, angles); });
    }
  }
  for (CheckedFile& file : files) {
    if (!file.kind.empty()) file.report["kind"] = file.kind;
    file.report["ok"] = file.ok();
  }
  return files;
}

}  // namespace kphi::profiles
