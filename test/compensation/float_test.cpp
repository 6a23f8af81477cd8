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

/// The same in double, from the numbers that float was told.
struct InDouble {
  std::optional<compensation::MixedThrusts> mixed;
  double condition = 0;
};
InDouble mixed_in_double(const Mixed& told) {
  using namespace compensation;
  const auto count = static_cast<std::size_t>(told.rotors);
  RotorLayout layout{Rotors<HubPosition>(count), Rotors<int>(count)};
  Rotors<Real> scale(count);
  ThrustLimits limits{Rotors<Newtons>(count), Rotors<Newtons>(count)};
  for (std::size_t i = 0; i < count; ++i) {
    layout.hubs[i] = {Metres(told.hubs[i][0]), Metres(told.hubs[i][1])};
    layout.spins[i] = told.spins[i];
    scale[i] = told.drag_scale[i];
    limits.smallest[i] = Newtons(told.smallest[i]);
    limits.largest[i] = Newtons(told.largest[i]);
  }
  auto mixer = Mixer::build(layout, {Metres(told.per_newton), told.per_square_newton});
  if (!mixer || !mixer->set_layout(layout, scale)) return {};
  const Wrench demand{Newtons(told.demand[0]), NewtonMetres(told.demand[1]), NewtonMetres(told.demand[2]),
                      NewtonMetres(told.demand[3])};
  return {mixer->mix(demand, limits, NewtonMetres(told.assured_yaw)), condition_of(layout, scale)};
}

/// By how much two answers differ, as shares of the largest of the demand in newtons.
struct Differences {
  double wrench = 0, thrusts = 0;
};
Differences differences(const Mixed& told, const compensation::MixedThrusts& mixed) {
  double reach = 0, arm = 0;
  for (int i = 0; i < told.rotors; ++i) {
    reach = std::max({reach, std::fabs(double{told.hubs[i][0]}), std::fabs(double{told.hubs[i][1]})});
    arm = std::max(arm, double{told.per_newton} * told.drag_scale[i]);
  }
  const double units[] = {1, reach, reach, arm};
  const double achieved[] = {mixed.achieved.thrust.value(), mixed.achieved.roll.value(), mixed.achieved.pitch.value(),
                             mixed.achieved.yaw.value()};
  double demand = 0;
  Differences off;
  for (int k = 0; k < 4; ++k) {
    demand = std::max(demand, std::fabs(told.demand[k]) / units[k]);
    off.wrench = std::max(off.wrench, std::fabs(told.achieved[k] - achieved[k]) / units[k]);
  }
  for (std::size_t i = 0; i < mixed.thrusts.size(); ++i)
    off.thrusts = std::max(off.thrusts, std::fabs(told.thrusts[i] - mixed.thrusts[i].value()));
  return {off.wrench / demand, off.thrusts / demand};
}

class Conceding : public testing::TestWithParam<unsigned> {};

TEST_P(Conceding, DemandsAreMetAsInDouble) {
  constexpr double kSame = 1e-4;
  for (const bool curved : {false, true}) {
    std::uint32_t state = GetParam();
    int conceding = 0, ill = 0, ill_off = 0, others = 0, concessions_differ = 0, unfinished = 0;
    Differences worst, worst_ill;
    while (conceding < 62'500) {
      const Mixed told = mixed_in_float(state, curved);
      const InDouble real = mixed_in_double(told);
      if (!told.built || !real.mixed || real.mixed->steps == 0) continue;
      ++conceding;
      concessions_differ += told.concessions != real.mixed->concessions.bits();
      unfinished += real.mixed->concessions.has(compensation::Concession::unfinished);
      const Differences off = differences(told, *real.mixed);
      const bool well = real.condition < 1e5;
      (well ? worst : worst_ill).wrench = std::max((well ? worst : worst_ill).wrench, off.wrench);
      ASSERT_LE(well ? off.wrench : 0, kSame) << told.rotors << " rotors, condition " << real.condition;
      ill += !well;
      ill_off += !well && off.wrench > kSame;
      // More than four rotors can make one wrench in many ways, and then the search for the smallest may end early.
      others += off.thrusts > kSame && off.wrench <= kSame;
      ASSERT_LE(told.rotors <= 4 ? off.thrusts : 0, kSame);
    }
    EXPECT_LE(ill_off, conceding / 2'000);
    EXPECT_LE(others, conceding / 2'000);
    EXPECT_LE(concessions_differ, conceding / 500);
    EXPECT_LE(unfinished, conceding / 300);
    std::printf(
        "%s%d conceding demands: wrenches differ by %.1e of the demand; %d ill-conditioned: by %.1e, %d by more than "
        "that much; another choice of thrusts: %d; concessions differ %d times; %d unfinished\n",
        curved ? "curved, " : "", conceding, worst.wrench, ill, worst_ill.wrench, ill_off, others, concessions_differ,
        unfinished);
  }
}

/// On the square body, with the limits of occluded rotors.
TEST_P(InFloat, DemandsAreMetAsInDouble) {
  Draw draw(GetParam() + 100);
  int compared = 0, saturated = 0, flags_differ = 0, often = 0;
  double worst = 0;
  for (int i = 0; i < 125'000; ++i) {
    Vehicle vehicle = draw.vehicle(i % 2 == 0 ? 0.05 : 0.8);
    vehicle.assured_yaw = draw.between(0, 0.01);
    const Flown single = flown_in_float(vehicle);
    const auto real = flown<FlownInDouble>(vehicle);
    if (!single.built || !real.built) continue;
    ++compared;
    saturated += real.concessions != 0;
    double most = 1, off = 0;
    for (int j = 0; j < 4; ++j) {
      ASSERT_TRUE(single.thrusts[j] >= 0 && single.thrusts[j] <= single.thrust_max[j]);
      flags_differ += single.flags[j] != real.flags[j];
      most = std::max(most, real.thrust_max[j]);
      off = std::max(off, std::fabs(single.thrusts[j] - real.thrusts[j]));
    }
    worst = std::max(worst, off / most);
    often += off / most > 1e-3;
  }
  EXPECT_GT(compared, 100'000);
  EXPECT_GT(saturated, 10'000);
  EXPECT_LE(often, saturated / 10'000) << "arms that nearly make one line of three rotors";
  EXPECT_LT(flags_differ, compared / 1000);
  std::printf("%d demands, %d saturated: thrusts differ by %.1e of the largest, %d times by 1e-3; flags %d times\n",
              compared, saturated, worst, often, flags_differ);
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

INSTANTIATE_TEST_SUITE_P(Seeds, Conceding, testing::Values(1u, 2u, 3u, 4u, 5u, 6u, 7u, 8u));
INSTANTIATE_TEST_SUITE_P(Seeds, InFloat, testing::Values(1u, 2u, 3u, 4u, 5u, 6u, 7u, 8u));

}  // namespace kphi::test::float_test
