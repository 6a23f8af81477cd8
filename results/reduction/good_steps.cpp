#include "results/reduction/good_steps.hpp"

#include <algorithm>
#include <cmath>

namespace kphi::results {

bool is_good(const StepMean& step) {
  return (step.quality_flags & ~kHarmlessFlags) == 0 && std::isfinite(step.thrust_n) && step.speed_rad_s > 0;
}

double thrust_u_within(const StepMean& step) {
  const double n = static_cast<double>(std::max<std::uint64_t>(step.thrust_samples, 1));
  if (std::isnan(step.thrust_u_n)) return step.thrust_sd_n / std::sqrt(n);
  return std::sqrt(std::max(step.thrust_u_n * step.thrust_u_n - step.zero_u_n * step.zero_u_n, 0.0));
}

double thrust_u(const StepMean& step) {
  const double of_speed =
      std::isnan(step.speed_u_rad_s) ? 0 : 2 * step.thrust_n * step.speed_u_rad_s / step.speed_rad_s;
  return std::hypot(thrust_u_within(step), of_speed);
}

}  // namespace kphi::results
