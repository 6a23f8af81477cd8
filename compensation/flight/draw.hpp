// The circumstances of a flight: the recommended ones, and seeded draws around them.
#pragma once

#include <cstddef>
#include <cstdint>

#include "compensation/flight/flight.hpp"

namespace kphi::flight {

/// The one set of circumstances that single flights use. `seed` is of the estimator's noise.
[[nodiscard]] Scene nominal_scene(const Vehicle& vehicle, const PilotSettings& pilot,
                                  const compensation::ThrustCurve& curve, std::uint64_t seed);

/// Draw `index` of the seed of `nominal`, whatever was drawn before: γ 1 to 1.5, the three loss laws in turn, mass 1.5
/// %, K_T 1 % per rotor, arm angles 0.02 rad, centre of gravity 1.5 mm per axis, draught 0.1 m/s per horizontal axis,
/// the line's slope 3 % and intercept 0.01 K_T off; and times those of the vehicle file: stiffness of the attitude (its
/// gain times that of the rates, each by the root) 0.8 to 2, kpxy 5/6 to 10/6, drag 1/3 to 5/3, how far arms stop short
/// in O 0.4 to 2 (ranges are uniform, else standard deviations).
[[nodiscard]] Scene drawn_scene(const Scene& nominal, std::size_t index);

}  // namespace kphi::flight
