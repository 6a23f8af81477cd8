#include "compensation/balance.hpp"

#include <limits>

namespace kphi::compensation {

RotorLayout layout_of(const Airframe& airframe, const Masses& masses, const Rotors<Radians>& arm_angles,
                      const Rotors<int>& spins) noexcept {
  const std::size_t count = arm_angles.size();
  RotorLayout layout{Rotors<HubPosition>(count), spins};
  Real mass = masses.body, x = mass * masses.body_at.x.value(), y = mass * masses.body_at.y.value();
  for (std::size_t i = 0; i < count; ++i) {
    const HubPosition hub = layout.hubs[i] = hub_in_body(airframe, i, arm_angles[i]);
    const Real here = i < masses.at_hubs.size() ? masses.at_hubs[i] : Real(0);
    mass += here;
    x += here * hub.x.value();
    y += here * hub.y.value();
  }
  const Real per_mass = mass > 0 ? 1 / mass : std::numeric_limits<Real>::quiet_NaN();
  for (HubPosition& hub : layout.hubs) hub = {hub.x - Metres(x * per_mass), hub.y - Metres(y * per_mass)};
  return layout;
}

}  // namespace kphi::compensation
