// What holds for every vehicle, line, arm angle and thrust: a million of each from fixed seeds.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <random>
#include <utility>

#include "compensation/occlusion.hpp"
#include "test/compensation/example_vehicle.hpp"

namespace kphi::compensation {
namespace properties_test {

#ifdef KPHI_SANITIZED
constexpr int kDraws = 50000;
#else
constexpr int kDraws = 1000000;
#endif

class Draw {
 public:
  explicit Draw(std::uint64_t seed) : random_(seed) {}
  double between(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }

  Airframe airframe() {
    const double half_side = between(0.01, 0.15), radius = between(0.03, 0.12);
    return example_airframe_of(half_side, radius * between(1.001, 2.5), radius);
  }
  /// Falls with occlusion; the intercept on either side of K_T.
  ThrustCurve line() { return example_line(between(0.8, 1.2), -between(0.0, 0.01)); }
  std::array<Radians, 4> arms() {
    return {Radians(between(-kPi / 2, kPi)), Radians(between(-kPi / 2, kPi)), Radians(between(-kPi / 2, kPi)),
            Radians(between(-kPi / 2, kPi))};
  }
  std::array<Newtons, 4> thrusts(double largest) {
    return thrusts_of(between(0, largest), between(0, largest), between(0, largest), between(0, largest));
  }

 private:
  std::mt19937_64 random_;
};

bool same_bits(double a, double b) { return std::memcmp(&a, &b, sizeof a) == 0; }

TEST(Properties, PhiLiesBetweenNothingAndAWholeTurnInEveryMeasure) {
  Draw draw(101);
  int touching = 0;
  for (int i = 0; i < kDraws; ++i) {
    const double a = draw.between(0.001, 0.2), r = draw.between(0.01, 0.2);
    // Every fourth just touches an edge, or just not, or a corner: there rounding decides.
    const double touch = a + r * (1 - std::pow(10, -draw.between(1, 17)));
    const Metres x(i % 8 == 4 ? a : draw.between(-0.4, 0.4)), y(i % 4 == 0 ? touch : draw.between(-0.4, 0.4));
    const double arc = rim_arc(Metres(a), Metres(r), x, y).value();
    ASSERT_GE(arc, 0.0);
    ASSERT_LE(arc, 2 * kPi);
    touching += arc > 0;
    for (const OverlapMeasure measure : {OverlapMeasure::area_share, OverlapMeasure::load_share}) {
      const double phi = occlusion_angle(ConvexPolygon::square(Metres(a)), Metres(r), {x, y}, measure).value();
      ASSERT_GE(phi, 0.0);
      ASSERT_LE(phi, 2 * kPi);
      ASSERT_TRUE(arc < 1e-4 || phi > 0.0) << "a rim over the body means area over it, above rounding";
    }
  }
  EXPECT_GT(touching, kDraws / 10);
}

TEST(Properties, PhiIsContinuousInTheArmAngle) {
  Draw draw(102);
  constexpr double kStep = 1e-9;
  for (int i = 0; i < kDraws; ++i) {
    const Airframe airframe = draw.airframe();
    const double theta = draw.between(-kPi / 2, kPi), r = airframe.propeller_radius.value();
    const auto arc = [&](double angle) {
      const HubPosition hub = hub_beside_body(airframe, 0, Radians(angle));
      return rim_arc(airframe.half_side, airframe.propeller_radius, hub.x, hub.y).value();
    };
    // A strip as wide as the hub moves holds at most so much rim, on each of four edges: the root at tangency.
    const double moved = airframe.arm_length.value() * kStep + 1e-16;
    ASSERT_NEAR(arc(theta), arc(theta + kStep), 8 * std::sqrt(2 * moved / r) + 1e-12);
    // Shares have no such root: at most the body's edge within the disk, 2πr, sweeps over so much of it.
    for (const auto& [measure, weight] :
         {std::pair{OverlapMeasure::area_share, 2.0}, {OverlapMeasure::load_share, 3.0}}) {
      const auto share = [&, by = measure](double angle) {
        return occlusion_angle(ConvexPolygon::square(airframe.half_side), airframe.propeller_radius,
                               hub_beside_body(airframe, 0, Radians(angle)), by)
            .value();
      };
      ASSERT_NEAR(share(theta), share(theta + kStep), weight * 2 * kPi * moved / r + 1e-12);
    }
  }
}

/// Looks for a jump: halves a stretch of arm angles forty times, each time keeping the half over which φ changes more.
TEST(Properties, PhiHasNoJumpAnywhere) {
  Draw draw(108);
  int moving = 0;
  for (int i = 0; i < kDraws / 10; ++i) {
    Airframe airframe = draw.airframe();
    airframe.overlap = kOverlapMeasureNames[static_cast<std::size_t>(i) % 3].measure;
    const auto phi = [&](double theta) { return occlusion_of_arm(airframe, 0, Radians(theta)).value(); };
    double from = draw.between(-kPi / 2, kPi), to = from + 0.02, low = phi(from), high = phi(to);
    moving += low != high;
    for (int halving = 0; halving < 40 && low != high; ++halving) {
      const double middle = 0.5 * (from + to), between = phi(middle);
      const bool first = std::fabs(between - low) > std::fabs(high - between);
      (first ? to : from) = middle;
      (first ? high : low) = between;
    }
    const double moved = airframe.arm_length.value() * (to - from) + 1e-16;
    ASSERT_NEAR(low, high, 8 * std::sqrt(2 * moved / airframe.propeller_radius.value()) + 1e-12);
  }
  EXPECT_GT(moving, kDraws / 40);
}

TEST(Properties, EveryArmSeesTheSamePhiAtTheSameAngle) {
  Draw draw(103);
  for (int i = 0; i < kDraws / 4; ++i) {  // four arms each
    Airframe airframe = draw.airframe();
    airframe.mirrored = {i % 2 == 0, i % 3 == 0, i % 5 == 0, i % 7 == 0};
    airframe.overlap = kOverlapMeasureNames[static_cast<std::size_t>(i) % 3].measure;
    Compensator compensator = compensator_of(airframe);
    const Radians theta(draw.between(-kPi / 2, kPi));
    compensator.set_arms({theta, theta, theta, theta});
    for (std::size_t arm = 0; arm < 4; ++arm) {
      ASSERT_EQ(compensator.occlusion_angles()[arm], compensator.occlusion_angles()[0]);
      // The same by way of the body's own frame, turned by quarters and mirrored.
      const HubPosition hub = hub_in_body(airframe, arm, theta);
      const double in_body = occlusion_beside_body(airframe, arm, hub).value();
      ASSERT_NEAR(in_body, compensator.occlusion_angles()[arm].value(), 1e-7);
    }
  }
}

TEST(Properties, TheScalingFactorLiesBetweenItsFloorAndOne) {
  Draw draw(104);
  for (int i = 0; i < kDraws; ++i) {
    const double k = example_line(draw.between(1e-3, 3), draw.between(-0.1, 0.1))
                         .scaling_factor(Radians(draw.between(-0.2, 2.2 * kPi)));
    ASSERT_GE(k, kScalingFloor);
    ASSERT_LE(k, 1.0);
  }
}

TEST(Properties, TheSpeedGrowsWithThrustAndWithOverlapAndReturnsTheThrust) {
  Draw draw(105);
  int occluded = 0;
  for (int i = 0; i < kDraws / 4; ++i) {  // four rotors each
    const ThrustCurve line = draw.line();
    Compensator compensator = *build_with(line, draw.airframe()).compensator;
    compensator.set_arms(draw.arms());
    const auto thrusts = draw.thrusts(0.6);  // within reach even at the floor
    auto more = thrusts;
    for (Newtons& thrust : more) thrust = thrust + Newtons(draw.between(0, 0.01));
    const auto speeds = compensator.speeds_for(thrusts).speeds, faster = compensator.speeds_for(more).speeds;
    for (std::size_t j = 0; j < 4; ++j) {
      ASSERT_GE(faster[j], speeds[j]);
      const ThrustCoefficient k = kExampleCoefficient * compensator.scaling_factors()[j];
      ASSERT_NEAR(thrust_at(k, speeds[j]).value(), thrusts[j].value(), 1e-12 * thrusts[j].value());
      occluded += compensator.occlusion_angles()[j].value() > 0;
    }
    const auto same = compensator.speeds_for(thrusts_of(0.5, 0.5, 0.5, 0.5)).speeds;
    const auto& phi = compensator.occlusion_angles();
    for (std::size_t j = 1; j < 4; ++j) {
      const std::size_t wider = phi[j] >= phi[j - 1] ? j : j - 1, narrower = 2 * j - 1 - wider;
      ASSERT_GE(same[wider], same[narrower]);
    }
  }
  EXPECT_GT(occluded, kDraws / 20);
}

/// Any 64 bits as a double: every size from 5e-324 to 1.8e308, infinities, NaN. And every other one an odd number.
TEST(Properties, NoNaNComesOutWhateverGoesIn) {
  std::mt19937_64 random(107);
  const double odd[] = {kNaN, kInfinity, -kInfinity, 1e308, -1e308, 5e-324, 0.0, -0.0, 1.5, 3.0, kPi, -1.2, 100.0};
  const auto any = [&] {
    if (random() % 2 == 0) return odd[random() % std::size(odd)];
    const std::uint64_t bits = random();
    double value;
    std::memcpy(&value, &bits, sizeof value);
    return value;
  };
  for (const ScalingLaw law : {ScalingLaw::clamped, ScalingLaw::published}) {
    for (const OverlapMeasureName& entry : kOverlapMeasureNames) {
      Airframe airframe = example_airframe(entry.measure);
      if (law == ScalingLaw::published) airframe.polygon = square_as_polygon(Metres(0.045));
      Compensator compensator = compensator_of(airframe, law);
      const Rotors<ThrustCurve> curves(4, paper_line(airframe.overlap));
      for (int i = 0; i < kDraws / 12; ++i) {  // four rotors each, six ways
        compensator.set_arms({Radians(any()), Radians(any()), Radians(any()), Radians(any())});
        const SpeedCommand command = compensator.speeds_for(thrusts_of(any(), any(), any(), any()));
        const auto uncertainties =
            compensator.speed_uncertainties(curves, thrusts_of(any(), any(), any(), any()), Radians(any()));
        for (std::size_t j = 0; j < 4; ++j) {
          ASSERT_TRUE(command.speeds[j].value() >= 0 && command.speeds[j] <= airframe.fastest_speed);
          const double phi = compensator.occlusion_angles()[j].value(), k = compensator.scaling_factors()[j];
          ASSERT_TRUE(phi >= 0 && phi <= 2 * kPi);
          ASSERT_TRUE(k <= 1 && (law == ScalingLaw::published || k >= kScalingFloor));
          ASSERT_GE(compensator.thrust_max()[j].value(), 0);
          ASSERT_TRUE(compensator.drag_scale()[j] >= 1 && compensator.drag_scale()[j] <= 1 / kScalingFloor);
          ASSERT_GE(uncertainties[j].value(), 0);
        }
      }
    }
  }
}

TEST(Properties, XAndHAndTAndOffAreThePlainMapBitForBit) {
  Draw draw(106);
  const std::array<std::array<Radians, 4>, 4> shapes = {shape_x(), shape_h(), shape_t(), shape_o()};
  for (int i = 0; i < kDraws; ++i) {  // four rotors each: a million speeds per shape
    const ThrustCurve line = draw.line();
    const auto law = i % 2 == 0 ? ScalingLaw::clamped : ScalingLaw::published;
    Compensator compensator = *build_with(line, example_airframe(), law).compensator;
    const std::size_t shape = static_cast<std::size_t>(i) % 4;
    compensator.enable(shape != 3);  // O: off
    compensator.set_arms(shapes[shape]);
    const auto thrusts = draw.thrusts(6);
    const auto speeds = compensator.speeds_for(thrusts).speeds;
    for (std::size_t j = 0; j < 4; ++j) {
      ASSERT_TRUE(same_bits(speeds[j].value(), std::sqrt(thrusts[j].value() / kExampleCoefficient.value())));
    }
  }
}

}  // namespace properties_test
}  // namespace kphi::compensation
