#include "fit/model/step_selection.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/csv.hpp"
#include "base/error.hpp"
#include "results/steps_csv.hpp"

namespace kphi::fit {
namespace {

/// s/√n. Neighbouring samples are correlated, so this is a lower limit; for weights only its ratio between steps
/// matters. 0: unknown.
double mean_uncertainty(double deviation, std::uint64_t n) {
  return n > 0 && deviation > 0 ? deviation / std::sqrt(static_cast<double>(n)) : 0;
}

}  // namespace

double level(const results::StepMean& step) {
  return step.commanded_speed_rad_s > 0 ? step.commanded_speed_rad_s : step.speed_rad_s;
}

LeftOutRun parse_left_out_run(const std::string& text) {
  const std::size_t first = text.find(':');
  const std::size_t second = first == std::string::npos ? first : text.find(':', first + 1);
  const auto phi = parse_number(text.substr(0, first));
  const auto repetition =
      second == std::string::npos ? std::nullopt : parse_number(text.substr(first + 1, second - first - 1));
  const std::string cause = second == std::string::npos ? "" : text.substr(second + 1);
  if (!phi || !repetition || *repetition < 1 || *repetition != std::floor(*repetition) ||
      cause.find_first_not_of(' ') == std::string::npos) {
    throw ConfigurationError(
        fmt::format("--leave-out {}: expected PHI:REPETITION:CAUSE, such as '90:2:plate slipped'", text));
  }
  return {*phi, static_cast<int>(*repetition), cause};
}

StepSelection select_steps(std::span<const results::StepMean> steps, const SpeedRange& range,
                           std::span<const LeftOutRun> left_out_runs) {
  // Limits are typed in RPM and levels come from files: a level at the limit must not drop out by rounding.
  constexpr double kSlack = 1e-9;
  const bool single_repetitions =
      std::ranges::any_of(steps, [](const results::StepMean& step) { return step.repetition > 0; });
  StepSelection selection;
  for (const results::StepMean& step : steps) {
    if (single_repetitions && step.repetition == 0) continue;
    const bool outside = level(step) < range.min_rad_s * (1 - kSlack) || level(step) > range.max_rad_s * (1 + kSlack);
    if (outside) {
      ++selection.outside_range;
      continue;
    }
    const bool measured = std::isfinite(step.thrust_n) && std::isfinite(step.speed_rad_s);
    const auto by_hand = std::ranges::find_if(left_out_runs, [&](const LeftOutRun& run) {
      return run.phi_deg == step.occlusion_deg && run.repetition == step.repetition;
    });
    const bool chosen = by_hand != left_out_runs.end();
    const bool left_out = chosen || !measured || (step.quality_flags & ~results::kHarmlessFlags) != 0;
    if (left_out || step.quality_flags != 0) {
      std::string words = results::quality_flags_in_words(step.quality_flags);
      if (!measured) words += words.empty() ? "not measured" : ", not measured";
      if (chosen) words += (words.empty() ? "" : ", ") + ("by hand: " + by_hand->cause);
      selection.flagged.push_back({step, words, left_out});
    }
    if (!left_out) selection.used.push_back(step);
  }
  return selection;
}

std::vector<Point> points_of(std::span<const results::StepMean> steps) {
  const auto all_tell = [&](double results::StepMean::*u) {
    return std::ranges::all_of(steps, [&](const auto& step) { return std::isfinite(step.*u) && step.*u > 0; });
  };
  const bool thrust_told = all_tell(&results::StepMean::thrust_u_n);
  const bool speed_told = all_tell(&results::StepMean::speed_u_rad_s);
  std::vector<Point> points;
  for (const results::StepMean& step : steps) {
    const bool averages = step.repetition == 0 && step.repetitions_averaged > 0;
    points.push_back({step.speed_rad_s, step.thrust_n, averages ? step.repetitions_averaged : 1,
                      thrust_told ? step.thrust_u_n : mean_uncertainty(step.thrust_sd_n, step.thrust_samples),
                      speed_told ? step.speed_u_rad_s : mean_uncertainty(step.speed_sd_rad_s, step.speed_n)});
  }
  return points;
}

}  // namespace kphi::fit
