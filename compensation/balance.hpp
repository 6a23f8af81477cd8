// Where the rotors of a vehicle stand about its centre of gravity, which moves with the arms.
#pragma once

#include "compensation/airframe.hpp"
#include "compensation/rotors.hpp"
#include "compensation/units.hpp"

namespace kphi::compensation {

/// Where the rotors stand and which way their drag turns the body, in the order of the rotors.
struct RotorLayout {
  Rotors<HubPosition> hubs;  ///< relative to the centre of gravity, x forward, y left [m]
  Rotors<int> spins;         ///< s_i: +1 where the drag torque points along +z, −1 else
};

/// What moves the centre of gravity, seen from above.
struct Masses {
  Real body = 0;       ///< [kg] all that does not move with an arm; of each arm's beam half, as if it sat at the hinge
  Position body_at{};  ///< its centre of gravity in the body frame
  Rotors<Real> at_hubs;  ///< [kg] motor, propeller and what else sits at each hub, with the other half of the beam
};

/// Of the shape with these arm angles: c = (m_body c_body + Σ m_i h_i)/Σ m, hubs h_i − c. NaN where an angle or a mass
/// is none, or the masses are not positive: Mixer::set_layout refuses that and keeps the layout before.
[[nodiscard]] RotorLayout layout_of(const Airframe& airframe, const Masses& masses, const Rotors<Radians>& arm_angles,
                                    const Rotors<int>& spins) noexcept;

/// The same of hubs that are told by themselves, in the body frame.
[[nodiscard]] RotorLayout layout_of(const Rotors<HubPosition>& hubs, const Masses& masses,
                                    const Rotors<int>& spins) noexcept;

}  // namespace kphi::compensation
