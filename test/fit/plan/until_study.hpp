// Runs of simulated stands whose steps end by themselves, by the functions of the bench.
#pragma once

#include <memory>
#include <optional>

#include "daq/run/step_watch.hpp"
#include "profiles/run_certainty.hpp"
#include "test/fit/plan/plan_study.hpp"

namespace kphi::fit {

inline constexpr double kMost = 4, kDiscard = 0.2, kRise = 0.03;  // s; the thrust rises as the motor does
inline constexpr profiles::Until kUntil{0.002, Seconds(0.7)};

inline Hold until_certain(const profiles::PlannedRun& run) {
  auto certainty = std::make_shared<profiles::RunCertainty>(kUntil, run.steps);
  return [certainty](const profiles::PlannedStep& step, double thrust_n, double zero_n,
                     StandInTime& time) -> std::optional<HeldStep> {
    if (!certainty->needs(step)) {
      certainty->left_out(step);
      return std::nullopt;
    }
    daq::StepWatch watch(kDiscard, kMost);
    HeldStep held{{}, kDiscard + StandInTime::kBin};
    double sum = 0, since = 0;
    while (held.bins_n.size() < bins_in(kMost)) {
      since = static_cast<double>(held.bins_n.size() + 1) * StandInTime::kBin;
      held.bins_n.push_back(time.next(1).front() + thrust_n * (1 - std::exp(-since / kRise)));
      sum += held.bins_n.back();
      const auto n = held.bins_n.size();
      watch.add(since, 350 * n, sum / static_cast<double>(n));
      if (since < kUntil.dwell_least.value()) continue;
      const auto [mean_n, u_n] = watch.known();
      if (u_n <= certainty->enough_n(step, mean_n - zero_n)) break;
    }
    const auto [mean_n, u_n] = watch.known();
    certainty->held(step, mean_n - zero_n, u_n, since);
    return held;
  };
}

/// The campaign as its file would say it.
inline profiles::Campaign with_until(profiles::Campaign campaign) {
  campaign.profile.dwell = Seconds(kMost);
  campaign.profile.until = kUntil;
  campaign.minimum_discard = Seconds(kDiscard);
  return campaign;
}

}  // namespace kphi::fit
