#include "compensation/balance.hpp"

#include <limits>

#include "compensation/strict_math.hpp"

namespace kphi::compensation {
namespace {

/// Places `hubs` about the shape's centre of gravity.
void centre(Rotors<HubPosition>& hubs, const Masses& masses) noexcept {
  Real mass = masses.body, x = mass * masses.body_at.x.value(), y = mass * masses.body_at.y.value();
  for (std::size_t i = 0; i < hubs.size(); ++i) {
    const Real here = i < masses.at_hubs.size() ? masses.at_hubs[i] : Real(0);
    mass += here;
    x += here * hubs[i].x.value();
    y += here * hubs[i].y.value();
  }
  const Real per_mass = mass > 0 ? 1 / mass : std::numeric_limits<Real>::quiet_NaN();
  for (HubPosition& hub : hubs) hub = {hub.x - Metres(x * per_mass), hub.y - Metres(y * per_mass)};
}

}  // namespace

RotorLayout layout_of(const Airframe& airframe, const Masses& masses, const Rotors<Radians>& arm_angles,
                      const Rotors<int>& spins) noexcept {
  RotorLayout layout{Rotors<HubPosition>(arm_angles.size()), spins};
  for (std::size_t i = 0; i < arm_angles.size(); ++i) layout.hubs[i] = hub_in_body(airframe, i, arm_angles[i]);
  centre(layout.hubs, masses);
  return layout;
}

RotorLayout layout_of(const Rotors<HubPosition>& hubs, const Masses& masses, const Rotors<int>& spins) noexcept {
  RotorLayout layout{hubs, spins};
  centre(layout.hubs, masses);
  return layout;
}

}  // namespace kphi::compensation
