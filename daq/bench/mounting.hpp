// How the motor sits on the load cell.
#pragma once

namespace kphi::daq {

/// How thrust is read off the six axes, and which way the motor is told to turn.
struct Mounting {
  int axis = 2;   ///< 0..2 = Fx, Fy, Fz
  int sign = +1;  ///< of the axis when the propeller pulls
  int spin = +1;  ///< +1 counter-clockwise
};

}  // namespace kphi::daq
