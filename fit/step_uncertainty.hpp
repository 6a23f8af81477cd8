// The standard uncertainties of a step's own means, as far as the steps tell them.
#pragma once

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "fit/thrust_fit.hpp"
#include "results/step_mean.hpp"

namespace kphi::fit {

/// s/√n. Neighbouring samples are alike, so that this is a lower limit; as a weight only its course over the steps
/// matters. 0: not known.
[[nodiscard]] inline double mean_uncertainty(double deviation, std::uint64_t n) {
  return n > 0 && deviation > 0 ? deviation / std::sqrt(static_cast<double>(n)) : 0;
}

/// The points of one fit. Where every step tells the uncertainty that its correlated samples leave, with the zero's,
/// that is taken; where one does not, s/√n is taken of all: the two differ by a factor, and must not be mixed. Of the
/// speed likewise.
[[nodiscard]] inline std::vector<Point> points_of(std::span<const results::StepMean> steps) {
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
