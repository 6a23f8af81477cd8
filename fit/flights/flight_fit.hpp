// k(φ) from a flight, the second stand: m f = Σ k(φ_i) ω_i² − drag (docs/science.md, eq. 35 to 38). Mass and the
// accelerometer's scale are in every k and cancel in k(φ)/K_T, which is what a flight tells best.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "fit/flights/flown_bins.hpp"
#include "fit/numerics/hypothesis_test.hpp"
#include "fit/uncertainty/budget.hpp"

namespace kphi::fit {

/// What is known of the flight without it: standard uncertainties, each of the unit that its comment names.
struct FlightPriors {
  double scale_u = 0.005;           ///< 1: accelerometer's scale
  double bias_u = 0.05;             ///< m/s²: its zero
  double drag = 0.4;                ///< 1/s: force per mass and climb rate
  double drag_u = 0.25;             ///< 1/s
  double forward_u = 0.02;          ///< 1/(m/s²): specific force along z per square of that across
  double inertia_u = 0.3;           ///< 1: moments of inertia of the vehicle file
  double gravity_centre_u = 0.005;  ///< m: centre of gravity of the vehicle file
  double rotor_u = 0.05;            ///< 1: one rotor beside the mean of all
  double delay_u = 0.02;            ///< s: clock of the speeds beside that of the accelerometer
  double lag = 0.05, lag_u = 0.05;  ///< s: rotor behind command
  double stamp_u = 0.001;           ///< s: stamps of the commands beside those of the accelerometer
  double law = 0.6, law_u = 0.3;    ///< 1: share of u² in the thrust over the command u, PX4's THR_MDL_FAC
  double sag = 0.5, sag_u = 0.5;    ///< 1: relative speed per relative voltage
  double speed_u = 0.002;           ///< 1: all logged speeds together
  double full_speed_u = 0.05;       ///< 1: speed at full command, of a log with commands
};

/// "NAME=VALUE", NAME one of mass, scale, bias, drag, speed, full-speed. Throws ConfigurationError.
void set_flight_uncertainty(FlightPriors& priors, LoggedVehicle& vehicle, const std::string& text);

/// A part of the errors of K_T and of k at the widest φ, one standard deviation, with sign: they move together.
struct FlightErrorSource {
  std::string name;
  Evaluation evaluation = Evaluation::type_b;
  std::string note;
  std::string remedy;
  double of_k_t = 0, of_k_wide = 0;  ///< N/(rad/s)²
  double freedom = 0;                ///< inf of type B
};

/// A number that was fitted beside k, and what was known of it before.
struct FlightNuisance {
  std::string name, unit;
  Estimate value;
  double before = 0, before_u = 0;
  [[nodiscard]] bool told() const { return value.u < 0.5 * before_u; }
};

struct FlightFit {
  double k_t = 0;       ///< N/(rad/s)², mean of the rotors, in the air of the flight
  double wide_deg = 0;  ///< widest φ flown for a second; 0: no rotor was covered, K_T alone
  Estimate ratio;       ///< k(wide)/K_T
  double k_t_u = 0;     ///< the whole standard uncertainty, N/(rad/s)²
  double k_t_freedom = 0;
  std::vector<FlightErrorSource> sources;
  std::vector<FlightNuisance> nuisances;
  std::vector<Estimate> rotors;           ///< thrust of each beside the mean of all, relative; empty: not asked
  std::optional<std::size_t> weak_rotor;  ///< beyond chance (Holm, 5 %) and 2 %
  bool rotors_told = false;               ///< each to better than 2 % (standard)
  std::optional<Estimate> lag_s, law;     ///< of commands
  double speed_min_rad_s = 0, speed_max_rad_s = 0;
  double noise = 0;   ///< deviation of the residuals along z, m/s²
  double memory = 1;  ///< by how much slow noise makes the bins fewer
  std::size_t blocks = 0, shocks = 0;
  std::vector<double> residuals;  ///< along z, one for each bin, m/s²
  std::vector<std::string> remarks;

  [[nodiscard]] bool alone() const { return wide_deg == 0; }
  [[nodiscard]] double k_at(double phi_deg) const {
    return k_t * (alone() ? 1 : 1 - (1 - ratio.value) * phi_deg / wide_deg);
  }
};

/// Throws FitError, one line, where the flight contradicts the vehicle or leaves too little to fit.
[[nodiscard]] FlightFit fit_flight(const FlownBins& flown, const LoggedVehicle& vehicle,
                                   const FlightPriors& priors = {});

}  // namespace kphi::fit
