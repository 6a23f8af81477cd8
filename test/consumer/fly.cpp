// Prints the speed [RPM] of each rotor in O, every rotor asked for 1.5 N. Built without exceptions and RTTI, in double
// or float as the library is.
#include <cstdio>

#include "compensation/compensator.hpp"

namespace flying = kphi::compensation;
using kphi::Real;

int main() {
  const auto k_t = kphi::from_newtons_per_rpm2(Real(1.7e-8));
  const auto line = flying::ThrustCurve::from_line(
      k_t, k_t * Real(1.03), Real(-0.0028889) * k_t.value() * 180 / kphi::kPi, kphi::from_degrees(270));
  if (!line) return 1;
  flying::Airframe airframe;
  airframe.half_side = kphi::Metres(Real(0.045));
  airframe.arm_length = kphi::Metres(Real(0.117));
  airframe.propeller_radius = kphi::Metres(Real(0.0635));
  airframe.fastest_speed = kphi::from_rpm(19100);

  auto built = flying::Compensator::build({*line, *line, *line, *line}, airframe);
  if (!built.compensator) return 1;
  flying::Compensator compensator = *built.compensator;
  const kphi::Radians folded(kphi::kPi);
  compensator.set_arms({folded, folded, kphi::from_degrees(Real(165.676)), folded});
  const kphi::Newtons thrust(Real(1.5));
  for (const kphi::RadPerSec speed : compensator.speeds_for({thrust, thrust, thrust, thrust}).speeds) {
    std::printf("%.1f\n", static_cast<double>(kphi::to_rpm(speed)));
  }
}
