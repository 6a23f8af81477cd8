#include <gtest/gtest.h>

#include "test/compensation/counted_allocations.hpp"
#include "test/compensation/example_vehicle.hpp"

namespace kphi::compensation {
namespace allocation_test {

TEST(FlyingCalls, AllocateNothing) {
  ASSERT_TRUE(allocations_are_counted());
  const long before = allocations.load();
  Compensator compensator = *build_with(paper_line()).compensator;
  double sum = 0;
  for (int degrees = -90; degrees <= 180; ++degrees) {
    compensator.set_arms(all_at(degrees));
    compensator.enable(degrees % 2 == 0);
    sum += compensator.speeds_for(thrusts_of(0.0, 1.5, 1e9, -1.0)).speeds[1].value();
  }
  const ConvexPolygon square = ConvexPolygon::square(Metres(0.045));
  sum += occlusion_angle(square, Metres(0.0635), {Metres(0.07), Metres(0.05)}, OverlapMeasure::load_share).value();
  sum += compensator.speed_uncertainties(Rotors<ThrustCurve>(4, paper_line()), thrusts_of(1, 1, 1, 1), Radians(0.01))[0]
             .value();
  const RotorLayout layout = example_layout(shape_o());
  auto mixer = Mixer::build(layout, {Metres(0.0133), 1e-4});
  (void)mixer->set_layout(layout, compensator.drag_scale());
  for (const double roll : {0.0, 0.3, 30.0}) {
    const Wrench demand{Newtons(20), NewtonMetres(roll), NewtonMetres(0.1), NewtonMetres(0.1)};
    sum += mixer->mix(demand, {{}, compensator.thrust_max()}).achieved.thrust.value();
  }
  EXPECT_EQ(allocations.load(), before);
  EXPECT_GT(sum, 0.0);
}

}  // namespace allocation_test
}  // namespace kphi::compensation
