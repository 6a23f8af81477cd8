#include <algorithm>
#include <atomic>
#include <filesystem>
#include <future>
#include <map>
#include <optional>
#include <span>
#include <thread>
#include <utility>
#include <vector>

#include "commands/commands.hpp"
#include "commands/inputs.hpp"
#include "daq/guard/run_stopped.hpp"
#include "daq/live/replayed_run.hpp"
#include "profiles/campaign.hpp"
#include "results/campaign_folder.hpp"
#include "results/reduction/reduction.hpp"
#include "results/reduction/step_averages.hpp"
#include "results/run_reader.hpp"
#include "results/steps_csv.hpp"

namespace kphi::commands {
namespace {

using namespace daq;

using results::CampaignFolder;
using results::StepMean;

struct ReplayRequest {
  std::string path;
  bool csv = false;
  bool json = false;
  live::LiveOptions live;
  double speed = 1;  ///< recorded seconds per second
};

struct Replay {
  explicit Replay(std::vector<StepMean> again) : steps(std::move(again)), table(results::format_steps(steps)) {}
  std::vector<StepMean> steps;
  std::string table;                            ///< of the steps
  std::optional<std::filesystem::path> stored;  ///< the campaign's table that should hold them, if there is one
  std::optional<std::string> difference;        ///< of that table, or of another one of the campaign
};

/// Steps in the order of the files. Throws DataRejected for a run that was changed.
std::vector<StepMean> reduced(std::span<const std::filesystem::path> runs) {
  std::vector<std::packaged_task<std::vector<StepMean>(results::LoadCellColumns&)>> tasks;
  std::map<std::string, results::RunDigests> digests;
  if (!runs.empty()) digests = results::digests_beside(runs.front());
  for (const auto& run : runs) {
    tasks.emplace_back([&](auto& cell) { return reduce(results::read_unchanged_run(run, digests, cell), cell); });
  }
  std::atomic<std::size_t> next = 0;
  const auto work = [&] {
    results::LoadCellColumns cell;
    for (std::size_t task = next++; task < tasks.size(); task = next++) tasks[task](cell);
  };
  std::vector<std::jthread> others;  // one in all for a processor: another costs more, by its memory, than it saves
  for (std::size_t i = 1; i < std::min<std::size_t>(std::thread::hardware_concurrency(), tasks.size()); ++i)
    others.emplace_back(work);
  work();
  std::vector<StepMean> steps;
  for (auto& task : tasks) {
    const std::vector<StepMean> of_run = task.get_future().get();
    steps.insert(steps.end(), of_run.begin(), of_run.end());
  }
  return steps;
}

using Lines = std::vector<std::pair<std::size_t, std::string>>;  // with their numbers

Lines split_lines(const std::string& text, const std::string& opening) {
  Lines lines;
  std::istringstream in(text);
  std::string line;
  for (std::size_t number = 1; std::getline(in, line); ++number)
    if (line.starts_with(opening)) lines.emplace_back(number, line);
  return lines;
}

/// The first of the lines with this opening that differs; without an opening every byte counts.
std::optional<std::string> difference(const std::string& again, const std::string& stored,
                                      const std::string& opening = {}) {
  if (again == stored) return std::nullopt;
  const Lines was = split_lines(stored, opening), is = split_lines(again, opening);
  for (std::size_t i = 0; i < std::max(was.size(), is.size()); ++i) {
    const auto [number, before] =
        i < was.size() ? was[i] : std::pair(was.empty() ? 1 : was.back().first + 1, "(no line)");
    const std::string now = i < is.size() ? is[i].second : "(no line)";
    if (before != now) return fmt::format("line {} differs\n  stored: {}\n  again:  {}", number, before, now);
  }
  return opening.empty() ? std::optional<std::string>("the line ends differ") : std::nullopt;
}

/// Propeller, blades, diameter, occlusion and repetition, which open each line of a run.
std::string opening_of(const std::string& table) {
  const std::size_t begin = table.find('\n') + 1;
  std::size_t end = begin;
  for (int i = 0; i < 5; ++i) end = table.find(',', end) + 1;
  return table.substr(begin, end - begin);
}

bool is_unlike(const std::filesystem::path& table, const std::vector<StepMean>& steps) {
  return std::filesystem::exists(table) && results::read_text(table) != results::format_steps(steps);
}

Replay replay_campaign(const CampaignFolder& folder) {
  std::vector<double> order;
  if (const auto file = folder.campaign_file(); std::filesystem::exists(file))
    order = profiles::load_campaign(file.string()).occlusions_deg;
  Replay replay(reduced(folder.complete_runs(order)));
  if (!std::filesystem::exists(folder.steps())) return replay;
  replay.stored = folder.steps();
  replay.difference = difference(replay.table, results::read_text(folder.steps()));
  if (!replay.difference && is_unlike(folder.means(), means_of(replay.steps)))
    replay.difference =
        "agrees, but means.csv beside it is not its average over the repetitions, or was written by an older kphi";
  if (!replay.difference && is_unlike(folder.references(), reduced(folder.reference_runs())))
    replay.difference = "agrees, but references.csv beside it differs from what its runs give";
  return replay;
}

Replay replay_run(const std::filesystem::path& path) {
  Replay replay(reduced(std::span(&path, 1)));
  const auto runs = std::filesystem::absolute(path).parent_path();
  // An aborted run is in no table; another run of its occlusion and repetition may be.
  if (replay.steps.empty() || runs.filename() != "runs" || !results::is_complete_run(path.filename().string()))
    return replay;
  const auto table = runs.parent_path() / (replay.steps.front().repetition < 0 ? "references.csv" : "steps.csv");
  if (!std::filesystem::exists(table)) return replay;
  replay.stored = table;
  replay.difference = difference(replay.table, results::read_text(table), opening_of(replay.table));
  return replay;
}

/// NaN becomes null.
Json to_json(const StepMean& step) {
  Json json;
  KPHI_JSON_MEMBERS(json, step, propeller, occlusion_deg, repetition, step, commanded_speed_rad_s, speed_rad_s,
                    thrust_n, thrust_sd_n, torque_nm, zero_n, thrust_samples, thrust_u_n, thrust_n_eff, lag_s);
  json["quality_flags"] = results::quality_flag_names(step.quality_flags);
  return json;
}

void print(const Replay& replay, const ReplayRequest& asked) {
  if (!asked.json && (asked.csv || !replay.stored)) return fmt::print("{}", replay.table);
  if (!asked.json && replay.difference) return;
  if (!asked.json) return fmt::print("{}: agrees, {} steps\n", replay.stored->string(), replay.steps.size());
  Json steps = Json::array();
  for (const StepMean& step : replay.steps) steps.push_back(to_json(step));
  print_json({{"steps", steps},
              {"compared_with", replay.stored ? Json(replay.stored->string()) : Json()},
              {"same", replay.stored ? Json(!replay.difference) : Json()},
              {"difference", replay.difference ? Json(*replay.difference) : Json()}});
}

ExitCode run_replay(const ReplayRequest& asked) {
  refuse_other_input(asked.path, InputKind::run);
  const bool is_campaign = std::filesystem::is_directory(asked.path);
  const Replay result = is_campaign ? replay_campaign(CampaignFolder::open(asked.path)) : replay_run(asked.path);
  print(result, asked);
  if (!result.difference) return ExitCode::ok;
  fmt::print(stderr, "{}: {}; check the raw files with `kphi verify`\n", result.stored->string(), *result.difference);
  return ExitCode::data_rejected;
}

/// Plays a recorded run. With a page it waits for the first browser.
ExitCode show_replay(const ReplayRequest& asked) {
  if (std::filesystem::is_directory(asked.path))
    throw ConfigurationError(asked.path +
                             ": --live and --udp-json show one run, not a folder; name a file of its runs/");
  results::require_unchanged_run(asked.path, results::digests_beside(asked.path));
  const results::RunRecording recording = results::read_run(asked.path);
  live::LiveSession view(asked.live, live::subject_of(recording));
  put(stderr, live_greeting(view));
  if (asked.live.port) put(stderr, "The replay starts when a browser opens this address; Ctrl-C ends it.\n");
  const SignalWatch signals;
  const std::function<bool()> stop_asked = [] {
    if (SignalWatch::take_suspension()) SignalWatch::suspend();  // right here: nothing turns
    return SignalWatch::count() > 0;
  };
  while (asked.live.port && !view.is_watched() && !stop_asked())
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  ManualClock clock;
  Progress nobody;
  const auto progress = view.beside(nobody, clock);
  const bool whole =
      view.tell_the_end([&] { return live::play(recording, clock, *progress, asked.speed, stop_asked); });
  if (whole) return ExitCode::ok;
  throw Interrupted("stopped by request");
}

}  // namespace

void add_replay(CLI::App& program, ExitCode& exit_code) {
  const auto [command, asked] = add_verb<ReplayRequest>(
      program, exit_code, "replay", "compute the step means again from the raw samples and compare them with steps.csv",
      "kphi replay results/<folder>\nkphi replay results/<folder>/runs/5x3_phi090_rep2.h5 --live --speed 5",
      [](const ReplayRequest& it) { return it.live.any() ? show_replay(it) : run_replay(it); });
  add_argument(command, "PATH", asked.path, "run file or campaign folder")->check(kExistingPath);
  command.add_flag("--csv", asked.csv, "print the table also where there is one to compare it with");
  command.add_flag("--json", asked.json, "print one JSON object");
  add_live_options(command, asked.live);
  command.add_option("--speed", asked.speed, "with --live or --udp-json: recorded seconds per second")
      ->check(CLI::Range(0.01, 1000.0))
      ->capture_default_str();
}

}  // namespace kphi::commands
