#include <algorithm>
#include <atomic>
#include <filesystem>
#include <future>
#include <mutex>
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
#include "results/reduction/repetitions.hpp"
#include "results/run_reader.hpp"
#include "results/steps_csv.hpp"

namespace kphi::commands {
namespace {

using namespace daq;

using results::CampaignFolder;
using results::StepMean;

struct Asked {
  std::string path;
  bool json = false;
  live::LiveOptions live;
  double speed = 1;  ///< recorded seconds per second
};

struct Replay {
  std::vector<StepMean> steps;
  std::optional<std::filesystem::path> stored;      ///< steps.csv of the campaign folder, when there is one
  std::optional<std::filesystem::path> means;       ///< means.csv likewise; of a whole campaign only
  std::optional<std::filesystem::path> references;  ///< references.csv likewise
  std::vector<StepMean> reference_steps;
  bool whole_campaign = false;
};

std::vector<std::filesystem::path> runs_of(const CampaignFolder& folder) {
  if (!std::filesystem::exists(folder.campaign_file())) return folder.complete_runs();
  return folder.complete_runs(profiles::load_campaign(folder.campaign_file().string()).occlusions_deg);
}

/// Steps in the order of the files; a thread per processor. HDF5 is asked by one thread at a time; the samples are read
/// without it.
std::vector<StepMean> reduced(std::span<const std::filesystem::path> runs) {
  std::mutex opening;
  std::vector<std::packaged_task<std::vector<StepMean>()>> tasks;
  for (const auto& run : runs) {
    tasks.emplace_back([&opening, &run] {
      std::unique_lock one_at_a_time(opening);
      results::RunFile file = results::open_run(run);
      one_at_a_time.unlock();
      return reduce_with_zeros(std::move(file)).steps;
    });
  }
  std::atomic<std::size_t> next = 0;
  std::vector<std::jthread> threads;
  for (unsigned i = 0; i < std::max(1u, std::thread::hardware_concurrency()); ++i)
    threads.emplace_back([&] {
      for (std::size_t task = next++; task < tasks.size(); task = next++) tasks[task]();
    });
  std::vector<StepMean> steps;
  for (auto& task : tasks) {
    const std::vector<StepMean> of_run = task.get_future().get();
    steps.insert(steps.end(), of_run.begin(), of_run.end());
  }
  return steps;
}

Replay replay(const std::filesystem::path& path) {
  Replay result;
  result.whole_campaign = std::filesystem::is_directory(path);
  std::filesystem::path steps;
  if (result.whole_campaign) {
    const CampaignFolder folder = CampaignFolder::open(path);
    result.steps = reduced(runs_of(folder));
    steps = folder.steps();
    if (std::filesystem::exists(folder.means())) result.means = folder.means();
    if (std::filesystem::exists(folder.references())) {
      result.references = folder.references();
      result.reference_steps = reduced(folder.reference_runs());
    }
  } else {
    result.steps = reduced(std::span(&path, 1));
    const auto runs = std::filesystem::absolute(path).parent_path();
    const bool is_reference = !result.steps.empty() && result.steps.front().repetition < 0;
    if (runs.filename() == "runs") steps = runs.parent_path() / (is_reference ? "references.csv" : "steps.csv");
  }
  if (!steps.empty() && std::filesystem::exists(steps)) result.stored = steps;
  return result;
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    lines.push_back(text.substr(at, end - at));
    at = end + 1;
  }
  return lines;
}

/// Of the whole campaign every byte counts; of one run its block of lines must be in the file as it is.
std::optional<std::string> difference(const Replay& replay, const std::string& stored) {
  const std::string again = results::format_steps(replay.steps);
  if (again == stored) return std::nullopt;
  const std::vector<std::string> old_lines = lines_of(stored);
  std::vector<std::string> new_lines = lines_of(again);
  std::size_t at = 0;
  if (!replay.whole_campaign) {
    new_lines.erase(new_lines.begin());
    if (new_lines.empty()) return std::nullopt;
    // Propeller, blades, diameter, occlusion and repetition open each line of the run.
    std::size_t comma = 0;
    for (int i = 0; i < 5; ++i) comma = new_lines.front().find(',', comma) + 1;
    const std::string opening = new_lines.front().substr(0, comma);
    while (at < old_lines.size() && !old_lines[at].starts_with(opening)) ++at;
  }
  for (std::size_t i = 0; i < new_lines.size() || (replay.whole_campaign && at + i < old_lines.size()); ++i) {
    const std::string was = at + i < old_lines.size() ? old_lines[at + i] : "(no line)";
    const std::string is = i < new_lines.size() ? new_lines[i] : "(no line)";
    if (was != is) return fmt::format("line {} differs\n  stored: {}\n  again:  {}", at + i + 1, was, is);
  }
  if (!replay.whole_campaign) return std::nullopt;
  return std::string("the line ends differ");
}

/// NaN becomes null.
Json to_json(const StepMean& step) {
  return {{"propeller", step.propeller},
          {"occlusion_deg", step.occlusion_deg},
          {"repetition", step.repetition},
          {"step", step.step},
          {"commanded_speed_rad_s", step.commanded_speed_rad_s},
          {"speed_rad_s", step.speed_rad_s},
          {"thrust_n", step.thrust_n},
          {"thrust_sd_n", step.thrust_sd_n},
          {"torque_nm", step.torque_nm},
          {"zero_n", step.zero_n},
          {"thrust_samples", step.thrust_samples},
          {"thrust_u_n", step.thrust_u_n},
          {"thrust_n_eff", step.thrust_n_eff},
          {"lag_s", step.lag_s},
          {"quality_flags", results::quality_flag_names(step.quality_flags)}};
}

void print(const Replay& replay, const std::optional<std::string>& differs, bool json) {
  if (!json) {
    fmt::print("{}", results::format_steps(replay.steps));
    return;
  }
  Json out;
  out["steps"] = Json::array();
  for (const StepMean& step : replay.steps) out["steps"].push_back(to_json(step));
  out["compared_with"] = replay.stored ? Json(replay.stored->string()) : Json();
  out["same"] = replay.stored ? Json(!differs) : Json();
  out["difference"] = differs ? Json(*differs) : Json();
  print_json(out);
}

ExitCode run_replay(const Asked& asked) {
  const Replay result = replay(asked.path);
  std::optional<std::string> differs;
  if (result.stored) differs = difference(result, results::read_text(*result.stored));
  if (!differs && result.means && results::read_text(*result.means) != results::format_steps(means_of(result.steps))) {
    differs = "agrees, but means.csv beside it is not its average over the repetitions";
  }
  if (!differs && result.references &&
      results::read_text(*result.references) != results::format_steps(result.reference_steps)) {
    differs = "agrees, but references.csv beside it differs from what its runs give";
  }
  print(result, differs, asked.json);
  if (!differs) return ExitCode::ok;
  fmt::print(stderr, "{}: {}; the raw files are the truth, see kphi verify\n", result.stored->string(), *differs);
  return ExitCode::data_rejected;
}

/// Plays a recorded run. With a page it waits for the first browser.
ExitCode show_replay(const Asked& asked) {
  if (std::filesystem::is_directory(asked.path))
    throw ConfigurationError(asked.path +
                             ": --live and --udp-json show one run, not a folder; name a file of its runs/");
  const results::RunRecording recording = results::read_run(asked.path);
  live::LiveSession view(asked.live, live::subject_of(recording));
  put(stderr, live_greeting(view));
  const SignalWatch signals;
  const std::function<bool()> stop_asked = [] { return SignalWatch::count() > 0; };
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

ExitCode replay_as_asked(const Asked& asked) { return asked.live.any() ? show_replay(asked) : run_replay(asked); }

}  // namespace

void add_replay(CLI::App& program, ExitCode& exit_code) {
  const auto [command, asked] = add_verb<Asked>(
      program, exit_code, "replay", "compute the step means again from the raw samples and compare them with steps.csv",
      replay_as_asked);
  add_argument(command, "PATH", asked.path, "run file or campaign folder")->check(kExistingPath);
  command.add_flag("--json", asked.json, "print one JSON object");
  add_live_options(command, asked.live);
  command.add_option("--speed", asked.speed, "with --live or --udp-json: recorded seconds per second")
      ->check(CLI::Range(0.01, 1000.0))
      ->capture_default_str();
}

}  // namespace kphi::commands
