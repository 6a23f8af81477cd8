// By how much the thrust may be wrong where one vehicle flies: the number of the verdict for the φ that its arms reach
// and the speeds of its rotors, from the coefficient file alone.
#pragma once

#include <optional>
#include <string>

#include "compensation/file/coefficient_file.hpp"
#include "fit/uncertainty/readiness.hpp"

namespace kphi::profiles {
struct Vehicle;
}

namespace kphi::fit {

struct ErrorInFlight {
  double share = 0;                             ///< of the thrust, 95 %; NaN: its arms reach φ that nobody measured
  double phi_deg = 0;                           ///< widest that its arms reach
  double slowest_rad_s = 0, fastest_rad_s = 0;  ///< of its speeds those that were measured
  bool beyond_speeds = false;                   ///< it also turns slower or faster
  Readiness readiness = Readiness::fit_to_fly;  ///< by that number, and no better than the doubts of the file
};

/// nullopt if the file does not tell it (an older one), or holds K_T alone.
[[nodiscard]] std::optional<ErrorInFlight> error_in_flight(const compensation::Coefficients& file,
                                                           const profiles::Vehicle& vehicle);

/// The file with its verdict and number for this vehicle.
void judge_for(compensation::Coefficients& file, const ErrorInFlight& error, const profiles::Vehicle& vehicle);

/// "fit to fly: thrust within 1.8 % (95 %) where foldable_drone flies, φ up to 65°, 3000 to 19100 RPM".
[[nodiscard]] std::string words(const ErrorInFlight& error, const profiles::Vehicle& vehicle);

}  // namespace kphi::fit
