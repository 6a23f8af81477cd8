// Vehicle files of `profiles` as the fit of a flight takes them.
#pragma once

#include <string>

#include "fit/flights/flown_bins.hpp"
#include "profiles/vehicle.hpp"
#include "test/source_dir.hpp"

namespace kphi::fit::flown_log {

/// In X where its hubs are told.
[[nodiscard]] inline LoggedVehicle logged_vehicle(double mass_kg = 0.6,
                                                  const std::string& name = "foldable_drone.yaml") {
  const auto file = profiles::load_vehicle(test::source_dir() + "/profiles/" + name);
  LoggedVehicle vehicle;
  vehicle.name = file.name;
  vehicle.airframe = profiles::airframe_of(file);
  if (file.dynamics) vehicle.build = *file.dynamics;
  vehicle.build_known = file.dynamics.has_value();
  vehicle.mass_kg = mass_kg;
  if (!file.hubs.empty()) vehicle.hubs = file.hubs.at("X");
  return vehicle;
}

}  // namespace kphi::fit::flown_log
