// T = c2 ω² + c1 ω + c0, ω in rad/s: `thrust_map: [c2, c1, c0]` of a quadrotor file.
#include <fmt/format.h>

#include "fit/export/wording.hpp"
#include "results/number.hpp"

namespace kphi::fit {

Export to_agilicious(const compensation::Coefficients& file, const ExportOptions& options) {
  using results::yaml_number;
  Export result;
  result.text = comment(file, "# ") +
                fmt::format("# phi = {:g} deg; c2 N/(rad/s)^2, c1 N/(rad/s), c0 N\nthrust_map: [{}, 0.0, 0.0]\n",
                            options.phi_deg, yaml_number(coefficient_at(file, options.phi_deg)));
  if (options.speed_max_rpm || file.fastest_speed)
    result.text += fmt::format("motor_omega_max: {}  # rad/s\n", yaml_number(speed_max_of(file, options)));
  if (file.slowest_speed)
    result.text +=
        fmt::format("motor_omega_min: {}  # rad/s, the slowest measured\n", yaml_number(file.slowest_speed->value()));
  result.lost = {no_phi("thrust_map", options.phi_deg),
                 "standard errors, covariance, air density: the file has no keys for them; they stand in comments"};
  return result;
}

}  // namespace kphi::fit
