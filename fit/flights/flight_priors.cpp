#include "fit/flights/flight_priors.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "base/csv.hpp"
#include "base/error.hpp"

namespace kphi::fit {
namespace {

constexpr double kLeastTurning = 10;  // s in which roll and pitch can be followed

}  // namespace

void set_flight_uncertainty(FlightPriors& priors, LoggedVehicle& vehicle, const std::string& text) {
  const std::size_t equals = text.find('=');
  const double value = equals == std::string::npos ? -1 : parse_number(text.substr(equals + 1)).value_or(-1);
  const struct {
    const char* name;
    double* u;
  } entries[] = {{"mass", &vehicle.mass_u}, {"scale", &priors.scale_u}, {"bias", &priors.bias_u},
                 {"drag", &priors.drag_u},  {"speed", &priors.speed_u}, {"full-speed", &priors.full_speed_u}};
  for (const auto& entry : entries) {
    if (text.substr(0, equals) != entry.name || !(value > 0)) continue;
    *entry.u = value;
    return;
  }
  throw ConfigurationError(fmt::format(
      "--u {}: of a flight expected NAME=VALUE, NAME one of mass, scale, speed, full-speed (relative: 0.003 "
      "is 0.3 %), bias (m/s^2) or drag (1/s), VALUE a standard uncertainty above 0",
      text));
}

double correct_speeds(FlightLog& log, const SpeedCheck& check, FlightPriors& priors) {
  if (check.verdict != SpeedCheck::Verdict::confirmed) return 1;
  const double u = expanded(check.beats) / (coverage_factor(std::numeric_limits<double>::infinity()) * check.blades);
  if (!(u < priors.speed_u)) return 1;
  const double gain = check.beats.value / check.blades;
  for (FlightChannel& rotor : log.rotor_speed)
    for (double& speed : rotor.values) speed *= gain;
  priors.speed_u = u;
  priors.speed_note = "by the vibration at the blades' beat";
  return gain;
}

std::vector<FreeNumber> free_numbers(const FlownBins& flown, const FlightPriors& priors) {
  std::vector<FreeNumber> free{{kLevel, 1, 0, "K_T", "1"}};
  const std::size_t knots = flown.excitation.knots_deg.size();
  for (std::size_t j = 0; j < knots; ++j) free.push_back({kKnots + j, 1, 0, "k/K_T", "1"});
  free.push_back({kDrag, priors.drag, priors.drag_u, "drag of climb", "1/s"});
  free.push_back({kForward, 0, priors.forward_u, "lift of forward flight", "s^2/m"});
  if (flown.drive.commands) {
    free.push_back({kTiming, priors.lag, priors.lag_u, "lag", "s"});
    free.push_back({kLaw, priors.law, priors.law_u, "THR_MDL_FAC", "1"});
    if (!flown.drive.volts.empty()) free.push_back({kSag, priors.sag, priors.sag_u, "speed per voltage", "1"});
  } else {
    free.push_back({kTiming, 0, priors.delay_u, "delay of the speeds", "s"});
  }
  const auto turning = std::ranges::count_if(flown.bins, &FlownBin::turns);
  if (static_cast<double>(turning) * flown.width_s > kLeastTurning) {
    free.push_back({kRollGain, 1, priors.inertia_u, "moment of inertia, roll", "1"});
    free.push_back({kPitchGain, 1, priors.inertia_u, "moment of inertia, pitch", "1"});
    free.push_back({kCentreY, 0, priors.gravity_centre_u, "centre of gravity, y", "m"});
    free.push_back({kCentreX, 0, priors.gravity_centre_u, "centre of gravity, x", "m"});
  }
  for (std::size_t i = 0; i < flown.rotors; ++i)
    free.push_back({kKnots + knots + i, 0, priors.rotor_u, fmt::format("rotor {}", i + 1), "1"});
  return free;
}

std::vector<FreeNumber> considered_numbers(const FlownBins& flown, const FlightPriors& priors) {
  std::vector<FreeNumber> considered{{kScale, 0, priors.scale_u, "accelerometer scale", "1"},
                                     {kBias, 0, priors.bias_u, "accelerometer zero", "m/s^2"}};
  if (flown.drive.commands) considered.push_back({kStamp, 0, priors.stamp_u, "stamps of the commands", "s"});
  return considered;
}

const char* group_of(std::size_t which) {
  switch (which) {
    case kScale:
      return "accelerometer scale";
    case kBias:
      return "accelerometer zero";
    case kDrag:
    case kForward:
      return "air drag and inflow";
    case kTiming:
    case kStamp:
      return "clock or lag of the rotors";
    case kLaw:
    case kSag:
      return "law of throttle and voltage";
    default:
      return "rotors that differ";
  }
}

}  // namespace kphi::fit
