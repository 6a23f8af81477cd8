// What is known of a flight without it, and which numbers of the model are fitted beside k.
#pragma once

#include <string>
#include <vector>

#include "fit/flights/flight_model.hpp"
#include "fit/flights/flown_bins.hpp"
#include "fit/flights/speed_check.hpp"

namespace kphi::fit {

/// Standard uncertainties, each of the unit that its comment names.
struct FlightPriors {
  double scale_u = 0.005;           ///< 1: accelerometer's scale
  double bias_u = 0.05;             ///< m/s²: its zero
  double drag = 0.4;                ///< 1/s: force per mass and climb rate
  double drag_u = 0.25;             ///< 1/s
  double forward_u = 0.2;           ///< 1/(m/s²): specific force along z per square of that across
  double inertia_u = 0.3;           ///< 1: moments of inertia of the vehicle file
  double gravity_centre_u = 0.005;  ///< m: centre of gravity of the vehicle file
  double rotor_u = 0.05;            ///< 1: one rotor beside the mean of all
  double delay_u = 0.02;            ///< s: clock of the speeds beside that of the accelerometer
  double lag = 0.05, lag_u = 0.05;  ///< s: rotor behind command
  double stamp_u = 0.001;           ///< s: stamps of the commands beside those of the accelerometer
  double law = 0.6, law_u = 0.3;    ///< 1: share of u² in the thrust over the command u, PX4's THR_MDL_FAC
  double sag = 0.5, sag_u = 0.5;    ///< 1: relative speed per relative voltage
  double speed_u = 0.002;           ///< 1: all logged speeds together
  std::string speed_note = "pole count and clock of the speed controllers";
  double full_speed_u = 0.05;  ///< 1: speed at full command, of a log with commands
};

/// "NAME=VALUE", NAME one of mass, scale, bias, drag, speed, full-speed. Throws ConfigurationError.
void set_flight_uncertainty(FlightPriors& priors, LoggedVehicle& vehicle, const std::string& text);

/// Speeds as the vibration tells them, where it confirms them and is the better clock. Returns by which factor.
double correct_speeds(FlightLog& log, const SpeedCheck& check, FlightPriors& priors);

/// The free numbers of a flight, K_T first, then k/K_T at each knot, with what is known of them.
[[nodiscard]] std::vector<FreeNumber> free_numbers(const FlownBins& flown, const FlightPriors& priors);

/// Numbers that are not fitted, because what the flight seems to tell of them is not so: of the accelerometer, that a
/// controller answers to gusts, and of the stamps, what the model has only nearly right.
[[nodiscard]] std::vector<FreeNumber> considered_numbers(const FlownBins& flown, const FlightPriors& priors);

/// Source of the budget to which a number belongs.
[[nodiscard]] const char* group_of(std::size_t which);

}  // namespace kphi::fit
