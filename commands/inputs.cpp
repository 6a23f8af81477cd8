#include "commands/inputs.hpp"

#include <fmt/format.h>

#include <map>
#include <nlohmann/json.hpp>

#include "base/number.hpp"
#include "commands/commands.hpp"
#include "compensation/file/coefficient_file.hpp"
#include "compensation/file/plausibility.hpp"
#include "fit/logs/import_table.hpp"
#include "profiles/bench_config.hpp"
#include "profiles/campaign.hpp"
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

/// Throws DataRejected if the journal or a file beside the runs is not as kphi left it.
void require_unchanged(const results::CampaignFolder& folder, const results::JournalReading& journal) {
  const auto [problems, remarks] = results::files_beside(folder, journal);
  for (const std::string& remark : remarks) fmt::print(stderr, "kphi: {}\n", remark);
  const std::string& first = !journal.problems.empty() ? journal.problems.front()
                             : !problems.empty()       ? problems.front()
                                                       : std::string();
  if (!first.empty())
    throw DataRejected(
        fmt::format("{}; `kphi verify {}` lists all, `kphi replay {}` computes the tables again from the "
                    "runs, and a table of your own is fitted by its name",
                    first, folder.path().string(), folder.path().string()));
}

/// Rejected runs, accepted ones with the checksums the journal holds, and when the last of them ended; without a
/// journal the files as they lie there. Returns what the journal says of the load cell.
std::string take_runs(const results::CampaignFolder& folder, Provenance& provenance) {
  if (!fs::exists(folder.journal())) {
    for (const fs::path& run : folder.complete_runs())
      provenance.runs.push_back(
          {fs::relative(run, folder.path()).string(), results::sha256_of_file(run), "", std::nullopt});
    return {};
  }
  std::string load_cell;
  const results::JournalReading journal = results::read_journal(folder.journal());
  require_unchanged(folder, journal);
  for (const results::JournalEntry& entry : journal.entries) {
    const auto text = [&](const char* key) { return entry.data.value(key, std::string("unknown")); };
    if (entry.event == results::kCampaignStarted) load_cell = text("load_cell");
    if (entry.event == results::kRunAborted) provenance.rejected.push_back({text("run"), entry.utc, text("reason")});
    if (entry.event != results::kRunAccepted || !entry.data.contains("file") || !entry.data.contains("sha256"))
      continue;
    provenance.runs.push_back({entry.data["file"], entry.data["sha256"], "", std::nullopt});
    provenance.measured_utc = entry.utc;
  }
  return load_cell;
}

/// A weighing of this bench beside the campaign folder, if it was of the same cell.
void take_weighing(const fs::path& folder, const profiles::BenchConfig& bench, const std::string& load_cell,
                   FitInput& input) {
  const fs::path beside = (fs::absolute(folder) / ".").lexically_normal().parent_path().parent_path();
  const auto found = results::nearest_weighing(beside, bench.name, bench.thrust_axis, input.provenance.measured_utc);
  if (!found) return;
  const std::string when = fmt::format("weighed with {:g} kg on {}", found->mass_kg, found->weighed_utc.substr(0, 10));
  if (load_cell.find(found->cell_serial + ",") == std::string::npos) {
    fmt::print(stderr, "calibration   {} was cell {}, the campaign has another ({}): not taken\n", when,
               found->cell_serial, load_cell);
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
  input.campaign = true;
  input.steps = results::read_steps(folder.steps());
  input.provenance.source = "steps.csv of the campaign folder";
  const std::string load_cell = take_runs(folder, input.provenance);
  if (fs::exists(folder.bench_file())) {
    input.bench = profiles::load_bench(folder.bench_file().string());
    const profiles::BenchConfig& bench = input.bench;
    input.provenance.stand = bench.name;
    const auto& gain = bench.iq.clock_gain;
    input.provenance.clock = gain ? MotorClock{gain->factor, gain->u_factor} : MotorClock{};
    take_weighing(path, bench, load_cell, input);
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

FitInput file_input(const fs::path& path, const std::string& unit_of_k) {
  FitInput input;
  input.folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  input.provenance.campaign = path.stem().string();
  input.provenance.source = path.filename().string();
  const std::string text = results::read_text(path);
  if (is_k_table(text)) {
    input.table = read_k_table(text, path.string(), unit_of_k);
  } else {
    input.steps = results::parse_steps(text, path.string());
  }
  return input;
}

}  // namespace

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
  options.bench.cell_calibration = input.u_calibration;
  options.bench.calibration_note = input.provenance.cell_weighed;
  return options;
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
    Identification K_T = identify(input.steps);
    Analysis analysis = analyse(K_T, analysis_options(input, K_T));
    return {std::move(input), {std::move(K_T), std::move(analysis)}};
  }
  const fs::path file = coefficient_file_of(folder);
  if (!input.table.empty())
    throw ConfigurationError(folder + ": steps.csv is a table of k without steps; use the report of `kphi fit`");
  results::require_seal(results::read_text(file), file.string());
  const RecordedFit record = read_recorded_fit(file.string());
  Identification identification = identify(input.steps, record.options);
  AnalysisOptions options = analysis_options(input, identification);
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
  add_value(command, "--coefficients", "FILE[,FILE,FILE,FILE]", coefficients,
            "coefficients.yaml of `kphi fit`; four, in the order of the rotors, where propellers differ")
      ->delimiter(',')
      ->required();
  add_value(command, "--vehicle", "FILE", vehicle, "vehicle file, such as profiles/foldable_drone.yaml")->required();
}

compensation::Coefficients load_sealed_coefficients(const std::string& path) {
  compensation::Coefficients file = compensation::load_coefficients(path);
  results::require_seal(results::read_text(path), path);
  return file;
}

void print_doubts(const std::string& path, const std::vector<std::string>& doubts) {
  for (const std::string& doubt : doubts) fmt::print(stderr, "doubtful      {}: {}\n", path, doubt);
}

compensation::Rotors<compensation::ThrustCurve> load_curves_for(const std::vector<std::string>& coefficients,
                                                                const profiles::Vehicle& vehicle) {
  constexpr std::size_t kRotors = 4;
  if (coefficients.size() != 1 && coefficients.size() != kRotors)
    throw ConfigurationError(
        fmt::format("--coefficients names {} files, but the vehicle has {} rotors; give one file "
                    "for all of them, or one for each",
                    coefficients.size(), kRotors));
  std::map<std::string, compensation::ThrustCurve> curves;
  for (const std::string& path : coefficients) {
    if (curves.contains(path)) continue;
    const compensation::Coefficients file = load_sealed_coefficients(path);
    print_doubts(path, compensation::doubts_of(file));
    const auto mismatch = compensation::overlap_mismatch(file.curve.overlap(), path, vehicle.overlap, vehicle.path);
    if (mismatch) throw ConfigurationError(*mismatch);
    curves.emplace(path, file.curve);
  }
  const auto of = [&](std::size_t rotor) { return curves.at(coefficients[coefficients.size() == 1 ? 0 : rotor]); };
  return {of(0), of(1), of(2), of(3)};
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
