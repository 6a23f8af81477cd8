#include "compensation/airframe.hpp"

#include <gtest/gtest.h>

#include "test/compensation/example_vehicle.hpp"
#include "test/compensation/geometry_vectors.hpp"

namespace kphi::compensation {
namespace airframe_test {

void expect_hub_mm(std::size_t arm, Radians theta, double x, double y) {
  const HubPosition hub = hub_in_body(example_airframe(), arm, theta);
  EXPECT_NEAR(hub.x.value() * 1000, x, 0.5) << "arm " << arm;
  EXPECT_NEAR(hub.y.value() * 1000, y, 0.5) << "arm " << arm;
}

TEST(Airframe, PutsTheHubsOfTheNamedShapesWhereTheyBelong) {
  expect_hub_mm(0, shape_x()[0], 128, 128);
  expect_hub_mm(1, shape_x()[1], -128, 128);
  expect_hub_mm(2, shape_h()[2], -162, -45);
  expect_hub_mm(3, shape_t()[3], 162, -45);
  expect_hub_mm(0, shape_o()[0], -72, 45);
  expect_hub_mm(1, shape_o()[1], -45, -72);
  expect_hub_mm(2, shape_o()[2], 68.4, -73.9);
  expect_hub_mm(3, shape_o()[3], 45, 72);
}

TEST(Airframe, AgreesWithTheKnownHubs) {
  for (const GeometryVector& v : geometry_vectors()) {
    if (!v.arm) continue;
    const Airframe airframe = example_airframe_of(v.half_side, v.arm_length, v.radius);
    const HubPosition hub = hub_in_body(airframe, *v.arm, Radians(v.theta));
    EXPECT_NEAR(hub.x.value(), v.hub_x, 1e-15);
    EXPECT_NEAR(hub.y.value(), v.hub_y, 1e-15);
  }
}

TEST(Airframe, TakesTheCornerOfAnArmFromItsHingeTurn) {
  Airframe airframe = example_airframe();
  airframe.hinge_turns = {{2, 3, 0, 1}};
  const HubPosition hub = hub_in_body(airframe, 0, from_degrees(45));
  EXPECT_LT(hub.x, Metres(0));
  EXPECT_LT(hub.y, Metres(0));
}

TEST(Airframe, MirrorsAnArmAboutTheDiagonalOfItsCorner) {
  Airframe airframe = example_airframe();
  airframe.mirrored = {true, false, true, false};
  const HubPosition x = hub_in_body(airframe, 0, from_degrees(45));
  EXPECT_NEAR(x.x.value(), x.y.value(), 1e-15) << "45° points away from the body either way";
  const HubPosition folded = hub_in_body(airframe, 0, from_degrees(180));
  EXPECT_NEAR(folded.x.value(), 0.045, 1e-15) << "180° lies along the edge before instead of the next";
  EXPECT_NEAR(folded.y.value(), -0.072, 1e-15);
  const HubPosition opposite = hub_in_body(airframe, 2, from_degrees(180));
  EXPECT_NEAR(opposite.x.value(), -folded.x.value(), 1e-15);
  EXPECT_NEAR(opposite.y.value(), -folded.y.value(), 1e-15);
}

}  // namespace airframe_test
}  // namespace kphi::compensation
