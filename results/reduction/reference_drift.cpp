#include "results/reduction/reference_drift.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <vector>

#include "results/reduction/repetitions.hpp"

namespace kphi::results {

namespace {

/// Of the air during a run, kg/m³; NaN: unknown.
double density_of(std::span<const StepMean> steps, int repetition) {
  const auto step = std::ranges::find(steps, repetition, &StepMean::repetition);
  return step != steps.end() ? step->air_density_kg_m3 : kNotMeasured;
}

}  // namespace

bool ReferenceDrift::drifted() const { return std::abs(share) > std::max(2 * u_share, kReferenceDriftShare); }

std::string ReferenceDrift::to_words() const {
  return fmt::format("from the first to the last reference run k changed by {:+.3f} ± {:.3f} %{}{}", 100 * share,
                     100 * u_share, same_air ? " at equal air density" : "",
                     drifted() ? ": the bench has drifted; check propeller, mounting and load cell, and doubt the "
                                 "runs in between"
                               : "");
}

std::optional<ReferenceDrift> reference_drift(std::span<const StepMean> steps) {
  if (steps.empty()) return std::nullopt;
  const int first = -1, last = std::ranges::min(steps, {}, &StepMean::repetition).repetition;
  std::vector<StepMean> runs;
  std::ranges::copy_if(steps, std::back_inserter(runs),
                       [&](const StepMean& step) { return step.repetition == first || step.repetition == last; });
  const auto verdicts = judge_repetitions(runs);
  if (verdicts.size() != 1 || verdicts[0].repetitions.size() != 2) return std::nullopt;
  const RepetitionFigure &end = verdicts[0].repetitions[0], &begin = verdicts[0].repetitions[1];
  if (std::isnan(begin.k) || std::isnan(end.k) || !(begin.k > 0)) return std::nullopt;
  ReferenceDrift drift;
  drift.k_begin = begin.k;
  drift.k_end = end.k;
  const double thinning = density_of(runs, first) / density_of(runs, last);
  drift.same_air = std::isfinite(thinning);
  drift.share = end.k / begin.k * (drift.same_air ? thinning : 1) - 1;
  drift.u_share = std::hypot(begin.u / begin.k, end.u / end.k);
  return drift;
}

}  // namespace kphi::results
