// The standard uncertainties of a step's own means, as far as the step tells them.
#pragma once

#include <cmath>

#include "fit/thrust_fit.hpp"
#include "results/step_mean.hpp"

namespace kphi::fit {

/// s/√n. Neighbouring samples are alike, so that this is a lower limit; as a weight only its course over the steps
/// matters. 0: not known.
[[nodiscard]] inline double mean_uncertainty(double deviation, std::uint64_t n) {
  return n > 0 && deviation > 0 ? deviation / std::sqrt(static_cast<double>(n)) : 0;
}

[[nodiscard]] inline Point point_of(const results::StepMean& step) {
  return {step.speed_rad_s, step.thrust_n, 1, mean_uncertainty(step.thrust_sd_n, step.thrust_samples),
          mean_uncertainty(step.speed_sd_rad_s, step.speed_n)};
}

}  // namespace kphi::fit
