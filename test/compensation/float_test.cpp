// The library in float against the library in double, on the same inputs.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "test/compensation/flown.hpp"
#include "test/compensation/odd_numbers.hpp"

namespace kphi::test::float_test {

static_assert(std::is_same_v<Real, double>);

struct FlownInDouble {
  bool built;
  double speeds[4], thrusts[4], occlusions[4], thrust_max[4], achieved[4];
  std::uint16_t flags[4], concessions;
};

class Draw {
 public:
  explicit Draw(unsigned seed) : random_(seed) {}
  float between(double low, double high) {
    return static_cast<float>(std::uniform_real_distribution<double>(low, high)(random_));
  }
  unsigned one_of(unsigned count) { return static_cast<unsigned>(random_() % count); }

  Vehicle vehicle(double pull) {
    Vehicle drawn{};
    drawn.half_side = between(0.02, 0.08);
    drawn.propeller_radius = between(0.03, 0.1);
    drawn.arm_length = drawn.propeller_radius + between(0.005, 0.1);
    drawn.fastest_speed = between(1500, 2500);
    drawn.thrust_coefficient = between(1e-6, 3e-6);
    drawn.intercept = drawn.thrust_coefficient * between(0.97, 1.05);
    drawn.slope_per_rad = -drawn.thrust_coefficient * between(0.05, 0.2);
    drawn.torque_covered = between(0.6, 1.1);
    drawn.table = one_of(2) == 0;
    float k = 1;
    for (float& knot : drawn.knots) knot = k *= between(0.6, 1);
    drawn.trend = one_of(3) == 0 ? 0 : between(-0.2, 0.3);
    drawn.overlap = static_cast<int>(one_of(3));
    drawn.law = static_cast<int>(one_of(2));
    for (float& arm : drawn.arms) arm = between(-1.6, 3.2);
    drawn.demand[0] = between(2, 12);
    for (int i = 1; i < 4; ++i) drawn.demand[i] = between(-pull, pull) / (i == 3 ? 10 : 1);
    return drawn;
  }

 private:
  std::mt19937_64 random_;
};

class InFloat : public testing::TestWithParam<unsigned> {};

TEST_P(InFloat, SpeedsAgreeWithDoubleToOnePartInAHundredThousand) {
  Draw draw(GetParam());
  int compared = 0, covered = 0;
  double worst = 0;
  for (int i = 0; i < 125'000; ++i) {
    const Vehicle vehicle = draw.vehicle(0.05);
    const Flown single = flown_in_float(vehicle);
    const auto real = flown<FlownInDouble>(vehicle);
    if (!single.built || !real.built) continue;
    for (int j = 0; j < 4; ++j) {
      ASSERT_TRUE(std::isfinite(single.speeds[j]));
      // The same thrusts on both sides: the mixer is compared below.
      const compensation::SpeedTrend trend{vehicle.trend / vehicle.fastest_speed, RadPerSec(vehicle.fastest_speed / 2)};
      const double fastest = vehicle.fastest_speed;
      const double plain = std::sqrt(single.thrusts[j] / real.thrust_max[j] * trend.factor_at(fastest)) * fastest;
      const double speed = std::min(trend.speed_for(plain), fastest);
      const double off = std::fabs(single.speeds[j] - speed) / std::max(speed, 1.0);
      ++compared;
      covered += real.occlusions[j] > 0;
      // A curve that misses K_T steps at first contact, and rounding decides on which side of it.
      if (real.occlusions[j] < 1e-3 && (real.occlusions[j] > 0) != (single.occlusions[j] > 0)) continue;
      ASSERT_LE(off, 1e-5) << "φ = " << real.occlusions[j];
      worst = std::max(worst, off);
    }
  }
  EXPECT_GT(compared, 400'000);
  EXPECT_GT(covered, 100'000);
  std::printf("%d speeds, %d of covered rotors: off by %.1e at most\n", compared, covered, worst);
}

TEST_P(InFloat, DemandsAreMetAsInDouble) {
  Draw draw(GetParam() + 100);
  int compared = 0, saturated = 0, often = 0, flags_differ = 0, concessions_differ = 0;
  double worst = 0;
  for (int i = 0; i < 125'000; ++i) {
    Vehicle vehicle = draw.vehicle(i % 2 == 0 ? 0.05 : 0.8);
    vehicle.assured_yaw = draw.between(0, 0.01);
    const Flown single = flown_in_float(vehicle);
    const auto real = flown<FlownInDouble>(vehicle);
    if (!single.built || !real.built) continue;
    ++compared;
    saturated += real.concessions != 0;
    double most = 1;
    for (int j = 0; j < 4; ++j) {
      ASSERT_TRUE(single.thrusts[j] >= 0 && single.thrusts[j] <= single.thrust_max[j]);
      flags_differ += single.flags[j] != real.flags[j];
      most = std::max(most, real.thrust_max[j]);
    }
    concessions_differ += single.concessions != real.concessions;
    const auto missed = [&](const auto& by) {
      return std::hypot(by.achieved[1] - vehicle.demand[1], by.achieved[2] - vehicle.demand[2]);
    };
    const double more = (missed(single) - missed(real)) / most;
    worst = std::max(worst, more);
    often += more > 1e-5;
    const double yaw = vehicle.demand[3];
    // Of some 0.5 N m that the four can make.
    ASSERT_GE(single.achieved[3], std::min(yaw, 0.0) - 2e-4);
    ASSERT_LE(single.achieved[3], std::max(yaw, 0.0) + 2e-4);
  }
  EXPECT_GT(compared, 100'000);
  EXPECT_GT(saturated, 10'000);
  // Rows that are nearly parallel over the free rotors: float takes the one for the other.
  EXPECT_LT(worst, 2e-3) << "m";
  EXPECT_LT(often, saturated / 500);
  EXPECT_LT(flags_differ, compared / 1000);
  EXPECT_LT(concessions_differ, compared / 500);
  std::printf(
      "%d demands, %d saturated: roll and pitch miss by %.1e N m per N more at most, %d times by 1e-5; flags "
      "differ %d times, concessions %d\n",
      compared, saturated, worst, often, flags_differ, concessions_differ);
}

TEST(InFloatOdd, NoNaNComesOutWhateverGoesIn) {
  std::mt19937_64 random(3);
  const float odd[] = {std::nanf(""), HUGE_VALF, -HUGE_VALF, 1e38F, -1e38F, 1e-45F, 0, 0.05F, 3.1F, -1};
  for (int i = 0; i < 100'000; ++i) {
    Vehicle vehicle = Draw(static_cast<unsigned>(i)).vehicle(0.1);
    for (float* numbers : {vehicle.arms, vehicle.demand}) {
      for (int j = 0; j < 4; ++j) numbers[j] = odd[random() % std::size(odd)];
    }
    const Flown single = flown_in_float(vehicle);
    for (int j = 0; j < 4; ++j) {
      ASSERT_TRUE(single.speeds[j] >= 0 && single.speeds[j] <= vehicle.fastest_speed);
      ASSERT_TRUE(single.occlusions[j] >= 0 && single.occlusions[j] <= 6.2832F);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, InFloat, testing::Values(1u, 2u, 3u, 4u, 5u, 6u, 7u, 8u));

}  // namespace kphi::test::float_test
