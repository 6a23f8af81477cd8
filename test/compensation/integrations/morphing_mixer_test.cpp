// The mixer in C, flown on the default vehicle.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

extern "C" {
#include "compensation/integrations/morphing_mixer.h"
}
#include "test/compensation/integrations/shipped_drone.hpp"

namespace morphing_mixer_test {

using namespace shipped_drone;

morphingVehicle_t vehicle() {
  auto made = with_shipped_drone<morphingVehicle_t>();
  made.dragPerNewton = kDrag;
  made.fullThrust = kFull;
  made.thrustCurve = 1;
  return made;
}

/// What the rotors really do: T_i = throttle_i² K_T k_i ω_max², drag torque κ K_T ω², as wrench up, forward and left.
Eigen::Vector4f wrench_of(const kphi_compensator& compensator, const morphingVehicle_t& of, const float* throttle) {
  float hubs[4][2], k[4];
  kphi_hubs(&compensator, &of.masses, hubs);
  kphi_scaling_factors(&compensator, k);
  Eigen::Vector4f wrench = Eigen::Vector4f::Zero();
  for (int i = 0; i < 4; ++i) {
    const float uncovered = throttle[i] * throttle[i] * kFull, thrust = uncovered * k[i];
    wrench += Eigen::Vector4f(thrust, thrust * hubs[i][1], -thrust * hubs[i][0],
                              static_cast<float>(of.spins[i]) * kDrag * uncovered);
  }
  return wrench;
}

void expect_wrench(const Eigen::Vector4f& got, const Eigen::Vector4f& wanted) {
  EXPECT_LT((got - wanted).norm(), 2e-5F) << got.transpose() << " instead of " << wanted.transpose();
}

TEST(MorphingMixerInC, GivesTheWrenchInEveryShape) {
  const morphingVehicle_t of = vehicle();
  morphingState_t state;
  ASSERT_EQ(morphingInit(&state, &of, kX), nullptr);
  float throttle[4];
  for (const float* shape : {kX, kO}) {
    morphingArms(&state, shape, kStill, 0);
    ASSERT_TRUE(state.shapeFlies);
    morphingMix(&state, 6, 0.02F, -0.03F, 0.005F, throttle);
    EXPECT_EQ(state.conceded, 0u);
    EXPECT_EQ(state.flags, 0u);
    expect_wrench(wrench_of(state.compensator, of, throttle), {6, 0.02F, -0.03F, 0.005F});
  }
  morphingMix(&state, 60, 0, 0, 0, throttle);
  EXPECT_EQ(state.conceded & static_cast<unsigned>(KPHI_GAVE_THRUST), static_cast<unsigned>(KPHI_GAVE_THRUST));
  for (const float one : throttle) EXPECT_LE(one, 1);
}

TEST(MorphingMixerInC, SaysInWordsWhyAVehicleCannotBeFlown) {
  morphingVehicle_t of = vehicle();
  of.airframe.arm_length = 0.05F;
  morphingState_t state;
  EXPECT_NE(std::string(morphingInit(&state, &of, kX)).find("arm"), std::string::npos);
  of = vehicle();
  of.spins[1] = 1;
  of.spins[2] = -1;
  EXPECT_NE(std::string(morphingInit(&state, &of, kX)).find("spins"), std::string::npos);
}

}  // namespace morphing_mixer_test
