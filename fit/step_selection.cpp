#include "fit/step_selection.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "fit/csv.hpp"
#include "profiles/configuration_error.hpp"
#include "results/harmless_doubts.hpp"

namespace kphi::fit {
namespace {

using results::Doubt;

struct DoubtWords {
  Doubt doubt;
  const char* words;
};

constexpr std::array<DoubtWords, 32> kWords{{
    {Doubt::speed_not_reached, "commanded speed not reached"},
    {Doubt::speed_unsteady, "speed never settled"},
    {Doubt::saturated, "load cell saturated"},
    {Doubt::lost_samples, "samples lost"},
    {Doubt::derated, "motor derated"},
    {Doubt::few_samples, "too few samples"},
    {Doubt::bad_status, "load cell reported an error"},
    {Doubt::stream_restarted, "stream began anew"},
    {Doubt::rebooted, "load cell's box started anew since the zero"},
    {Doubt::stalled, "load cell repeated its measurement"},
    {Doubt::silent, "load cell fell silent"},
    {Doubt::box_trouble, "load cell's box saw its communication fail"},
    {Doubt::stolen, "another client took the stream"},
    {Doubt::configuration_changed, "load cell's box was set otherwise"},
    {Doubt::zero_drifted, "load cell's zero drifted during the run"},
    {Doubt::zero_noisy, "load cell was not at rest at a zero"},
    {Doubt::drive_saturated, "motor drive saturated"},
    {Doubt::motor_fault, "motor module reported a fault"},
    {Doubt::supply_out_of_band, "supply voltage off"},
    {Doubt::coil_hot, "motor coil hot"},
    {Doubt::motor_reset, "motor module restarted"},
    {Doubt::motor_lost, "motor module lost"},
    {Doubt::slow_round_trip, "motor readings blurred in time"},
    {Doubt::supply_limited, "supply limited the current"},
    {Doubt::supply_off, "supply was off"},
    {Doubt::supply_sag, "supply sagged"},
    {Doubt::supply_rise, "motor fed back into the supply"},
    {Doubt::unsettled, "thrust never settled"},
    {Doubt::drifted, "thrust drifted within the step"},
    {Doubt::lag_unknown, "lag of the thrust unknown"},
    {Doubt::frozen, "load cell or speed repeated one value"},
    {Doubt::speed_glitch, "impossible speeds left out"},
}};

bool has(std::uint32_t doubts, Doubt doubt) { return (doubts & static_cast<std::uint32_t>(doubt)) != 0; }

bool spoiled(std::uint32_t doubts) { return (doubts & ~results::kHarmlessDoubts) != 0; }

}  // namespace

double level(const results::StepMean& step) {
  return step.commanded_speed_rad_s > 0 ? step.commanded_speed_rad_s : step.speed_rad_s;
}

std::string doubts_in_words(std::uint32_t doubts) {
  std::string words;
  for (const DoubtWords& one : kWords) {
    if (!has(doubts, one.doubt)) continue;
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
  // Limits are typed in RPM and levels come through files: a level that is the limit must not fall out by rounding.
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
    const bool left_out = chosen || !measured || spoiled(step.doubts);
    if (left_out || step.doubts != 0) {
      std::string words = doubts_in_words(step.doubts);
      if (!measured) words += words.empty() ? "nothing measured" : ", nothing measured";
      if (chosen) words += (words.empty() ? "" : ", ") + ("by hand: " + by_hand->cause);
      selection.doubtful.push_back({step, words, left_out});
    }
    if (!left_out) selection.used.push_back(step);
  }
  return selection;
}

}  // namespace kphi::fit
