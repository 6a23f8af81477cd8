#include "compensation/flight/study.hpp"

#include <gtest/gtest.h>

#include "test/compensation/flight/flight_fixture.hpp"

namespace kphi::flight {
namespace study_test {

std::vector<Draw> draws(std::size_t count, std::size_t threads) {
  return fly_draws(example_scene(), example_shadow(), count, threads);
}

bool same(const NineFlights& a, const NineFlights& b) {
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (a[i].lost != b[i].lost) return false;
    for (std::size_t leg = 0; leg < 3; ++leg) {
      if (a[i].legs[leg].mean_error != b[i].legs[leg].mean_error) return false;
      if (a[i].legs[leg].deviation != b[i].legs[leg].deviation) return false;
    }
  }
  return true;
}

/// The percentiles of one of kMerits.
Percentiles of(const Findings& found, const std::string& key) {
  for (std::size_t i = 0; i < kMerits.size(); ++i)
    if (kMerits[i].key == key) return found.merits[i];
  ADD_FAILURE() << key;
  return {};
}

TEST(Study, IsTheSameForAnyNumberOfThreads) {
  const std::vector<Draw> one = draws(3, 1), three = draws(3, 3);
  for (std::size_t i = 0; i < one.size(); ++i) EXPECT_TRUE(same(one[i].flights, three[i].flights)) << i;
  EXPECT_FALSE(same(one[0].flights, one[1].flights));
  EXPECT_TRUE(same(draws(2, 2)[1].flights, one[1].flights)) << "a draw does not depend on how many there are";
}

// The gates of 400 draws are in fly_study_test.cpp; these are those of a glance.
TEST(Study, FindsCompensationBetterInAFewDraws) {
  const Findings found = findings_of(draws(6, 2));
  EXPECT_LE(of(found, "hover_z_ratio").p50, 0.45);
  EXPECT_LE(of(found, "forward_ratio").p50, 0.7);
  EXPECT_GE(found.forward_better, 0.8);
  EXPECT_NEAR(of(found, "square_speed_ratio").p50, 1, 0.02);
}

TEST(Percentiles, LieBetweenTheOrderStatistics) {
  const Percentiles found = percentiles({5, 1, 4, 2, 3, 0});
  EXPECT_NEAR(found.p10, 0.5, 1e-12);
  EXPECT_NEAR(found.p50, 2.5, 1e-12);
  EXPECT_NEAR(found.p90, 4.5, 1e-12);
  EXPECT_EQ(percentiles({7}).p10, 7);
  EXPECT_EQ(percentiles({}).p50, 0);
}

TEST(Merits, AreOfTheRightLegsOfTheRightFlights) {
  NineFlights flights;
  for (std::size_t i = 0; i < flights.size(); ++i) {
    for (std::size_t leg = 0; leg < 3; ++leg) {
      const double flight = static_cast<double>(i), part = static_cast<double>(leg);
      flights[i].legs[leg].mean_error = {flight, part, 10 * flight + part};
      flights[i].legs[leg].mean_distance = 100 * flight + part;
      flights[i].legs[leg].mean_square_speed = 1 + part * part;
    }
  }
  const Merits merits = merits_of(flights);
  EXPECT_EQ(merits.hover_z_plain, 1);
  EXPECT_EQ(merits.hover_z_compensated, 11);
  EXPECT_EQ(merits.hover_xy_plain, 1);
  EXPECT_NEAR(merits.hover_xy_compensated, std::sqrt(2.0), 1e-15);
  EXPECT_EQ(merits.forward_x, (300 + 500 + 600 + 800) / 4.0);
  EXPECT_EQ(merits.forward_plain, (301 + 400 + 601 + 700) / 4.0);
  EXPECT_EQ(merits.forward_compensated, (501 + 401 + 801 + 701) / 4.0);
  EXPECT_EQ(merits.square_speed_ratio, 1.5) << "(1 + 5) / (2 * 2)";
  EXPECT_FALSE(merits.lost());
}

/// A draw in which every flight went well: 0.2 m without, `ratio` of it with compensation.
Draw made_up(double ratio) {
  Draw draw{example_scene(), {}};
  for (std::size_t i = 0; i < kExperiments.size(); ++i) {
    draw.flights[i].leg_count = kExperiments[i].leg_count;
    for (std::size_t leg = 0; leg < kExperiments[i].leg_count; ++leg) {
      const bool helped = kExperiments[i].legs[leg].compensated;
      draw.flights[i].legs[leg].mean_error = Eigen::Vector3d(0.1, 0, 0.2) * (helped ? ratio : 1);
      draw.flights[i].legs[leg].mean_distance = 0.2 * (helped ? ratio : 1);
      draw.flights[i].legs[leg].mean_square_speed = 1e6;
    }
  }
  return draw;
}

TEST(Findings, TakeTheSizeOfTheHeightErrorWhicheverSideItIsOn) {
  const Findings found = findings_of({made_up(-0.5)});
  EXPECT_NEAR(of(found, "hover_z_ratio").p50, 0.5, 1e-12);
  EXPECT_NEAR(of(found, "hover_z_compensated_m").p50, -0.1, 1e-12) << "but tell the side";
  EXPECT_EQ(found.hover_z_better, 1);
  const Findings harmed = findings_of({made_up(0.5), made_up(1.5)});
  EXPECT_EQ(harmed.hover_z_better, 0.5) << "a compensation that harms is worse";
  EXPECT_EQ(harmed.forward_better, 0.5);
}

TEST(Findings, CountALostFlightAgainstTheSideThatLostIt) {
  const auto lost_in = [](ExperimentIndex flight, std::size_t leg) {
    Draw draw = made_up(0.5);
    draw.flights[flight].lost = true;
    draw.flights[flight].lost_leg = leg;
    return draw;
  };
  const Draw plain = lost_in(kHoverPlain, 1), compensated = lost_in(kLevelSwitched, 1), in_x = lost_in(kLevelPlain, 0);
  const Findings found = findings_of({made_up(0.5), plain, compensated, in_x});
  EXPECT_EQ(found.draws, 4u);
  EXPECT_EQ(found.kept, 1u);
  EXPECT_EQ(found.by_law[0].kept, 1u);
  EXPECT_NEAR(found.by_law[0].hover_z_ratio, 0.5, 1e-12);
  EXPECT_EQ(found.by_law[1].kept, 0u);
  EXPECT_EQ(found.lost_plain, 1u);
  EXPECT_EQ(found.lost_compensated, 2u);
  EXPECT_EQ(found.forward_better, 0.5) << "the whole one, and the one that only compensation saved";
  EXPECT_EQ(of(found, "forward_ratio").p50, 0.5);
}

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
    const double off = scene.truth.thrust[1] / example_scene().truth.thrust[1] - 1;
    squares += off * off;
  }
  EXPECT_EQ(laws, (std::array<int, kLossLaws>{200, 200, 200})) << "in equal parts";
  EXPECT_NEAR(std::sqrt(squares / 600), 0.01, 0.001);
}

TEST(AssumedWorld, HasTheThrustOfTheFilesPropellerWhereSuchOnesHaveIt) {
  const auto world = [](double k_t, const PropellerKind& kind) {
    const compensation::ThrustCurve curve = *compensation::ThrustCurve::from_line(
        from_newtons_per_rpm2(k_t), from_newtons_per_rpm2(k_t), 0, from_degrees(270));
    return assumed_world(example_vehicle(), kind, {curve, curve, curve, curve});
  };
  EXPECT_NEAR(to_newtons_per_rpm2(published_thrust({5, 3})), 1.7e-8, 1e-20);
  EXPECT_NEAR(to_newtons_per_rpm2(published_thrust({5, 2})), 1.3e-8, 1e-20);
  EXPECT_NEAR(to_newtons_per_rpm2(published_thrust({6, 2})), 2.6e-8, 1e-20);
  EXPECT_NEAR(to_newtons_per_rpm2(published_thrust({6, 3})), 3.1e-8, 1e-20);
  EXPECT_NEAR(published_thrust({10, 3}) / published_thrust({5, 3}), 16 * 3.1 / 1.7 * std::pow(5.0 / 6, 4), 1e-9);
  for (const double measured : {1.11e-8, 1.27e-8, 1.3e-8}) {
    const AssumedWorld two = world(measured, {5, 2});
    EXPECT_TRUE(two.as_in_file) << measured;
    EXPECT_NEAR(to_newtons_per_rpm2(two.truth.thrust_coefficient), measured, 1e-20);
  }
  EXPECT_FALSE(world(2.6e-8, {5, 2}).as_in_file) << "twice what such a propeller has";
  EXPECT_NEAR(to_newtons_per_rpm2(world(2.6e-8, {5, 2}).truth.thrust_coefficient), 1.3e-8, 1e-20);
  EXPECT_TRUE(world(1.2e-8, {}).as_in_file) << "blades unknown: two or three, of the vehicle's size";
  EXPECT_FALSE(world(3.1e-8, {}).as_in_file);
  EXPECT_TRUE(world(3.1e-8, {6, 3}).as_in_file);
}

}  // namespace study_test
}  // namespace kphi::flight
