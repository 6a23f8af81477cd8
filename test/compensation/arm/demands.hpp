// Random vehicles of 3 to 8 rotors and demands that they mostly cannot meet, alike on every processor: from a generator
// of its own, in the number that the library is compiled for.
#pragma once

#include <cmath>
#include <cstdint>

#include "compensation/mixing.hpp"

namespace kphi::test {

struct Demand {
  compensation::RotorLayout layout;
  compensation::Rotors<Real> drag_scale;
  compensation::ThrustLimits limits;
  compensation::DragTorque drag;
  compensation::Wrench wrench;
  NewtonMetres assured_yaw;
};

class Demands {
 public:
  explicit Demands(std::uint32_t seed) : state_(seed) {}

  /// `curved`: the torque per thrust depends on the thrust.
  Demand next(bool curved) {
    using namespace compensation;
    const std::size_t count = 3 + below(6);
    Demand drawn{{Rotors<HubPosition>(count), Rotors<int>(count)},
                 Rotors<Real>(count),
                 {Rotors<Newtons>(count), Rotors<Newtons>(count)},
                 {Metres(Real(0.0133)), curved ? between(-0.15, 0.15) * Real(0.0133 / 4) : 0},
                 {},
                 {}};
    const bool regular = below(4) == 0, from_zero = below(2) == 0;
    const Real corner = 2 * kPi / static_cast<Real>(count);
    for (std::size_t i = 0; i < count; ++i) {
      const Real angle = corner * (static_cast<Real>(i) + Real(0.5)), away = regular ? 0 : Real(0.08);
      drawn.layout.hubs[i] = {Metres(Real(0.18) * std::cos(angle) + between(-away, away)),
                              Metres(Real(0.18) * std::sin(angle) + between(-away, away))};
      drawn.layout.spins[i] = i % 2 == 0 ? 1 : -1;
      drawn.drag_scale[i] = regular ? 1 : between(1, 1.5);
      drawn.limits.smallest[i] = Newtons(from_zero ? 0 : between(0, 0.5));
      drawn.limits.largest[i] = Newtons(regular ? 4 : between(2, 6));
    }
    const Real most = static_cast<Real>(count), reach = Real(0.3) * most;
    drawn.wrench = {Newtons(between(0, 5) * most), NewtonMetres(between(-reach, reach)),
                    NewtonMetres(between(-reach, reach)), NewtonMetres(between(-0.2, 0.2))};
    if (below(4) == 0) drawn.wrench.pitch = NewtonMetres(0);
    if (below(4) == 0) drawn.wrench.yaw = NewtonMetres(0);
    drawn.assured_yaw = NewtonMetres(between(0, 0.05));
    return drawn;
  }

  Real between(double low, double high) {
    const Real from = static_cast<Real>(low);
    return from + (static_cast<Real>(high) - from) * static_cast<Real>(bits() >> 8) / Real(16777216);
  }
  std::uint32_t state() const { return state_; }
  std::uint32_t below(std::uint32_t count) { return (bits() >> 8) % count; }

 private:
  std::uint32_t bits() {
    state_ ^= state_ << 13;
    state_ ^= state_ >> 17;
    return state_ ^= state_ << 5;
  }
  std::uint32_t state_;
};

}  // namespace kphi::test
