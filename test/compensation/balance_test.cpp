#include "compensation/balance.hpp"

#include <gtest/gtest.h>

#include "compensation/mixing.hpp"
#include "test/compensation/example_vehicle.hpp"

namespace kphi::compensation {
namespace balance_test {

const Masses kMasses{0.42, {}, {0.045, 0.045, 0.045, 0.045}};
const Rotors<int> kSpins{1, -1, 1, -1};

TEST(Balance, FindsTheCentreOfGravityOfEachShape) {
  // facts of the default vehicle: 0.60 kg, 45 g at each hub; centre of gravity [mm] of X, H, T and O.
  const struct {
    std::array<Radians, 4> arms;
    double x, y;
  } shapes[] = {{shape_x(), 0, 0}, {shape_h(), 0, 0}, {shape_t(), 0, 17.55e-3}, {shape_o(), -0.27e-3, -2.17e-3}};
  for (const auto& shape : shapes) {
    const RotorLayout layout = layout_of(example_airframe(), kMasses, shape.arms, kSpins);
    const HubPosition from_middle = hub_in_body(example_airframe(), 2, shape.arms[2]);
    EXPECT_NEAR((from_middle.x - layout.hubs[2].x).value(), shape.x, 5e-6);
    EXPECT_NEAR((from_middle.y - layout.hubs[2].y).value(), shape.y, 5e-6);
    EXPECT_EQ(layout.spins[1], -1);
  }
}

TEST(Balance, CountsABodyThatIsHeavyOnOneSide) {
  Masses masses = kMasses;
  masses.body_at = at(0.01, -0.02);
  const RotorLayout even = layout_of(example_airframe(), kMasses, shape_x(), kSpins);
  const RotorLayout uneven = layout_of(example_airframe(), masses, shape_x(), kSpins);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR((even.hubs[i].x - uneven.hubs[i].x).value(), 0.01 * 0.42 / 0.60, 1e-15);
    EXPECT_NEAR((even.hubs[i].y - uneven.hubs[i].y).value(), -0.02 * 0.42 / 0.60, 1e-15);
  }
}

TEST(Balance, OfAnUnknownAngleOrNoMassIsALayoutThatTheMixerRefuses) {
  Mixer mixer = Mixer::build(layout_of(example_airframe(), kMasses, shape_x(), kSpins), {Metres(0.0133), 0}).value();
  EXPECT_FALSE(mixer.set_layout(layout_of(example_airframe(), kMasses, arms_at(45, kNaN, 45, 45), kSpins)));
  EXPECT_FALSE(mixer.set_layout(layout_of(example_airframe(), {}, shape_x(), kSpins)));
  EXPECT_FALSE(mixer.set_layout(example_compensator().layout(kMasses, kSpins))) << "no arm angle told yet";
  EXPECT_TRUE(mixer.set_layout(with_arms(shape_o()).layout(kMasses, kSpins)));
}

TEST(Balance, KeepsTheShapeOfTheLastAngleThatWasBelieved) {
  Compensator compensator = with_arms(shape_o());
  const RotorLayout before = compensator.layout(kMasses, kSpins);
  compensator.set_arms({Radians(45), Radians(kNaN), shape_o()[2], shape_o()[3]});
  EXPECT_EQ(compensator.layout(kMasses, kSpins).hubs[0].x, before.hubs[0].x);
}

}  // namespace balance_test
}  // namespace kphi::compensation
