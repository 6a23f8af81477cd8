#include "test/compensation/float_side.hpp"

#include "test/compensation/arm/demands.hpp"
#include "test/compensation/flown.hpp"

#ifndef KPHI_FLOAT
#error "compiled with KPHI_FLOAT"
#endif

namespace kphi::test {

Flown flown_in_float(const Vehicle& vehicle) { return flown<Flown>(vehicle); }

Mixed mixed_in_float(std::uint32_t& state, bool curved) {
  Demands demands(state);
  const Demand drawn = demands.next(curved);
  state = demands.state();
  Mixed told{};
  const std::size_t count = drawn.layout.hubs.size();
  told.rotors = static_cast<int>(count);
  for (std::size_t i = 0; i < count; ++i) {
    told.hubs[i][0] = drawn.layout.hubs[i].x.value();
    told.hubs[i][1] = drawn.layout.hubs[i].y.value();
    told.spins[i] = drawn.layout.spins[i];
    told.drag_scale[i] = drawn.drag_scale[i];
    told.smallest[i] = drawn.limits.smallest[i].value();
    told.largest[i] = drawn.limits.largest[i].value();
  }
  told.per_newton = drawn.drag.per_newton.value();
  told.per_square_newton = drawn.drag.per_square_newton;
  const auto put = [](const compensation::Wrench& from, float(&to)[4]) {
    to[0] = from.thrust.value();
    to[1] = from.roll.value();
    to[2] = from.pitch.value();
    to[3] = from.yaw.value();
  };
  put(drawn.wrench, told.demand);
  told.assured_yaw = drawn.assured_yaw.value();
  auto mixer = compensation::Mixer::build(drawn.layout, drawn.drag);
  told.built = mixer && mixer->set_layout(drawn.layout, drawn.drag_scale);
  if (!told.built) return told;
  const compensation::MixedThrusts mixed = mixer->mix(drawn.wrench, drawn.limits, drawn.assured_yaw);
  for (std::size_t i = 0; i < count; ++i) told.thrusts[i] = mixed.thrusts[i].value();
  put(mixed.achieved, told.achieved);
  told.concessions = mixed.concessions.bits();
  return told;
}

}  // namespace kphi::test
