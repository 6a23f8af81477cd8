// What a fitted flight becomes: a result as that of a bench, for the writer of coefficients and all that reads them,
// and what to say of the flight itself.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "fit/flights/flight_fit.hpp"
#include "fit/flights/flown_bins.hpp"
#include "fit/flights/speed_check.hpp"
#include "fit/uncertainty/analysis.hpp"

namespace kphi::fit {

/// K_T and k at each φ that was flown, joined by a line from K_T or by the options' form, with the flight's errors.
/// Propeller, diameter, blades, overlap and limits are taken from the options. Its verdict says what this log cannot
/// show, and knows what its vibration shows of the speeds. Throws FitError for a curve that cannot fly.
[[nodiscard]] Fitted fitted_of(const FlightFit& fit, const FlownBins& flown, const LoggedVehicle& vehicle,
                               const SpeedCheck& speeds, IdentificationOptions options,
                               const ReadinessLimits& limits = {});

/// One line for the coefficient file: "PX4 ULog, 93 s of 0.6 kg, collective ± 4.5 %, folded to 65° 14 times".
[[nodiscard]] std::string flight_line(const FlightFit& fit, const FlownBins& flown, const LoggedVehicle& vehicle,
                                      const std::string& format);

/// For a person, several lines: first what the flight excited, then k(φ)/K_T, then the rest.
[[nodiscard]] std::string flight_words(const FlightFit& fit, const FlownBins& flown, const LoggedVehicle& vehicle,
                                       const SpeedCheck& speeds);

[[nodiscard]] nlohmann::ordered_json flight_json(const FlightFit& fit, const FlownBins& flown,
                                                 const SpeedCheck& speeds);

}  // namespace kphi::fit
