// Other measures than the rim, other bodies than the square.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "test/compensation/example_vehicle.hpp"

namespace kphi::compensation {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

TEST(CompensatorBody, FliesByAreaAndByLoadWhereTheLineWasFittedSo) {
  struct Known {
    OverlapMeasure measure;
    double phi_deg, phi_of_arm_2_deg;
  };
  for (const Known known :
       {Known{OverlapMeasure::rim_arc, 64.84, 41.29}, Known{OverlapMeasure::area_share, 42.79, 17.66},
        Known{OverlapMeasure::load_share, 50.51, 22.76}}) {
    Compensator compensator = compensator_of(example_airframe(known.measure));
    compensator.set_arms(shape_o());
    EXPECT_NEAR(to_degrees(compensator.occlusion_angles()[0]), known.phi_deg, 0.01);
    EXPECT_NEAR(to_degrees(compensator.occlusion_angles()[2]), known.phi_of_arm_2_deg, 0.01);
  }
}

TEST(CompensatorBody, FindsTheSamePhiOnASquareGivenAsAPolygon) {
  Airframe airframe = example_airframe();
  airframe.polygon = square_as_polygon(Metres(0.045));
  airframe.half_side = Metres(0);
  Compensator general = compensator_of(airframe);
  Compensator closed = example_compensator();
  std::mt19937_64 random(77);
  std::uniform_real_distribution<double> theta(-90, 180);
  for (int i = 0; i < 20000; ++i) {
    const auto arms = arms_at(theta(random), theta(random), theta(random), theta(random));
    general.set_arms(arms);
    closed.set_arms(arms);
    for (std::size_t j = 0; j < 4; ++j) {
      ASSERT_NEAR(general.occlusion_angles()[j].value(), closed.occlusion_angles()[j].value(), 1e-7);
      const HubPosition hub = hub_in_body(airframe, j, arms[j]), same = hub_in_body(example_airframe(), j, arms[j]);
      ASSERT_NEAR(hub.x.value(), same.x.value(), 1e-15);
      ASSERT_NEAR(hub.y.value(), same.y.value(), 1e-15);
    }
  }
}

TEST(CompensatorBody, KnowsBodiesAndHingesOfAnyConvexShape) {
  // A long hexagon, arms hinged at its four outer corners, those of the left side mirrored.
  const Position corners[] = {{Metres(0.10), Metres(0.03)},  {Metres(0.0), Metres(0.05)},
                              {Metres(-0.10), Metres(0.03)}, {Metres(-0.10), Metres(-0.03)},
                              {Metres(0.0), Metres(-0.05)},  {Metres(0.10), Metres(-0.03)}};
  Airframe airframe = example_airframe();
  airframe.polygon = PolygonBody{*ConvexPolygon::from(corners, 6),
                                 {{{corners[0], from_degrees(0), false},
                                   {corners[2], from_degrees(180), true},
                                   {corners[3], from_degrees(180), false},
                                   {corners[5], from_degrees(0), true}}}};
  Compensator compensator = compensator_of(airframe);
  compensator.set_arms(arms_at(45, 45, 45, 45));
  for (const Radians phi : compensator.occlusion_angles()) EXPECT_EQ(phi.value(), 0.0);
  compensator.set_arms(arms_at(170, 170, 170, 170));  // folded back over the body's long sides
  for (const Radians phi : compensator.occlusion_angles()) {
    EXPECT_GT(to_degrees(phi), 30.0);
    EXPECT_NEAR(phi.value(), compensator.occlusion_angles()[0].value(), 1e-12) << "the shape is symmetric";
  }
  airframe.polygon->hinges[2].turn = Radians(kNaN);
  const ThrustCurve line = paper_line();
  EXPECT_EQ(Compensator::build({line, line, line, line}, airframe).refusal, Refusal::hinges);
}

}  // namespace
}  // namespace kphi::compensation
