#include "fit/step_selection.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace kphi::fit {
namespace {

using results::Doubt;

struct DoubtPolicy {
  Doubt doubt;
  const char* words;
  bool spoils;
};

constexpr std::array<DoubtPolicy, 32> kPolicy{{
    {Doubt::speed_not_reached, "commanded speed not reached", true},
    {Doubt::speed_unsteady, "speed never settled", true},
    {Doubt::saturated, "load cell saturated", true},
    {Doubt::lost_samples, "samples lost", false},
    {Doubt::derated, "motor derated", true},
    {Doubt::few_samples, "too few samples", true},
    {Doubt::bad_status, "load cell reported an error", true},
    {Doubt::stream_restarted, "stream began anew", false},
    {Doubt::rebooted, "load cell's box started anew since the zero", true},
    {Doubt::stalled, "load cell repeated its measurement", true},
    {Doubt::silent, "load cell fell silent", true},
    {Doubt::box_trouble, "load cell's box saw its communication fail", false},
    {Doubt::stolen, "another client took the stream", true},
    {Doubt::configuration_changed, "load cell's box was set otherwise", true},
    {Doubt::zero_drifted, "load cell's zero drifted during the run", true},
    {Doubt::zero_noisy, "load cell was not at rest at a zero", true},
    {Doubt::drive_saturated, "motor drive saturated", true},
    {Doubt::motor_fault, "motor module reported a fault", true},
    {Doubt::supply_out_of_band, "supply voltage off", false},
    {Doubt::coil_hot, "motor coil hot", false},
    {Doubt::motor_reset, "motor module restarted", true},
    {Doubt::motor_lost, "motor module lost", true},
    {Doubt::slow_round_trip, "motor readings blurred in time", false},
    {Doubt::supply_limited, "supply limited the current", true},
    {Doubt::supply_off, "supply was off", true},
    {Doubt::supply_sag, "supply sagged", false},
    {Doubt::supply_rise, "motor fed back into the supply", false},
    {Doubt::unsettled, "thrust never settled", true},
    {Doubt::drifted, "thrust drifted within the step", true},
    {Doubt::lag_unknown, "lag of the thrust unknown", false},
    {Doubt::frozen, "load cell repeated one value", true},
    {Doubt::speed_glitch, "impossible speeds left out", false},
}};

bool has(std::uint32_t doubts, Doubt doubt) { return (doubts & static_cast<std::uint32_t>(doubt)) != 0; }

bool spoiled(std::uint32_t doubts) {
  return std::any_of(kPolicy.begin(), kPolicy.end(),
                     [&](const DoubtPolicy& policy) { return policy.spoils && has(doubts, policy.doubt); });
}

}  // namespace

double level(const results::StepMean& step) {
  return step.commanded_speed_rad_s > 0 ? step.commanded_speed_rad_s : step.speed_rad_s;
}

std::string doubts_in_words(std::uint32_t doubts) {
  std::string words;
  for (const DoubtPolicy& policy : kPolicy) {
    if (!has(doubts, policy.doubt)) continue;
    if (!words.empty()) words += ", ";
    words += policy.words;
  }
  return words;
}

StepSelection select_steps(std::span<const results::StepMean> steps, const SpeedRange& range) {
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
    const bool left_out = !measured || spoiled(step.doubts);
    if (left_out || step.doubts != 0) {
      const std::string words = doubts_in_words(step.doubts);
      const char* missing = measured ? "" : (words.empty() ? "nothing measured" : ", nothing measured");
      selection.doubtful.push_back({step, words + missing, left_out});
    }
    if (!left_out) selection.used.push_back(step);
  }
  return selection;
}

}  // namespace kphi::fit
