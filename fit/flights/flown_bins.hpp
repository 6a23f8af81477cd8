// A flight log in short pieces of time: what the accelerometer felt, what the rotors did, where the arms were; without
// what the model of the flight does not hold for. All that the estimator sees of a log.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "compensation/airframe.hpp"
#include "compensation/flight/simulated_vehicle.hpp"
#include "compensation/rotors.hpp"
#include "fit/flights/flight_log.hpp"

namespace kphi::fit {

/// The vehicle that flew, as its file and its owner say.
struct LoggedVehicle {
  std::string name;
  compensation::Airframe airframe;
  flight::Build build{};  ///< masses, inertia, rotor lag and drag to begin with
  bool build_known = false;
  /// Of a log without arm angles, or of hubs that are told by themselves: where the arms were all the time.
  std::optional<compensation::Rotors<Radians>> arms{};
  std::optional<compensation::Rotors<compensation::HubPosition>> hubs{};
  double mass_kg = 0;     ///< of all of it as it flew, with battery
  double mass_u = 0.003;  ///< standard uncertainty, relative
  bool weighed = false;   ///< the mass is of this flight, not of the vehicle file
  std::string shape{};    ///< name of `arms` or `hubs`, for messages
};

struct FlownBin {
  double time_s = 0;   ///< of its middle
  double force = 0;    ///< specific force along body z, m/s²
  double forward = 0;  ///< squares of the other two, means over 1 s, (m/s²)²: grows with the speed through the air
  double climb = 0;    ///< m/s along body z, or what takes its place
  std::array<double, 2> turning{};                       ///< roll and pitch acceleration, rad/s²; where `turns`
  bool turns = false;                                    ///< no rotor is over the body, and the angular rates are known
  compensation::Rotors<double> phi{};                    ///< rad
  std::array<compensation::Rotors<double>, 2> levers{};  ///< y_i and −x_i about the centre of gravity, m
  std::array<double, 2> inertia{};                       ///< about x and y, kg m²
};

/// Why bins were left out, and how many.
struct LeftOutBins {
  std::size_t on_ground = 0, near_ground = 0, arms_turning = 0, unknown = 0, sinking = 0, folded = 0;
};

/// What the flight did, which limits what it can tell.
struct Excitation {
  double seconds = 0;         ///< of flight that was used
  double collective = 0;      ///< half of the range (5 to 95 %) of the force along z, relative to its median
  double differences = 0;     ///< deviation of the rotors from their common mean, relative
  double widest_deg = 0;      ///< largest φ at which a second was flown
  double seconds_folded = 0;  ///< at more than half of it
  int folds = 0;              ///< how often the arms changed between folded and not
  /// φ of the shapes that were flown long and often enough to tell k there, ascending; empty: K_T alone.
  std::vector<double> knots_deg{};
};

/// Even samples of what drives the rotors: speeds [rad/s] or commands.
struct RotorDrive {
  double step_s = 0.005;
  bool commands = false;
  std::vector<compensation::Rotors<double>> values;
  std::vector<double> volts;  ///< relative to their mean in flight; empty: not logged
};

struct FlownBins {
  std::size_t rotors = 0;
  double width_s = 0.05;
  std::vector<FlownBin> bins;      ///< used, ascending
  std::vector<std::size_t> first;  ///< of each: its first sample of `drive`
  std::size_t samples = 10;        ///< of `drive` in a bin
  RotorDrive drive;
  Excitation excitation;
  LeftOutBins left_out;
  bool climb_logged = false, height_logged = false;
  std::optional<double> density;     ///< kg/m³, mean
  std::vector<std::string> remarks;  ///< one line each
};

/// Throws FitError, one line, for a log that is too short, lacks a channel, or contradicts its frame or units.
[[nodiscard]] FlownBins flown_bins(const FlightLog& log, const LoggedVehicle& vehicle);

}  // namespace kphi::fit
