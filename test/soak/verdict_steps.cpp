#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "results/reduction/clock_map.hpp"
#include "results/reduction/zeros.hpp"
#include "results/steps_csv.hpp"
#include "test/soak/verdict_checks.hpp"

namespace kphi::soak {
namespace {

using namespace std::chrono_literals;
using results::QualityFlag;

constexpr double kTrueDensity = 1.225;  // kg/m³, of the simulated bench
constexpr Duration kMisplaced = 20ms;   ///< by the clock map and the delays of a wire
constexpr double kMistimed = 10e-6;     ///< s, a sample on a wire of constant delay
/// What short steps may say of themselves though nothing is wrong: three of them need not tell the lag, and a test of
/// significance errs at times.
constexpr auto kNeedNotTell = static_cast<std::uint32_t>(QualityFlag::lag_unknown);
constexpr auto kByChance =
    static_cast<std::uint32_t>(QualityFlag::unsettled) | static_cast<std::uint32_t>(QualityFlag::drifted);

struct Means {
  double speed = 0, thrust = 0;
  std::size_t n = 0;
};

Means true_means(const Story& story, double begin_s, double end_s) {
  Means means;
  for (const auto& moment : story.moments) {
    const double at = to_seconds(moment.at);
    if (at < begin_s || at > end_s) continue;
    means.speed += moment.speed_rad_s;
    means.thrust += moment.thrust_n;
    ++means.n;
  }
  if (means.n > 0) means.speed /= static_cast<double>(means.n), means.thrust /= static_cast<double>(means.n);
  return means;
}

std::string step_name(const FileOfRun& file, const results::StepMean& step) {
  return fmt::format("verdict: {} step {}", file.name(), step.step);
}

void check_truth(const Evidence& evidence, const FileOfRun& file, const results::StepMean& step, Lines& wrong) {
  const Means truth = true_means(evidence.story, step.window_begin_s, step.window_end_s);
  if (truth.n < 10) return;
  const double thrust = std::abs(truth.thrust);  // it may push
  const double allowed_thrust = 6 * step.thrust_u_n + results::tolerated_drift(thrust) + 0.003 * thrust;
  const double allowed_speed = 6 * step.speed_u_rad_s + 0.003 * truth.speed + 1;
  if (!(std::abs(step.thrust_n - truth.thrust) <= allowed_thrust))
    wrong.push_back(fmt::format("{}: {:.4f} N without a flag, in truth {:.4f} N (u {:.4f})", step_name(file, step),
                                step.thrust_n, truth.thrust, step.thrust_u_n));
  if (!(std::abs(step.speed_rad_s - truth.speed) <= allowed_speed))
    wrong.push_back(fmt::format("{}: {:.2f} rad/s without a flag, in truth {:.2f} rad/s (u {:.2f})",
                                step_name(file, step), step.speed_rad_s, truth.speed, step.speed_u_rad_s));
}

/// Samples that the box took well inside the window and sent, and that are not in the file.
void check_missing(const Evidence& evidence, const FileOfRun& file, const results::StepMean& step, Lines& wrong) {
  if ((step.quality_flags & static_cast<std::uint32_t>(QualityFlag::lost_samples)) != 0) return;
  const Instant begin = from_seconds(step.window_begin_s) + kMisplaced,
                end = from_seconds(step.window_end_s) - kMisplaced;
  const sim::WireTruth& wire = *evidence.wire;
  for (const auto& sent : wire.log) {
    if (sent.arrivals > 0 || sent.records == 0) continue;
    const Instant first = wire.sampled[sent.first_sample], last = wire.sampled[sent.first_sample + sent.records - 1];
    if (last < begin || first > end) continue;
    return wrong.push_back(
        fmt::format("{}: records are missing in its window, it does not say so", step_name(file, step)));
  }
}

/// The time of each sample in the file is when the box took it, but for the delay of a wire without faults.
void check_sample_times(const Evidence& evidence, const FileOfRun& file, Instant begin, Instant end, Lines& wrong) {
  const sim::WireTruth& wire = *evidence.wire;
  std::unordered_map<std::uint32_t, Instant> sampled;  // by ft_sequence
  for (std::size_t i = 0; i < wire.ft.size(); ++i)
    if (wire.sampled[i] >= begin && wire.sampled[i] <= end) sampled.emplace(wire.ft[i], wire.sampled[i]);
  const std::vector<Nanoseconds> times = results::sample_times(file.run);
  std::vector<double> late;
  for (std::size_t i = 0; i < times.size(); ++i) {
    const auto truth = sampled.find(file.run.load_cell[i].ft_sequence);
    if (truth != sampled.end()) late.push_back(to_seconds(Instant(times[i]) - truth->second));
  }
  if (late.empty()) return wrong.push_back("verdict: " + file.name() + " holds no sample that the box took");
  const auto [least, most] = std::ranges::minmax(late);
  if (most - least > kMistimed || std::abs(least) > to_seconds(kMisplaced))
    wrong.push_back(fmt::format("verdict: {}: samples are timed {:.1f} to {:.1f} µs after they were taken", file.name(),
                                1e6 * least, 1e6 * most));
}

/// The module's supply truly was outside of what the campaign tolerates, or at its edge, around the step's window.
bool supply_was_out_of_band(const Evidence& evidence, const results::StepMean& step) {
  constexpr double kBand = 0.095;
  const double set = evidence.campaign.supply.value();
  const auto& moments = evidence.story.moments;
  return std::any_of(moments.begin(), moments.end(), [&](const Story::Moment& moment) {
    const double at = to_seconds(moment.at);
    return at > step.window_begin_s - 0.1 && at < step.window_end_s && std::abs(moment.supply_v / set - 1) > kBand;
  });
}

/// The box itself said, or its numbers did, that what it measured in the middle of the window is worth nothing.
bool box_was_disturbed(const Reaches& reaches, const results::StepMean& step) {
  using K = sim::FaultKind;
  const Instant begin = from_seconds(step.window_begin_s) + 3 * kMisplaced;
  const Instant end = from_seconds(step.window_end_s) - 3 * kMisplaced;
  return std::any_of(reaches.cell().begin(), reaches.cell().end(), [&](const sim::Fault& fault) {
    const bool disturbs = fault.kind == K::stall || fault.kind == K::saturation || fault.kind == K::status;
    return disturbs && std::min(fault.end(), end) - std::max(fault.at, begin) > kMisplaced;
  });
}

/// Three short steps can tell a lag that is not there; its windows are then misplaced, and say so.
bool lag_is_wrong(const results::StepMean& step) { return std::abs(step.lag_s) > 0.1; }

/// The rotor truly came to its speed so late that hardly anything of the step was left: a large step down.
bool speed_came_late(const Evidence& evidence, const results::StepMean& step) {
  const Means truth = true_means(evidence.story, step.window_end_s - 0.15, step.window_end_s - 0.10);
  return std::abs(truth.speed - step.commanded_speed_rad_s) > 0.008 * step.commanded_speed_rad_s;
}

std::string names(const std::vector<results::StepMean>& steps) {
  std::string all;
  for (const auto& step : steps)
    all += (all.empty() ? "" : ", ") + ("\"" + results::quality_flag_names(step.quality_flags) + "\"");
  return all;
}

void check_run(const Evidence& evidence, const FileOfRun& file, const Reaches& reaches, Verdict& verdict) {
  const auto& run = file.run;
  if (run.outcome != results::Outcome::complete || run.phases.empty()) return;
  const Instant begin(run.phases.front().time_ns), end(run.phases.back().time_ns);
  const bool clean = !reaches.any(begin - 200ms, end);
  std::uint32_t flags = 0;
  for (const auto& step : file.steps) {
    std::uint32_t unexplained = step.quality_flags;
    if (supply_was_out_of_band(evidence, step))
      unexplained &= ~static_cast<std::uint32_t>(QualityFlag::supply_out_of_band);
    if (!lag_is_wrong(step) && !speed_came_late(evidence, step)) flags |= unexplained;
    if ((step.quality_flags & ~kNeedNotTell) == 0) check_truth(evidence, file, step, verdict.wrong);
    check_missing(evidence, file, step, verdict.wrong);
    if (box_was_disturbed(reaches, step) && (step.quality_flags & ~(kNeedNotTell | kByChance)) == 0)
      verdict.wrong.push_back(step_name(file, step) + ": the box was disturbed in its window, it does not say so");
    verdict.clean_steps += clean;
    verdict.clean_steps_flagged += clean && ((step.quality_flags & kByChance) != 0 || lag_is_wrong(step));
  }
  if (file.steps.size() != static_cast<std::size_t>(evidence.campaign.profile.steps))
    verdict.wrong.push_back(fmt::format("verdict: {} has {} steps", file.name(), file.steps.size()));
  if (clean) check_sample_times(evidence, file, begin, end, verdict.wrong);
  if (clean && (flags & ~(kNeedNotTell | kByChance)) != 0)
    verdict.wrong.push_back(
        fmt::format("verdict: {} is out of reach of every fault, its flags are {}", file.name(), names(file.steps)));
}

/// With a sensor every run knows its air: no fault here lasts until the newest reading is too old.
void check_air(const Evidence& evidence, const FileOfRun& file, Lines& wrong) {
  const double density = file.run.header.air_density_kg_m3;
  const bool right =
      evidence.config.ambient.sensor.empty() ? density == 0 : std::abs(density / kTrueDensity - 1) < 0.005;
  if (!right) wrong.push_back(fmt::format("verdict: {}: air of {} kg/m³", file.name(), density));
}

}  // namespace

void check_steps_of_runs(const Evidence& evidence, const Reaches& reaches, Verdict& verdict) {
  if (evidence.wire == nullptr) return;
  for (const FileOfRun& file : evidence.files) {
    if (file.inherited) continue;
    check_run(evidence, file, reaches, verdict);
    check_air(evidence, file, verdict.wrong);
  }
}

}  // namespace kphi::soak
