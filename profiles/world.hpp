// What a world file says: the air and the vehicle as they are in a simulated flight, which the controller never reads.
#pragma once

#include <optional>
#include <string>

#include "compensation/flight/aircraft.hpp"
#include "profiles/vehicle.hpp"

namespace kphi::profiles {

struct World {
  std::string name;
  flight::Truth truth;     ///< its drag counts only if `drag`
  bool drag = false;       ///< given; else that of the vehicle file
  std::size_t rotors = 0;  ///< of its lists; 0: it has none
  std::string path;
};

/// Throws ConfigurationError if its lists are of another number of rotors, or its errors of arms and the vehicle's hubs
/// are on none.
void require_vehicle(const World& world, const Vehicle& vehicle);

[[nodiscard]] World load_world(const std::string& path);
[[nodiscard]] World parse_world(const std::string& text, const std::string& path);

}  // namespace kphi::profiles
