#include <gtest/gtest.h>

#include "compensation/mixing.hpp"
#include "test/compensation/counted_allocations.hpp"
#include "test/compensation/example_vehicle.hpp"

namespace kphi::compensation {
namespace allocation_test {

TEST(FlyingCalls, AllocateNothing) {
  const long before_control = allocations.load();
  int* volatile kept = new int;  // volatile: or the compiler may leave both out
  delete kept;
  ASSERT_GT(allocations.load(), before_control) << "the count must see an allocation at all";

  const long before = allocations.load();
  const ThrustCurve line = paper_line();
  BuildOutcome built = Compensator::build({line, line, line, line}, example_airframe());
  Compensator compensator = *built.compensator;
  double sum = 0;
  for (int degrees = -90; degrees <= 180; ++degrees) {
    const Radians theta = from_degrees(degrees);
    compensator.set_arms({theta, theta, theta, theta});
    compensator.enable(degrees % 2 == 0);
    sum += compensator.speeds_for(thrusts_of(0.0, 1.5, 1e9, -1.0)).speeds[1].value();
  }
  const ConvexPolygon square = ConvexPolygon::square(Metres(0.045));
  sum += occlusion_angle(square, Metres(0.0635), {Metres(0.07), Metres(0.05)}, OverlapMeasure::load_share).value();
  sum += compensator.speed_uncertainties(thrusts_of(1, 1, 1, 1), Radians(0.01))[0].value();
  RotorLayout layout;
  for (std::size_t i = 0; i < 4; ++i) layout.hubs[i] = hub_in_body(example_airframe(), i, shape_o()[i]);
  auto mixer = Mixer::build(layout, {Metres(0.0133), 1e-4});
  (void)mixer->set_layout(layout, compensator.drag_scale());
  for (const double roll : {0.0, 0.3, 30.0}) {
    const Wrench demand{Newtons(20), NewtonMetres(roll), NewtonMetres(0.1), NewtonMetres(0.1)};
    sum += mixer->mix(demand, {{}, compensator.thrust_max()}).achieved.thrust.value();
  }
  const long after = allocations.load();
  EXPECT_EQ(after, before);
  EXPECT_GT(sum, 0.0);
}

}  // namespace allocation_test
}  // namespace kphi::compensation
