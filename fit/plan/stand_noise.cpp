#include "fit/plan/stand_noise.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <variant>

#include "base/csv.hpp"
#include "base/error.hpp"
#include "base/statistics.hpp"
#include "fit/plan/memory.hpp"
#include "fit/plan/run_differences.hpp"
#include "results/reduction/run_scatter.hpp"
#include "results/reduction/run_zero.hpp"

namespace kphi::fit {
namespace {

using results::StepMean;

struct Entry {
  const char* name;
  std::variant<double StandNoise::*, std::optional<double> StandNoise::*> member;
};

const std::array<Entry, 18> kEntries{{{"noise-n", &StandNoise::noise_n},
                                      {"noise-share", &StandNoise::noise_share},
                                      {"slow-n", &StandNoise::slow_n},
                                      {"slow-share", &StandNoise::slow_share},
                                      {"memory-s", &StandNoise::memory_s},
                                      {"slow-memory-s", &StandNoise::slow_memory_s},
                                      {"settle-s", &StandNoise::settle_s},
                                      {"zero-n", &StandNoise::zero_n},
                                      {"zero-walk-n", &StandNoise::zero_walk_n},
                                      {"runs", &StandNoise::runs},
                                      {"runs-n", &StandNoise::runs_n},
                                      {"mounting", &StandNoise::mounting},
                                      {"campaigns", &StandNoise::campaigns},
                                      {"model", &StandNoise::model},
                                      {"bend", &StandNoise::bend},
                                      {"k-t", &StandNoise::K_T},
                                      {"intercept", &StandNoise::intercept},
                                      {"slope-per-deg", &StandNoise::slope_per_deg}}};

/// a² + (b T)² through two groups of steps, slow and fast.
struct Variance {
  double constant = 0, share = 0;
};

struct Sample {
  double thrust_n = 0;
  double scatter = 0;  ///< variance between the repetitions of a step, N²
  double within = 0;   ///< variance of its mean by the step's own samples, over 1 s, N²; NaN: unknown
  double window_s = 0;
};

template <class Value>
Variance variance_of(const std::vector<Sample>& sorted, Value&& value) {
  const std::size_t half = sorted.size() / 2;
  if (half == 0) return {};
  std::array<double, 2> mean{}, squares{};
  for (std::size_t i = 0; i < sorted.size(); ++i) {
    const std::size_t group = i < half ? 0 : 1;
    const double n = static_cast<double>(group == 0 ? half : sorted.size() - half);
    mean.at(group) += value(sorted[i]) / n;
    squares.at(group) += sorted[i].thrust_n * sorted[i].thrust_n / n;
  }
  const double share = std::max(0.0, (mean[1] - mean[0]) / (squares[1] - squares[0]));
  const double constant = mean[0] - share * squares[0];
  if (constant >= 0) return {constant, share};
  return {0, mean[1] / squares[1]};
}

double mean_of(std::span<const StepMean> steps, double (*value)(const StepMean&)) {
  double sum = 0, n = 0;
  for (const StepMean& step : steps) {
    const double one = value(step);
    if (std::isfinite(one)) sum += one, ++n;
  }
  return n > 0 ? sum / n : std::numeric_limits<double>::quiet_NaN();
}

double window_of(const StepMean& step) { return step.window_end_s - step.window_begin_s; }

/// Correlation time that makes samples worth so few independent ones, s.
double memory_of(const StepMean& step) {
  return step.thrust_samples > 0 ? 0.5 * window_of(step) / step.thrust_n_eff : std::numeric_limits<double>::quiet_NaN();
}

/// Variance of the mean by the step's own samples, without that of its zero.
double within_of(const StepMean& step) {
  const double zero = std::isfinite(step.zero_u_n) ? step.zero_u_n : 0;
  return std::max(0.0, step.thrust_u_n * step.thrust_u_n - zero * zero);
}

/// What is known of the noise of all steps.
struct Samples {
  std::vector<Sample> steps;
  double neighbours_n2 = 0, weight = 0;  ///< covariance of neighbouring steps

  /// Scatter of the steps of one occlusion between its repetitions, less that of a zero that moves by `moved_n` in a
  /// run.
  void add(const OcclusionCoefficient& row, double memory_s, double moved_n) {
    const RunDifferences found = run_differences(row.measured);
    for (const SharedStep& step : found.steps) {
      Sample sample{.thrust_n = step.thrust_n, .scatter = step.noise_n2 - moved_n * moved_n * step.of_wander};
      const double n = static_cast<double>(step.of_runs.size());
      for (const StepMean* one : step.of_runs) {
        sample.window_s += window_of(*one) / n;
        sample.within += within_of(*one) * averaged(1, memory_s) / averaged(window_of(*one), memory_s) / n;
      }
      steps.push_back(sample);
    }
    const double freedom = static_cast<double>(found.steps.size());
    neighbours_n2 += freedom * (found.neighbours_n2 - moved_n * moved_n * found.neighbours_of_wander);
    weight += freedom;
  }
};

double median_or_zero(std::vector<double> values) { return values.empty() ? 0 : upper_median(std::move(values)); }

/// `moved_n`: how far the zero wanders in a run; 0 while that is not known yet.
void take_steps(const Fitted& fitted, double moved_n, StandNoise& noise) {
  const Identification& one = fitted.identification;
  const std::vector<StepMean>& steps = one.selection.used;
  const double memory = mean_of(steps, memory_of);
  noise.memory_s = std::isfinite(memory) ? memory : 0;
  const double settled = mean_of(steps, [](const StepMean& step) { return step.discarded_s; });
  if (std::isfinite(settled)) noise.settle_s = settled;
  Samples found;
  for (const OcclusionCoefficient& row : one.table) found.add(row, noise.memory_s, moved_n);
  std::vector<Sample>& samples = found.steps;
  if (samples.size() < 4)
    throw ConfigurationError("a pilot needs two repetitions of an occlusion or more: only they show the stand's noise");
  std::ranges::sort(samples, {}, &Sample::thrust_n);
  const bool known = std::ranges::all_of(samples, [](const Sample& each) { return std::isfinite(each.within); });
  const Variance within = known ? variance_of(samples, [](const Sample& each) { return each.within; }) : Variance{};
  // What the samples of a step promise it to scatter, and what it scatters beyond that.
  const Variance beyond = variance_of(samples, [&](const Sample& each) {
    const double longer = averaged(each.window_s, noise.memory_s) / averaged(1, noise.memory_s);
    return each.scatter - (known ? each.within * longer : 0);
  });
  noise.noise_n = std::sqrt(within.constant);
  noise.noise_share = std::sqrt(within.share);
  double window = 0, slow = 0;
  for (const Sample& each : samples) {
    const double n = static_cast<double>(samples.size());
    window += each.window_s / n;
    slow += (std::max(0.0, beyond.constant) + beyond.share * each.thrust_n * each.thrust_n) / n;
  }
  const double apart = noise.settle_s + window;
  if (slow > 0) noise.slow_memory_s = memory_of_neighbours(found.neighbours_n2 / found.weight / slow, window, apart);
  const double to_a_second = averaged(1, noise.slow_memory_s) / averaged(window, noise.slow_memory_s);
  noise.slow_n = std::sqrt(std::max(0.0, beyond.constant) * to_a_second);
  noise.slow_share = std::sqrt(std::max(0.0, beyond.share) * to_a_second);
}

/// Length of the runs of a fit, from the first window to the last, minutes.
double minutes_of(const Identification& one) {
  std::map<std::pair<double, int>, std::pair<double, double>> runs;  // begin and end, s
  for (const StepMean& step : one.selection.used) {
    auto& [begin, end] =
        runs.try_emplace({step.occlusion_deg, step.repetition}, step.window_begin_s, step.window_end_s).first->second;
    begin = std::min(begin, step.window_begin_s);
    end = std::max(end, step.window_end_s);
  }
  double minutes = 0;
  for (const auto& [key, span] : runs) minutes += (span.second - span.first) / 60 / static_cast<double>(runs.size());
  return minutes;
}

/// Noise of steps and zeros, and the wander of the zeros: each tells a part of what the others scatter by.
void take_noise(const PilotCampaign& pilot, StandNoise& noise) {
  constexpr int kRounds = 3;
  const Identification& one = pilot.fitted.identification;
  const double minutes = minutes_of(one), zero_s = pilot.zero_s > 0 ? pilot.zero_s : 1;
  const double zero = mean_of(one.selection.used, [](const StepMean& step) { return step.zero_u_n; });
  noise.zero_n = std::isfinite(zero) ? zero * std::sqrt(zero_s) : 0;
  for (int i = 0; i < kRounds; ++i) {
    take_steps(pilot.fitted, noise.zero_walk_n * std::sqrt(minutes), noise);
    const double moved = one.repeatability.zero_movement.value;
    const double noisy = 2 * noise.zero_u_n(zero_s);  // each zero is √2 less certain than the mean of both
    if (minutes > 0) noise.zero_walk_n = std::sqrt(std::max(0.0, moved * moved - noisy * noisy) / minutes);
  }
}

/// The k of a pilot's runs against those of their occlusion, with what noise and zeros explain of them: the zeros as
/// uncertain as this noise makes them, which their own samples need not show.
void add_shares(const PilotCampaign& pilot, const StandNoise& noise,
                std::vector<std::vector<results::RunShare>>& shares) {
  const Identification& one = pilot.fitted.identification;
  const double zero_s = pilot.zero_s > 0 ? pilot.zero_s : 1;
  for (std::size_t i = 0; i < one.table.size(); ++i) {
    const AngleScatter& angle = one.repeatability.angles[i];
    std::map<int, results::SharedZero> zeros;
    std::map<int, std::pair<double, double>> spans;
    for (const StepMean& step : one.table[i].measured) {
      auto& [begin, end] = spans.try_emplace(step.repetition, step.window_begin_s, step.window_end_s).first->second;
      begin = std::min(begin, step.window_begin_s);
      end = std::max(end, step.window_end_s);
    }
    for (const StepMean& step : one.table[i].measured) {
      const auto& [begin, end] = spans.at(step.repetition);
      const double share = end > begin ? (step.window_end_s - begin) / (end - begin) : 0.5;
      zeros[step.repetition].add(std::sqrt(2.0) * noise.zero_u_n(zero_s) * std::hypot(1 - share, share),
                                 step.window_begin_s, step.window_end_s, step.speed_rad_s * step.speed_rad_s);
    }
    shares.emplace_back();
    for (const RunSums& run : angle.runs) {
      const auto& [begin, end] = spans.at(run.repetition);
      const double zero =
          zeros.at(run.repetition).u_n(noise.zero_walk_n * std::sqrt((end - begin) / 60)) * angle.zero_sensitivity;
      shares.back().push_back({run.k() / angle.k, (angle.within.variance + zero * zero) / (angle.k * angle.k),
                               angle.zero_sensitivity / angle.k});
    }
  }
}

StandNoise noise_of(const PilotCampaign& pilot) {
  const auto& [identification, analysis] = pilot.fitted;
  StandNoise noise;
  take_noise(pilot, noise);
  // A test that falls by chance at one φ is not how the propeller is.
  std::vector<double> model;
  for (std::size_t i = 0; i < analysis.speed.size(); ++i)
    model.push_back(analysis.speed[i].inadequacy / std::abs(identification.table[i].k));
  noise.model = median_or_zero(std::move(model));
  noise.K_T = identification.thrust_coefficient().value;
  if (identification.alone()) return noise;
  const CurveFit line = fit_curve(points_of(identification.table), {});
  noise.intercept = line.value("intercept") / noise.K_T;
  noise.slope_per_deg = line.value("slope_per_deg") / noise.K_T;
  const BudgetRow& misfit = analysis.line.slope.rows.back();
  if (misfit.known()) noise.bend = misfit.u / noise.K_T;
  return noise;
}

double rms_of_stands(std::span<const StandNoise> all, double StandNoise::*member) {
  double squares = 0;
  for (const StandNoise& one : all) squares += one.*member * one.*member / static_cast<double>(all.size());
  return std::sqrt(squares);
}

double mean_of_stands(std::span<const StandNoise> all, double StandNoise::*member) {
  double sum = 0;
  for (const StandNoise& one : all) sum += one.*member / static_cast<double>(all.size());
  return sum;
}

/// Scatter from run to run, of all pilots together.
void take_runs(std::span<const PilotCampaign> pilots, StandNoise& noise) {
  std::vector<std::vector<results::RunShare>> shares;
  for (const PilotCampaign& pilot : pilots) add_shares(pilot, noise, shares);
  const results::RunScatter scatter = results::scatter_between(shares);
  noise.runs_freedom = scatter.share_freedom;
  noise.runs_n = scatter.zero_n;
  if (pilots.front().mounted_once) {
    noise.runs = scatter.share;
    const Repeatability& first = pilots.front().fitted.identification.repeatability;
    if (!first.mounting_assumed) noise.mounting = first.mounting;
  } else {
    noise.mounting = scatter.share;  // with what a run adds: the two cannot be told apart
  }
}

}  // namespace

double StandNoise::step_n(double thrust_n, double window_s) const {
  const double shrinks = averaged(window_s, memory_s) / averaged(1, memory_s);
  const double slow = averaged(window_s, slow_memory_s) / averaged(1, slow_memory_s);
  return std::sqrt((noise_n * noise_n + std::pow(noise_share * thrust_n, 2)) * shrinks +
                   (slow_n * slow_n + std::pow(slow_share * thrust_n, 2)) * slow);
}

double StandNoise::zero_u_n(double zero_s) const {
  const double slow = 0.5 * slow_n * slow_n * averaged(zero_s, slow_memory_s) / averaged(1, slow_memory_s);
  return std::sqrt(zero_n * zero_n / zero_s + slow);
}

double StandNoise::k_at(double phi_deg) const {
  return phi_deg == 0 ? K_T : K_T * (intercept + slope_per_deg * phi_deg);
}

StandNoise noise_of(std::span<const PilotCampaign> pilots) {
  if (std::ranges::any_of(pilots,
                          [&](const PilotCampaign& one) { return one.mounted_once != pilots.front().mounted_once; }))
    throw ConfigurationError("some pilots were remounted for each repetition, others not; name those of one kind");
  std::vector<StandNoise> all;
  for (const PilotCampaign& pilot : pilots) all.push_back(noise_of(pilot));
  StandNoise noise = all.front();
  for (double StandNoise::*member : {&StandNoise::noise_n, &StandNoise::noise_share, &StandNoise::slow_n,
                                     &StandNoise::slow_share, &StandNoise::zero_n, &StandNoise::zero_walk_n})
    noise.*member = rms_of_stands(all, member);
  for (double StandNoise::*member : {&StandNoise::model, &StandNoise::bend}) {
    std::vector<double> values;
    for (const StandNoise& one : all) values.push_back(one.*member);
    noise.*member = median_or_zero(std::move(values));
  }
  for (double StandNoise::*member : {&StandNoise::memory_s, &StandNoise::slow_memory_s, &StandNoise::settle_s,
                                     &StandNoise::K_T, &StandNoise::intercept, &StandNoise::slope_per_deg})
    noise.*member = mean_of_stands(all, member);
  take_runs(pilots, noise);
  return noise;
}

void state(StandNoise& noise, const std::string& text) {
  const std::size_t equals = text.find('=');
  const std::string name = text.substr(0, equals);
  const double value = equals == std::string::npos
                           ? std::numeric_limits<double>::quiet_NaN()
                           : parse_number(text.substr(equals + 1)).value_or(std::numeric_limits<double>::quiet_NaN());
  const bool may_be_negative = name == "slope-per-deg";
  for (const Entry& entry : kEntries) {
    if (name != entry.name || !std::isfinite(value) || (!may_be_negative && value < 0)) continue;
    std::visit([&](auto member) { noise.*member = value; }, entry.member);
    if (name == "runs") noise.runs_freedom = std::numeric_limits<double>::infinity();
    return;
  }
  std::string names;
  for (const Entry& entry : kEntries) names += fmt::format("{}{}", names.empty() ? "" : ", ", entry.name);
  throw ConfigurationError(fmt::format(
      "--stand {}: expected NAME=VALUE, NAME one of {}; VALUE 0 or above, in N, s, or a share (0.003 is 0.3 %)", text,
      names));
}

std::vector<std::pair<std::string, double>> known_noise(const StandNoise& noise) {
  std::vector<std::pair<std::string, double>> known;
  for (const Entry& entry : kEntries) {
    if (const auto* plain = std::get_if<double StandNoise::*>(&entry.member))
      known.emplace_back(entry.name, noise.**plain);
    else if (const auto& maybe = noise.*std::get<1>(entry.member))
      known.emplace_back(entry.name, *maybe);
  }
  return known;
}

}  // namespace kphi::fit
