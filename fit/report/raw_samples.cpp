#include "fit/report/raw_samples.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "base/statistics.hpp"
#include "results/campaign_folder.hpp"
#include "results/run_reader.hpp"

namespace kphi::fit {
namespace {

constexpr std::size_t kSamplesPerAngle = 2000;

std::vector<double> every_nth(const std::vector<double>& values, std::size_t most) {
  if (values.size() <= most) return values;
  std::vector<double> kept;
  for (std::size_t i = 0; i < most; ++i) kept.push_back(values[i * values.size() / most]);
  return kept;
}

double seconds(Nanoseconds time) { return 1e-9 * static_cast<double>(time); }

/// Calls take(arrival, thrust) for every sample: s from the start of the run; N, zero not subtracted.
void for_each_sample(const results::RunRecording& run, const results::LoadCellColumns& cell, auto&& take) {
  const double newton_per_count = run.header.thrust_sign / run.header.load_cell.counts_per_newton;
  std::size_t i = 0;
  for (const auto& [end, arrival_ns] : cell.datagrams) {
    for (; i < end; ++i) take(seconds(arrival_ns), cell.force[i] * newton_per_count);
  }
}

/// Times in s: where they count from, what is shown of them, and the width of a mean of the thrust.
struct Shown {
  double zero, from, to, bin;
};

/// Thrust less the zero that gave `step` its mean; nullopt without a sample in its window.
std::optional<Settling> read_into(Settling shown, const results::RunRecording& run,
                                  const results::LoadCellColumns& cell, const results::StepMean& step,
                                  const Shown& span) {
  shown.window_begin_s = step.window_begin_s - span.zero;
  shown.window_end_s = step.window_end_s - span.zero;
  const auto inside = [&](double t) { return t >= span.from && t <= span.to; };
  for (const MotorReading& reading : run.motor) {
    const double t = seconds(reading.time_ns) - span.zero;
    if (reading.channel == MotorChannel::speed && inside(t)) shown.speed_rad_s.push_back({t, std::abs(reading.value)});
  }
  std::map<int, std::vector<double>> bins;
  std::vector<double> averaged;
  for_each_sample(run, cell, [&](double time_s, double thrust_n) {
    const double t = time_s - span.zero;
    if (!inside(t)) return;
    bins[static_cast<int>(std::floor(t / span.bin))].push_back(thrust_n);
    if (t >= shown.window_begin_s && t <= shown.window_end_s) averaged.push_back(thrust_n);
  });
  if (averaged.empty()) return std::nullopt;
  const double shift = step.thrust_n - mean(averaged);  // the zero
  for (const auto& [bin, values] : bins) shown.thrust_n.push_back({(bin + 0.5) * span.bin, mean(values) + shift});
  return shown;
}

std::vector<std::string> event_lines(const results::RunRecording& run) {
  std::vector<std::string> lines;
  for (const StreamEvent& event : run.events)
    lines.push_back(fmt::format("{:.2f} s: {}{}", seconds(event.time_ns), name_of(event.kind),
                                event.text.empty() ? "" : ", " + event.text));
  return lines;
}

}  // namespace

bool is_run_of(const RunProvenance& run, const results::StepMean& step) {
  return std::filesystem::path(run.file).filename() ==
         results::run_file_name(step.propeller, step.occlusion_deg, step.repetition);
}

std::vector<double> thrust_samples(const results::RunRecording& run, const results::LoadCellColumns& cell,
                                   const results::StepMean& step, std::size_t most) {
  std::vector<double> samples;
  for_each_sample(run, cell, [&](double time_s, double thrust_n) {
    if (time_s >= step.window_begin_s && time_s <= step.window_end_s) samples.push_back(thrust_n);
  });
  const double shift = step.thrust_n - mean(samples);
  for (double& sample : samples) sample += shift;
  return every_nth(samples, most);
}

std::optional<Settling> settling_of(const results::RunRecording& run, const results::LoadCellColumns& cell,
                                    const results::StepMean& step) {
  constexpr double kBefore_s = 0.15, kBin_s = 0.01;
  const auto command = std::ranges::find_if(run.phases, [&](const results::PhaseMark& mark) {
    return mark.phase == results::Phase::step && mark.step == step.step;
  });
  if (command == run.phases.end()) return std::nullopt;
  Settling settling;
  settling.commanded_rad_s = command->speed_rad_s;
  const double zero_s = seconds(command->time_ns);
  return read_into(settling, run, cell, step, {zero_s, -kBefore_s, step.window_end_s - zero_s, kBin_s});
}

std::optional<Settling> whole_run(const results::RunRecording& run, const results::LoadCellColumns& cell,
                                  const results::StepMean& step) {
  constexpr double kBins = 800;
  if (run.phases.empty() || cell.datagrams.empty()) return std::nullopt;
  const double begin_s = seconds(run.phases.front().time_ns),
               lasts_s = seconds(cell.datagrams.back().arrival_ns) - begin_s;
  return read_into({}, run, cell, step, {begin_s, 0, lasts_s, lasts_s / kBins});
}

RawSamples read_raw_samples(const Identification& identification, std::vector<RunProvenance> runs,
                            const std::filesystem::path& folder) {
  std::vector<results::StepMean> top;
  std::map<double, std::size_t> repetitions;
  for (const results::StepMean& step : identification.selection.used) {
    if (!same_level(level(step), identification.at_speed_rad_s)) continue;
    top.push_back(step);
    ++repetitions[step.occlusion_deg];
  }
  std::map<double, std::vector<double>> by_angle;
  std::size_t found = 0;
  std::optional<Settling> settling, whole;
  results::LoadCellColumns cell;
  std::map<std::string, results::RunDigests> journal;
  if (!runs.empty()) journal = results::digests_beside(folder / runs.front().file);
  for (RunProvenance& run : runs) {
    const std::filesystem::path path = folder / run.file;
    std::error_code unknown;
    if (!std::filesystem::exists(path, unknown)) continue;
    const std::string name = path.filename().string();
    const bool fitted_from_it = journal.contains(name) && journal[name].sha256 == run.sha256;
    const std::map<std::string, results::RunDigests> digests{
        {name, fitted_from_it ? journal[name] : results::RunDigests{run.sha256, ""}}};
    const results::RunRecording recording = results::read_unchanged_run(path, digests, cell);
    run.account = recording.account;
    run.outcome = recording.outcome == results::Outcome::complete ? "complete" : "aborted: " + recording.outcome_reason;
    run.events = event_lines(recording);
    for (const results::StepMean& step : top) {
      if (!is_run_of(run, step)) continue;
      if (!settling) {
        settling = settling_of(recording, cell, step);
        if (settling) whole = whole_run(recording, cell, step);
        for (auto* shown : {&settling, &whole})
          if (*shown) (*shown)->run = name;
      }
      const auto samples = thrust_samples(recording, cell, step, kSamplesPerAngle / repetitions[step.occlusion_deg]);
      auto& all = by_angle[step.occlusion_deg];
      all.insert(all.end(), samples.begin(), samples.end());
      found += samples.empty() ? 0 : 1;
    }
  }
  RawSamples result{{}, std::move(runs), std::move(settling), std::move(whole)};
  const double nominal = mean(by_angle[0]);
  if (found < top.size() || !(nominal > 0)) return result;
  for (auto& [phi_deg, samples] : by_angle) {
    for (double& sample : samples) sample *= 100 / nominal;
    result.shares.push_back({phi_deg, std::move(samples)});
  }
  return result;
}

}  // namespace kphi::fit
