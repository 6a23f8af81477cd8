#include "fit/raw_samples.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "results/campaign_folder.hpp"
#include "results/run_reader.hpp"

namespace kphi::fit {
namespace {

constexpr std::size_t kSamplesPerAngle = 2000;

double mean(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return values.empty() ? 0 : sum / static_cast<double>(values.size());
}

std::vector<double> every_nth(const std::vector<double>& values, std::size_t most) {
  if (values.size() <= most) return values;
  std::vector<double> kept;
  for (std::size_t i = 0; i < most; ++i) kept.push_back(values[i * values.size() / most]);
  return kept;
}

bool is_run(const RunProvenance& run, const results::StepMean& step) {
  return std::filesystem::path(run.file).filename() ==
         results::run_file_name(step.propeller, step.occlusion_deg, step.repetition);
}

}  // namespace

std::vector<double> thrust_samples(const results::RunRecording& run, const results::StepMean& step, std::size_t most) {
  const double newtons = run.header.thrust_sign / run.header.load_cell.counts_per_newton;
  const auto axis = static_cast<std::size_t>(std::clamp(run.header.thrust_axis, 0, 2));
  std::vector<double> samples;
  for (const results::LoadCellRecord& record : run.load_cell) {
    const double time_s = 1e-9 * static_cast<double>(record.arrival_ns);
    if (time_s >= step.window_begin_s && time_s <= step.window_end_s) samples.push_back(record.counts[axis] * newtons);
  }
  const double shift = step.thrust_n - mean(samples);
  for (double& sample : samples) sample += shift;
  return every_nth(samples, most);
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
  for (RunProvenance& run : runs) {
    const std::filesystem::path path = folder / run.file;
    std::error_code unknown;
    if (!std::filesystem::exists(path, unknown)) continue;
    const results::RunRecording recording = results::read_run(path);
    run.account = recording.account;
    run.outcome = recording.outcome == results::Outcome::complete ? "complete" : "aborted: " + recording.outcome_reason;
    for (const results::StepMean& step : top) {
      if (!is_run(run, step)) continue;
      const auto samples = thrust_samples(recording, step, kSamplesPerAngle / repetitions[step.occlusion_deg]);
      auto& all = by_angle[step.occlusion_deg];
      all.insert(all.end(), samples.begin(), samples.end());
      found += samples.empty() ? 0 : 1;
    }
  }
  RawSamples result{{}, std::move(runs)};
  const double nominal = mean(by_angle[0]);
  if (found < top.size() || !(nominal > 0)) return result;
  for (auto& [phi_deg, samples] : by_angle) {
    for (double& sample : samples) sample *= 100 / nominal;
    result.shares.push_back({phi_deg, std::move(samples)});
  }
  return result;
}

}  // namespace kphi::fit
