#include "daq/reference_drift.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "daq/repetitions.hpp"

namespace kphi::daq {
namespace {

using results::StepMean;

constexpr int kBegin = 1, kEnd = 2;

/// Of the first and the last reference run, as repetitions of each other.
std::vector<StepMean> two_runs(std::span<const StepMean> steps) {
  int first = -1, last = -1;
  for (const StepMean& step : steps) last = std::min(last, step.repetition);
  std::vector<StepMean> chosen;
  for (const StepMean& step : steps) {
    if (step.repetition != first && step.repetition != last) continue;
    chosen.push_back(step);
    chosen.back().repetition = step.repetition == first ? kBegin : kEnd;
  }
  return chosen;
}

/// Of the air during a run, kg/m³; NaN: unknown.
double density_of(std::span<const StepMean> steps, int repetition) {
  for (const StepMean& step : steps) {
    if (step.repetition == repetition) return step.air_density_kg_m3;
  }
  return results::kNotMeasured;
}

}  // namespace

bool ReferenceDrift::drifted() const { return std::abs(share) > std::max(2 * u_share, kReferenceDriftShare); }

std::string ReferenceDrift::to_words() const {
  return fmt::format("from the first to the last reference run k changed by {:+.3f} ± {:.3f} %{}{}", 100 * share,
                     100 * u_share, same_air ? " at equal density of the air" : "",
                     drifted() ? ": the bench has drifted; look at propeller, mounting and load cell, and take "
                                 "what lies between with care"
                               : "");
}

std::optional<ReferenceDrift> reference_drift(std::span<const StepMean> steps) {
  const std::vector<StepMean> runs = two_runs(steps);
  const auto verdicts = judge_repetitions(runs);
  if (verdicts.size() != 1 || verdicts[0].repetitions.size() != 2) return std::nullopt;
  const RepetitionFigure &begin = verdicts[0].repetitions[0], &end = verdicts[0].repetitions[1];
  if (std::isnan(begin.k) || std::isnan(end.k) || !(begin.k > 0)) return std::nullopt;
  ReferenceDrift drift;
  drift.k_begin = begin.k;
  drift.k_end = end.k;
  const double thinning = density_of(runs, kBegin) / density_of(runs, kEnd);
  drift.same_air = std::isfinite(thinning);
  drift.share = end.k / begin.k * (drift.same_air ? thinning : 1) - 1;
  drift.u_share = std::hypot(begin.u / begin.k, end.u / end.k);
  return drift;
}

}  // namespace kphi::daq
