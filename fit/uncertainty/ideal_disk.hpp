// What the power of a propeller says of its numbers: no propeller makes more thrust of a power than the ideal disk of
// its diameter, P = T^1.5/sqrt(2 ρ A) (Froude; science.md, eq. 28), and no shaft gives more power than its motor takes.
// What breaks such a law is a unit, a pole count, a lever arm or a shunt, whatever else fits.
#pragma once

#include <string>
#include <vector>

#include "fit/model/identification.hpp"

namespace kphi::fit {

/// Share of the ideal disk's power in the shaft's, and of the shaft's in the electrical one; what lies outside is none
/// of a propeller of 3 to 30 inches at rest, or of its motor.
inline constexpr double kLeastFigureOfMerit = 0.12, kLargestFigureOfMerit = 1.0;
inline constexpr double kLeastOfElectrical = 0.02, kLargestEfficiency = 1.0;

/// One sentence for each law that the steps without occlusion break, by the mean over their faster half; none where
/// torque, power or diameter are not known.
[[nodiscard]] std::vector<std::string> broken_laws_of_power(const Identification& identification);

}  // namespace kphi::fit
