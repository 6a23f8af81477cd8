#include "commands/inputs.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "base/number.hpp"
#include "base/text.hpp"
#include "commands/commands.hpp"
#include "compensation/file/coefficient_file.hpp"
#include "compensation/file/plausibility.hpp"
#include "fit/coefficients/error_in_flight.hpp"
#include "fit/export/targets.hpp"
#include "fit/logs/import_table.hpp"
#include "fit/model/averaged_runs.hpp"
#include "fit/model/table_line.hpp"
#include "fit/uncertainty/readiness.hpp"
#include "profiles/bench_config.hpp"
#include "profiles/campaign.hpp"
#include "profiles/schema.hpp"
#include "results/campaign_folder.hpp"
#include "results/checksums.hpp"
#include "results/digest.hpp"
#include "results/file_layer.hpp"
#include "results/journal.hpp"
#include "results/reduction/weighing.hpp"
#include "results/steps_csv.hpp"
#include "results/version.hpp"

namespace kphi::commands {
namespace {

using namespace fit;

namespace fs = std::filesystem;

/// Of "calibration FT21001, 1e+06 counts/N, …", as journals of older versions have it.
std::string serial_in(const std::string& words) {
  constexpr std::string_view kBegin = "calibration ";
  if (!words.starts_with(kBegin)) return {};
  return words.substr(kBegin.size(), words.find(", ") - kBegin.size());
}

/// Rejected runs, accepted ones with the checksums the journal holds, and when the last of them ended; without a
/// journal the files as they lie there. Returns the serial of the calibration of the campaign's load cell, by its
/// journal; empty: unknown, or not the same all the time.
std::string take_runs(const results::CampaignFolder& folder, Provenance& provenance) {
  if (!fs::exists(folder.journal())) {
    for (const fs::path& run : folder.complete_runs())
      provenance.runs.push_back(
          {fs::relative(run, folder.path()).string(), results::sha256_of_file(run), "", std::nullopt});
    return {};
  }
  std::set<std::string> serials;
  const results::JournalReading journal = results::read_journal(folder.journal());
  results::require_intact(folder, [](const std::string& remark) { fmt::print(stderr, "kphi: {}\n", remark); });
  for (const results::JournalEntry& entry : journal.entries) {
    const auto text = [&](const char* key) { return entry.data.value(key, std::string("unknown")); };
    if (entry.event == results::kCampaignStarted || entry.event == results::kCampaignResumed)
      serials.insert(entry.data.value("cell_serial", serial_in(entry.data.value("load_cell", std::string()))));
    if (entry.event == results::kRunAborted) provenance.rejected.push_back({text("run"), entry.utc, text("reason")});
    if (entry.event != results::kRunAccepted || !entry.data.contains("file") || !entry.data.contains("sha256"))
      continue;
    provenance.runs.push_back({entry.data["file"], entry.data["sha256"], "", std::nullopt});
    provenance.measured_utc = entry.utc;
  }
  return serials.size() == 1 ? *serials.begin() : std::string();
}

/// A weighing of this bench and this cell beside the campaign folder.
void take_weighing(const fs::path& folder, const profiles::BenchConfig& bench, const std::string& serial,
                   FitInput& input) {
  const fs::path beside = (fs::absolute(folder) / ".").lexically_normal().parent_path().parent_path();
  std::optional<results::Weighing> other;
  const auto of_this_cell = [&](const results::Weighing& one) {
    if (one.bench != bench.name || one.axis != bench.thrust_axis) return false;
    const bool same_origin = one.origin.empty() || origin_named(one.origin) == input.provenance.origin;
    if (!serial.empty() && one.cell_serial == serial && same_origin) return true;
    other = one;
    return false;
  };
  const auto found = results::nearest_weighing(beside, of_this_cell, input.provenance.measured_utc);
  const results::Weighing* const one = found ? &*found : other ? &*other : nullptr;
  if (one == nullptr) return;
  const std::string when = fmt::format("weighed with {:g} kg on {}", one->mass_kg, one->weighed_utc.substr(0, 10));
  if (!found) {
    fmt::print(stderr, "calibration   {} was cell {}{}, the campaign has another ({}): not taken\n", when,
               printable(one->cell_serial), one->origin.empty() ? "" : ", " + one->origin,
               serial.empty() ? "unknown" : printable(serial));
    return;
  }
  const results::CellCheck check = results::check_of(*found);
  input.u_calibration = check.u_calibration();
  input.provenance.cell_weighed = fmt::format("{}: {}", when, results::gain_words(*found, check));
}

FitInput campaign_input(const fs::path& path) {
  const auto folder = results::CampaignFolder::open(path);
  if (!fs::exists(folder.steps())) {
    throw ConfigurationError(fmt::format("{}: no steps.csv; run `kphi replay {}` to compute it from the runs",
                                         path.string(), path.string()));
  }
  FitInput input;
  input.folder = path;
  input.campaign = input.mounted_once = true;
  input.steps = results::read_steps(folder.steps());
  input.provenance.source = "steps.csv of the campaign folder";
  const std::string serial = take_runs(folder, input.provenance);
  input.provenance.origin = results::origin_of(input.steps);
  if (fs::exists(folder.bench_file())) {
    input.bench = profiles::load_bench(folder.bench_file().string());
    if (input.provenance.origin == Origin::unknown) input.provenance.origin = input.bench.origin();
    const profiles::BenchConfig& bench = input.bench;
    input.provenance.stand = bench.name;
    const auto& gain = bench.iq.clock_gain;
    input.provenance.clock = gain ? MotorClock{gain->factor, gain->u_factor} : MotorClock{};
    take_weighing(path, bench, serial, input);
  }
  if (fs::exists(folder.campaign_file())) {
    input.measured_by = profiles::load_campaign(folder.campaign_file().string());
    const profiles::Campaign& campaign = *input.measured_by;
    input.provenance.operator_name = campaign.operator_name;
    input.provenance.campaign = campaign.name;
    input.provenance.propeller_name = campaign.propeller.name;
    input.provenance.supply_v = campaign.supply.value();
    input.mounted_once = !campaign.order.remount_each_repetition;
  }
  return input;
}

/// What a table does not tell, which counts as unknown and not as zero.
void say_what_is_unknown(const std::vector<results::StepMean>& steps, const fs::path& path) {
  if (averages_unknown(steps))
    fmt::print(stderr,
               "kphi: {}: averages of an unknown number of repetitions (no column repetitions_averaged): how these "
               "scatter is unknown, and each row counts as one; fit the steps.csv beside it\n",
               path.string());
  if (std::ranges::any_of(steps, [](const auto& step) { return std::isnan(step.zero_n); }))
    fmt::print(
        stderr,
        "kphi: {}: the zero that was subtracted from the thrust is unknown (no zero_n): how wrong it is, too, and "
        "not in the ±\n",
        path.string());
}

/// Of a table of k: repeated angles averaged, if a drone can fly on it then.
std::vector<CurvePoint> averaged_table(std::vector<CurvePoint> table, const fs::path& path) {
  const RepeatedAngles averaged = average_repeated(table);
  if (averaged.angles == 0 || !obstacle_to_flight(averaged.points).empty()) return table;
  fmt::print(stderr, "kphi: {}: {}\n", path.string(), averaged.words());
  return averaged.points;
}

/// What `kphi import` found of a log, beside its steps: those that its speed comes in, and its throttle.
void take_import(const fs::path& file, FitInput& input) {
  if (!fs::is_regular_file(file)) return;
  try {
    const auto record = nlohmann::json::parse(results::read_text(file));
    input.u_speed = record.value("u_speed_share", 0.0);
    for (const auto& law : record.value("throttle_laws", nlohmann::json::array())) {
      auto& one = input.provenance.throttle.emplace_back();
      one.name = law.at("law");
      one.rms_n = law.at("rms_n");
      one.not_told_from = law.at("not_told_from").get<std::vector<std::string>>();
      for (const auto& number : law.at("numbers"))
        one.numbers.push_back({number.at("name"), number.at("value"), number.at("half_95")});
    }
  } catch (const nlohmann::json::exception&) {
    throw ConfigurationError(file.string() + ": not as `kphi import` wrote it; import the log again");
  }
}

/// Its first bytes.
std::string beginning_of(const fs::path& path) {
  constexpr std::size_t kLooked = 4096;
  std::string text(kLooked, '\0');
  std::ifstream file(path, std::ios::binary);
  file.read(text.data(), kLooked);
  text.resize(static_cast<std::size_t>(file.gcount()));
  return "\n" + text;
}

/// Of a file that a person writes, given as a result.
const char* next_move_for(profiles::FileKind kind) {
  switch (kind) {
    case profiles::FileKind::campaign:
      return "`kphi run` measures it; then name the folder that it prints";
    case profiles::FileKind::bench:
      return "`kphi devices --bench` asks its devices";
    case profiles::FileKind::vehicle:
      return "give it with --vehicle";
    case profiles::FileKind::answers:
      return "give it with --answers";
    case profiles::FileKind::world:
      return "give it with --world";
    case profiles::FileKind::layout:
      return "give it with --layout";
    case profiles::FileKind::flight_layout:
      return "it says how a flight log is written";
  }
  return "";
}

/// By the names of its columns neither steps nor k.
void refuse_a_log(const std::string& text, const fs::path& path) {
  const std::string_view names = std::string_view(text).substr(0, text.find('\n'));
  if (names.find("speed_rad_s") != std::string_view::npos || names.find("phi_deg") != std::string_view::npos) return;
  throw ConfigurationError(
      fmt::format("{0}: neither steps of kphi nor a table of k (no column speed_rad_s or phi_deg); a log of a stand is "
                  "imported first: kphi import {0} --out DIR",
                  path.string()));
}

FitInput file_input(const fs::path& path, const std::string& unit_of_k) {
  refuse_other_input(path.string(), InputKind::table);
  FitInput input;
  input.folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  input.provenance.campaign = path.stem().string();
  input.provenance.source = path.filename().string();
  const std::string text = results::read_text(path);
  if (is_k_table(text)) {
    input.table = averaged_table(read_k_table(text, path.string(), unit_of_k), path);
  } else {
    refuse_a_log(text, path);
    input.steps = results::parse_steps(text, path.string());
    take_import(input.folder / "import.json", input);
    input.provenance.origin = results::origin_of(input.steps);
    // A log does not tell whether anything was mounted anew; a campaign's own table, which its campaign does.
    const fs::path campaign = input.folder / "campaign.yaml";
    input.mounted_once =
        !fs::is_regular_file(campaign) || !profiles::load_campaign(campaign.string()).order.remount_each_repetition;
    say_what_is_unknown(input.steps, path);
  }
  return input;
}

}  // namespace

void refuse_other_input(const std::string& path, InputKind wanted) {
  if (!fs::is_regular_file(path)) return;
  const std::string begin = beginning_of(path);
  const auto refuse = [&](const std::string& mark, const std::string& word, const char* next) {
    if (begin.find("\n" + mark) == std::string::npos) return;
    throw ConfigurationError(fmt::format("{}: this is {}; {}", path, profiles::file_of_kind(word), next));
  };
  for (const profiles::FileKindInfo& kind : profiles::kFileKinds)
    refuse(fmt::format("format: {}", kind.format), kind.word, next_move_for(kind.kind));
  if (wanted != InputKind::coefficients)
    refuse("format: kphi-coefficients/", "coefficient", "`kphi export`, `kphi compare` and `kphi compensate` take it");
  refuse("format: kphi-faults/", "faults", "`kphi sim --faults` takes it");
  refuse("format: kphi-sim-motor/", "simulated motor", "name it in a bench file: simulation.motor");
  const bool may_be_damaged = fs::path(path).extension() == ".h5";
  if (wanted == InputKind::run && !may_be_damaged && !begin.starts_with("\n\x89HDF"))
    throw ConfigurationError(path + ": not a run file (HDF5); name a campaign folder or a file of its runs/");
  if (wanted != InputKind::run)
    refuse("\x89HDF", "run", "`kphi info` shows it, `kphi fit` takes the campaign folder that it is in");
}

FitInput load_input(const std::string& path, const std::string& unit_of_k) {
  const bool campaign = fs::exists(fs::path(path) / "journal.jsonl") || fs::exists(fs::path(path) / "runs");
  if (fs::is_directory(path) && !campaign && !fs::exists(fs::path(path) / "steps.csv")) {
    throw ConfigurationError(path +
                             ": no campaign and no steps.csv in it; name a folder made by `kphi run` or `kphi import`");
  }
  FitInput input = campaign                 ? campaign_input(path)
                   : fs::is_directory(path) ? file_input(fs::path(path) / "steps.csv", unit_of_k)
                                            : file_input(path, unit_of_k);
  if (!unit_of_k.empty() && input.table.empty())
    throw ConfigurationError(path + ": --k-unit is for a table of k; steps have their units");
  input.provenance.tool_version = kVersion;
  return input;
}

AnalysisOptions analysis_options(const FitInput& input, const Identification& identification) {
  AnalysisOptions options;
  if (const auto& air = identification.air) options.bench.air_density = air->u / air->value;
  if (const auto& clock = input.provenance.clock) options.bench.motor_clock = clock->u_gain;
  if (input.u_speed > 0) options.bench.motor_clock = input.u_speed;
  options.bench.cell_calibration = input.u_calibration;
  options.bench.calibration_note = input.provenance.cell_weighed;
  return options;
}

Fitted fitted_log(const FitInput& input, const std::optional<SpeedRange>& range) {
  IdentificationOptions options{.mounted_once = input.mounted_once};
  if (input.record) options = input.record->options;
  if (range) options.at_speed_rad_s.reset();  // it may lie outside
  options.speed_range = range.value_or(options.speed_range);
  options.curve = {};
  Identification K_T = identify(input.steps, options);
  AnalysisOptions judged = analysis_options(input, K_T);
  if (input.record && input.record->bench) judged.bench = *input.record->bench;
  Analysis analysis = analyse(K_T, judged);
  return {std::move(K_T), std::move(analysis)};
}

fs::path coefficient_file_of(const std::string& path) {
  const fs::path file = fs::is_directory(path) ? fs::path(path) / "coefficients.yaml" : fs::path(path);
  if (!fs::exists(file))
    throw ConfigurationError(fmt::format("{}: not fitted yet; run `kphi fit {}` first", path, path));
  return file;
}

FittedFolder fitted_again(const std::string& folder) {
  FitInput input = load_input(folder);
  const bool alone = !input.steps.empty() &&
                     std::ranges::all_of(input.steps, [](const auto& step) { return step.occlusion_deg == 0; });
  if (alone && !fs::exists(fs::path(folder) / "coefficients.yaml")) {
    Fitted fitted = fitted_log(input);
    return {std::move(input), std::move(fitted)};
  }
  const fs::path file = coefficient_file_of(folder);
  if (!input.table.empty())
    throw ConfigurationError(folder + ": steps.csv is a table of k without steps; use the report of `kphi fit`");
  results::require_seal(results::read_text(file), file.string());
  const RecordedFit record = read_recorded_fit(file.string());
  Identification identification = identify(input.steps, record.options);
  AnalysisOptions options = analysis_options(input, identification);
  options.limits = record.limits;
  if (record.bench) {
    const BenchUncertainty found = std::exchange(options.bench, *record.bench);
    // The file has the number alone.
    if (found.cell_calibration == options.bench.cell_calibration)
      options.bench.calibration_note = found.calibration_note;
  }
  input.provenance.bench = options.bench;
  Analysis analysis = analyse(identification, options);
  return {std::move(input), {std::move(identification), std::move(analysis)}};
}

void add_flight_files(CLI::App& command, std::vector<std::string>& coefficients, std::string& vehicle) {
  add_value(command, "--coefficients", "FILE[,FILE…]", coefficients,
            "coefficients.yaml of `kphi fit`; one for each rotor, in their order, where propellers differ")
      ->delimiter(',')
      ->required();
  add_value(command, "--vehicle", "FILE", vehicle, "vehicle file, such as profiles/foldable_drone.yaml")->required();
}

std::vector<std::string> unlike_journal(const compensation::Coefficients& file, const results::CampaignState& state) {
  std::vector<std::string> problems;
  for (const auto& run : file.provenance.runs) {
    const auto accepted = std::ranges::find(state.accepted, run.file, &results::AcceptedRun::file);
    if (accepted == state.accepted.end() || accepted->digests.sha256 != run.sha256)
      problems.push_back(file.path + ": fitted from another " + run.file + " than the journal's; fit again");
  }
  return problems;
}

compensation::Coefficients load_standing_coefficients(const std::string& path, compensation::Need need) {
  refuse_other_input(path, InputKind::coefficients);
  compensation::Coefficients file = load_sealed_coefficients(path, need);
  const fs::path parent = fs::path(path).parent_path();
  if (!fs::exists(parent / "journal.jsonl")) return file;
  const auto folder = results::CampaignFolder::open(parent.empty() ? "." : parent);
  results::require_intact(folder);
  const auto problems = unlike_journal(file, results::state_of(results::read_journal(folder.journal())));
  if (!problems.empty()) throw DataRejected(problems.front());
  return file;
}

compensation::Coefficients load_sealed_coefficients(const std::string& path, compensation::Need need) {
  compensation::Coefficients file = compensation::load_coefficients(path, need);
  results::require_seal(results::read_text(path), path);
  return file;
}

std::optional<Readiness> print_standing(const compensation::Coefficients& file, const profiles::Vehicle* vehicle) {
  if (origin_named(file.origin) != Origin::measured)
    fmt::print(stderr, "origin        {}: {}\n", file.path, origin_words(file));
  auto verdict = readiness_named(file.verdict);
  if (!verdict || verdict != Readiness::fit_to_fly)
    fmt::print(stderr, "verdict       {}: {}\n", file.path, verdict_words(file));
  if (const auto there = vehicle != nullptr ? error_in_flight(file, *vehicle) : std::nullopt) {
    fmt::print(stderr, "in flight     {}: {}\n", file.path, words(*there, *vehicle));
    verdict = there->readiness;
  }
  print_doubts(file.path, compensation::doubts_of(file));
  return verdict;
}

void print_doubts(const std::string& path, const std::vector<std::string>& doubts) {
  for (const std::string& doubt : doubts) fmt::print(stderr, "doubtful      {}: {}\n", path, doubt);
}

compensation::Rotors<compensation::ThrustCurve> load_curves_for(const std::vector<std::string>& coefficients,
                                                                const profiles::Vehicle& vehicle) {
  const std::size_t rotors = profiles::rotors_of(vehicle);
  if (coefficients.size() != 1 && coefficients.size() != rotors)
    throw ConfigurationError(
        fmt::format("--coefficients names {} files, but the vehicle has {} rotors; give one file "
                    "for all of them, or one for each",
                    coefficients.size(), rotors));
  std::map<std::string, compensation::ThrustCurve> curves;
  for (const std::string& path : coefficients) {
    if (curves.contains(path)) continue;
    const compensation::Coefficients file =
        load_standing_coefficients(fs::is_directory(path) ? coefficient_file_of(path).string() : path);
    const auto mismatch = compensation::overlap_mismatch(file.curve.overlap(), path, vehicle.overlap, vehicle.path);
    if (mismatch) throw ConfigurationError(*mismatch);
    print_standing(file, &vehicle);
    curves.emplace(path, file.curve);
  }
  compensation::Rotors<compensation::ThrustCurve> all(rotors, curves.at(coefficients.front()));
  for (std::size_t i = 1; i < coefficients.size(); ++i) all[i] = curves.at(coefficients[i]);
  return all;
}

void add_live_options(CLI::App& command, daq::live::LiveOptions& options) {
  // CLI11 passes "true" for an option without its value.
  const auto take_port = [&options](const std::string& text) {
    if (text.empty() || text == "true") {
      options.port = 0;
      return;
    }
    options.port = parse_integer<std::uint16_t>(text);
    if (!options.port) {
      throw CLI::ValidationError(
          "--live", fmt::format("\"{}\" is not a port (0 to 65535); without a port, put --live last", text));
    }
  };
  command
      .add_option_function<std::string>("--live", take_port,
                                        "serve a live page on 127.0.0.1 (default PORT: any free one)")
      ->expected(0, 1)
      ->type_name("[PORT]");
  add_value(command, "--udp-json", "HOST:PORT", options.udp_json,
            "send every tick as a JSON datagram (PlotJuggler: 127.0.0.1:9870)");
}

std::string live_greeting(const daq::live::LiveSession& view) {
  const std::string url = view.url();
  return url.empty() ? url : fmt::format("live: {}\n", url);
}

}  // namespace kphi::commands
