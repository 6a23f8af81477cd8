#include "fit/model/step_selection.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "base/csv.hpp"
#include "base/error.hpp"
#include "results/step_mean.hpp"

namespace kphi::fit {
namespace {

using results::QualityFlag;

struct FlagWords {
  QualityFlag flag;
  const char* words;
};

constexpr std::array<FlagWords, 32> kWords{{
    {QualityFlag::speed_not_reached, "commanded speed not reached"},
    {QualityFlag::speed_unsteady, "speed never settled"},
    {QualityFlag::saturated, "load cell saturated"},
    {QualityFlag::lost_samples, "samples lost"},
    {QualityFlag::derated, "motor derated"},
    {QualityFlag::few_samples, "too few samples"},
    {QualityFlag::bad_status, "load cell reported an error"},
    {QualityFlag::stream_restarted, "stream restarted"},
    {QualityFlag::rebooted, "load cell's box rebooted since the zero"},
    {QualityFlag::stalled, "load cell repeated its measurement"},
    {QualityFlag::silent, "load cell fell silent"},
    {QualityFlag::box_trouble, "load cell's box reported failed communication"},
    {QualityFlag::taken_over, "another client took the stream"},
    {QualityFlag::configuration_changed, "load cell's box settings changed"},
    {QualityFlag::zero_drifted, "load cell's zero drifted during the run"},
    {QualityFlag::zero_noisy, "load cell was not at rest at a zero"},
    {QualityFlag::drive_saturated, "motor drive saturated"},
    {QualityFlag::motor_fault, "motor module reported a fault"},
    {QualityFlag::supply_out_of_band, "supply voltage off"},
    {QualityFlag::coil_hot, "motor coil hot"},
    {QualityFlag::motor_reset, "motor module restarted"},
    {QualityFlag::motor_lost, "motor module lost"},
    {QualityFlag::slow_round_trip, "motor readings blurred in time"},
    {QualityFlag::supply_limited, "supply limited the current"},
    {QualityFlag::supply_off, "supply was off"},
    {QualityFlag::supply_sag, "supply sagged"},
    {QualityFlag::supply_rise, "motor fed back into the supply"},
    {QualityFlag::unsettled, "thrust never settled"},
    {QualityFlag::drifted, "thrust drifted within the step"},
    {QualityFlag::lag_unknown, "lag of the thrust unknown"},
    {QualityFlag::frozen, "load cell or speed repeated one value"},
    {QualityFlag::speed_glitch, "impossible speeds skipped"},
}};

bool has(std::uint32_t flags, QualityFlag flag) { return (flags & static_cast<std::uint32_t>(flag)) != 0; }

/// s/√n. Neighbouring samples are correlated, so this is a lower limit; for weights only its ratio between steps
/// matters. 0: unknown.
double mean_uncertainty(double deviation, std::uint64_t n) {
  return n > 0 && deviation > 0 ? deviation / std::sqrt(static_cast<double>(n)) : 0;
}

bool spoiled(std::uint32_t flags) { return (flags & ~results::kHarmlessFlags) != 0; }

}  // namespace

double level(const results::StepMean& step) {
  return step.commanded_speed_rad_s > 0 ? step.commanded_speed_rad_s : step.speed_rad_s;
}

std::string flags_in_words(std::uint32_t flags) {
  std::string words;
  for (const FlagWords& one : kWords) {
    if (!has(flags, one.flag)) continue;
    if (!words.empty()) words += ", ";
    words += one.words;
  }
  return words;
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
      std::any_of(steps.begin(), steps.end(), [](const results::StepMean& step) { return step.repetition > 0; });
  StepSelection selection;
  for (const results::StepMean& step : steps) {
    if (single_repetitions && step.repetition == 0) continue;
    const bool outside = level(step) < range.min_rad_s * (1 - kSlack) || level(step) > range.max_rad_s * (1 + kSlack);
    if (outside) {
      ++selection.outside_range;
      continue;
    }
    const bool measured = std::isfinite(step.thrust_n) && std::isfinite(step.speed_rad_s);
    const auto by_hand = std::find_if(left_out_runs.begin(), left_out_runs.end(), [&](const LeftOutRun& run) {
      return run.phi_deg == step.occlusion_deg && run.repetition == step.repetition;
    });
    const bool chosen = by_hand != left_out_runs.end();
    const bool left_out = chosen || !measured || spoiled(step.quality_flags);
    if (left_out || step.quality_flags != 0) {
      std::string words = flags_in_words(step.quality_flags);
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
    return std::all_of(steps.begin(), steps.end(),
                       [&](const auto& step) { return std::isfinite(step.*u) && step.*u > 0; });
  };
  const bool thrust_told = all_tell(&results::StepMean::thrust_u_n);
  const bool speed_told = all_tell(&results::StepMean::speed_u_rad_s);
  std::vector<Point> points;
  for (const results::StepMean& step : steps) {
    points.push_back({step.speed_rad_s, step.thrust_n, 1,
                      thrust_told ? step.thrust_u_n : mean_uncertainty(step.thrust_sd_n, step.thrust_samples),
                      speed_told ? step.speed_u_rad_s : mean_uncertainty(step.speed_sd_rad_s, step.speed_n)});
  }
  return points;
}

}  // namespace kphi::fit
