// Parameters as QGroundControl loads them. Control allocation takes thrust = CT u², u the normalised output, so that
// CT = k ω_max² in N where the output is proportional to speed (a speed-controlled motor); THR_MDL_FAC = 1 says so.
#include <fmt/format.h>

#include "fit/export/wording.hpp"
#include "profiles/configuration_error.hpp"
#include "results/number.hpp"

namespace kphi::fit {

Export to_px4(const compensation::Coefficients& file, const ExportOptions& options) {
  constexpr double kLargestCt = 100;  // module.yaml of control_allocator
  constexpr int kReal32 = 9;          // MAV_PARAM_TYPE_REAL32
  const double speed_max = speed_max_of(file, options);
  const double ct = coefficient_at(file, options.phi_deg) * speed_max * speed_max;
  if (!(ct <= kLargestCt)) {
    throw ConfigurationError(
        fmt::format("{}: {:.1f} N at full output is above 100, the largest CA_ROTORn_CT; no file", file.path, ct));
  }
  Export result;
  result.text = comment(file, "# ") +
                fmt::format(
                    "# phi = {:g} deg; CT in N at {:.0f} RPM, thrust = CT u^2 with u proportional to speed\n"
                    "# Vehicle-Id Component-Id Name Value Type\n",
                    options.phi_deg, to_rpm(RadPerSec(speed_max)));
  for (int motor = 0; motor < options.motors; ++motor)
    result.text += fmt::format("1\t1\tCA_ROTOR{}_CT\t{}\t{}\n", motor, results::shortest(ct), kReal32);
  result.text += fmt::format("1\t1\tTHR_MDL_FAC\t1.0\t{}\n", kReal32);
  result.lost = {no_phi("CA_ROTORn_CT", options.phi_deg),
                 "rad/s: PX4 knows a normalised output only; CT holds for the speed at full output named above",
                 "standard errors: parameters have none"};
  return result;
}

}  // namespace kphi::fit
