// k(φ) from a flight, the second stand: m f = Σ k(φ_i) ω_i² − drag (docs/science.md, eq. 35 to 38). Mass and the
// accelerometer's scale are in every k and cancel in k(φ)/K_T, which is what a flight tells best.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "fit/flights/flight_priors.hpp"
#include "fit/flights/flown_bins.hpp"
#include "fit/numerics/hypothesis_test.hpp"
#include "fit/uncertainty/budget.hpp"

namespace kphi::fit {

/// A part of the errors of K_T and of k at each knot, one standard deviation, with sign: they move together.
struct FlightErrorSource {
  std::string name;
  Evaluation evaluation = Evaluation::type_b;
  std::string note;
  std::string remedy;
  std::vector<double> of;  ///< K_T first, N/(rad/s)²
  double freedom = 0;      ///< inf of type B
};

/// A number that was fitted beside k, and what was known of it before.
struct FlightNuisance {
  std::string name, unit;
  Estimate value;
  double before = 0, before_u = 0;
  [[nodiscard]] bool told() const { return value.u < 0.5 * before_u; }
};

/// What is left of K_T at one φ.
struct KeptThrust {
  double phi_deg = 0;
  Estimate ratio;
};

struct FlightFit {
  double k_t = 0;                ///< N/(rad/s)², mean of the rotors, in the air of the flight
  std::vector<KeptThrust> kept;  ///< at the φ that were flown, ascending; empty: no rotor was covered, K_T alone
  double k_t_u = 0;              ///< the whole standard uncertainty, N/(rad/s)²
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

  [[nodiscard]] bool alone() const { return kept.empty(); }
  /// Widest φ flown for a second; 0: no rotor was covered.
  [[nodiscard]] double wide_deg() const { return alone() ? 0 : kept.back().phi_deg; }
  /// k/K_T there.
  [[nodiscard]] Estimate ratio() const { return alone() ? Estimate{1, 0} : kept.back().ratio; }
};

/// Throws FitError, one line, where the flight contradicts the vehicle or leaves too little to fit.
[[nodiscard]] FlightFit fit_flight(const FlownBins& flown, const LoggedVehicle& vehicle,
                                   const FlightPriors& priors = {});

}  // namespace kphi::fit
