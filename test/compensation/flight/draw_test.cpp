#include "compensation/flight/draw.hpp"

#include <gtest/gtest.h>

#include <set>

#include "test/compensation/flight/flight_fixture.hpp"

namespace kphi::flight {
namespace {

Scene drawn(std::size_t index, std::uint64_t seed = 1) { return drawn_scene(example_scene(seed), index); }

TEST(Draw, DependsOnSeedAndIndexAlone) {
  EXPECT_EQ(drawn(5).truth.gamma, drawn(5).truth.gamma);
  EXPECT_NE(drawn(5).truth.gamma, drawn(6).truth.gamma);
  EXPECT_NE(drawn(5).truth.gamma, drawn(5, 2).truth.gamma);
  EXPECT_NE(drawn(5).seed, drawn(6).seed);
}

TEST(Draw, StaysWithinItsStatedRanges) {
  std::array<int, kLossLaws> laws{};
  double squares = 0;
  for (std::size_t i = 0; i < 600; ++i) {
    const Scene scene = drawn(i);
    ++laws[static_cast<std::size_t>(scene.truth.law)];
    EXPECT_TRUE(scene.truth.gamma >= 1 && scene.truth.gamma < 1.5);
    EXPECT_TRUE(scene.truth.drag >= 0.1 && scene.truth.drag < 0.5);
    const Gains& gains = scene.pilot.gains;
    EXPECT_TRUE(gains.position.x() >= 5 && gains.position.x() < 10);
    const double stiffness = gains.attitude.x() * gains.rate.x() / (12 * 18);
    EXPECT_TRUE(stiffness >= 0.3997 && stiffness < 1) << "of the default of the paper's lab";
    EXPECT_EQ(gains.position.z(), 15) << "the height's gains are the paper's";
    const double margin = (scene.vehicle.o[0] - scene.vehicle.o[2]).value();
    EXPECT_TRUE(margin >= 0.1 - 1e-3 && margin < 0.5 + 1e-3) << margin;
    EXPECT_EQ(scene.vehicle.o[0], example_vehicle().o[0]);
    squares += (scene.truth.thrust[1] - 1) * (scene.truth.thrust[1] - 1);
  }
  EXPECT_EQ(laws, (std::array<int, kLossLaws>{200, 200, 200})) << "in equal parts";
  EXPECT_NEAR(std::sqrt(squares / 600), 0.01, 0.001);
}

}  // namespace
}  // namespace kphi::flight
