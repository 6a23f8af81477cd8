#include "compensation/convex_polygon.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <type_traits>
#include <vector>

#include "compensation/occlusion.hpp"
#include "test/compensation/example_vehicle.hpp"
#include "test/compensation/geometry_vectors.hpp"

namespace kphi::compensation {
namespace convex_polygon_test {

constexpr OverlapMeasure kMeasures[] = {OverlapMeasure::rim_arc, OverlapMeasure::area_share,
                                        OverlapMeasure::load_share};

ConvexPolygon polygon(const std::vector<Position>& corners) {
  return ConvexPolygon::from(corners.data(), corners.size()).value();
}

double phi(const ConvexPolygon& body, double radius, double x, double y, OverlapMeasure measure) {
  return occlusion_angle(body, Metres(radius), at(x, y), measure).value();
}

bool contains(const ConvexPolygon& body, double x, double y) {
  for (std::size_t i = 0; i < body.size(); ++i) {
    const Position &a = body.corner(i), &b = body.corner((i + 1) % body.size());
    if ((b.x - a.x).value() * (y - a.y.value()) - (b.y - a.y).value() * (x - a.x.value()) < 0) return false;
  }
  return true;
}

/// Counts rings and directions of the disk, weighing rings by r (area) or r² (load): a coarse second opinion.
double counted(const ConvexPolygon& body, double radius, double x, double y, OverlapMeasure measure) {
  constexpr int kRings = 40, kDirections = 600;
  double covered = 0, all = 0;
  for (int ring = 0; ring < kRings; ++ring) {
    const double r = measure == OverlapMeasure::rim_arc ? radius : radius * (ring + 0.5) / kRings;
    const double weight = measure == OverlapMeasure::load_share ? r * r : r;
    for (int i = 0; i < kDirections; ++i) {
      const double t = 2 * kPi * (i + 0.5) / kDirections;
      all += weight;
      if (contains(body, x + r * std::cos(t), y + r * std::sin(t))) covered += weight;
    }
  }
  return 2 * kPi * covered / all;
}

TEST(ConvexPolygon, AgreesWithTheKnownAnswersInAllThreeMeasures) {
  for (const GeometryVector& v : geometry_vectors()) {
    const ConvexPolygon body = ConvexPolygon::square(Metres(v.half_side));
    expect_known_arc(phi(body, v.radius, v.hub_x, v.hub_y, OverlapMeasure::rim_arc), v);
    EXPECT_NEAR(phi(body, v.radius, v.hub_x, v.hub_y, OverlapMeasure::area_share), v.phi_area, 1e-12) << v.kind;
    EXPECT_NEAR(phi(body, v.radius, v.hub_x, v.hub_y, OverlapMeasure::load_share), v.phi_load, 1e-8) << v.kind;
  }
}

TEST(ConvexPolygon, AgreesWithTheClosedFormOfTheSquare) {
  std::mt19937_64 random(31);
  std::uniform_real_distribution<double> side(0.01, 0.15), radius(0.03, 0.12), place(-0.2, 0.2);
  int touching = 0;
  for (int i = 0; i < 100000; ++i) {
    const double a = side(random), r = radius(random), x = place(random), y = place(random);
    const double general = phi(ConvexPolygon::square(Metres(a)), r, x, y, OverlapMeasure::rim_arc);
    // Both have the slope of a root at tangency: rounding of 1e-16 may show there as 1e-8.
    ASSERT_NEAR(general, rim_arc(Metres(a), Metres(r), Metres(x), Metres(y)).value(), 1e-7);
    touching += general > 0;
  }
  EXPECT_GT(touching, 20000);
}

TEST(ConvexPolygon, AgreesWithCountingOnRandomOutlines) {
  std::mt19937_64 random(32);
  std::uniform_real_distribution<double> size(0.03, 0.15), radius(0.04, 0.12), place(-0.15, 0.15), turn(0, 6);
  std::uniform_int_distribution<std::size_t> corners(3, ConvexPolygon::kMaxCorners);
  for (int i = 0; i < 60; ++i) {
    const ConvexPolygon body = regular_polygon(corners(random), size(random), turn(random));
    const double r = radius(random), x = place(random), y = place(random);
    for (const OverlapMeasure measure : kMeasures) {
      EXPECT_NEAR(phi(body, r, x, y, measure), counted(body, r, x, y, measure), 0.1) << name_of(measure);
    }
  }
}

TEST(ConvexPolygon, HasTheSamePhiInAllMeasuresWhereTheBodyIsASectorOfTheDisk) {
  for (const double sector : {0.3, kPi / 4, kPi / 2, 2.5}) {
    const ConvexPolygon wedge = polygon({at(0, 0), at(5, 0), at(5 * std::cos(sector), 5 * std::sin(sector))});
    for (const OverlapMeasure measure : kMeasures) {
      EXPECT_NEAR(phi(wedge, 0.5, 0, 0, measure), sector, 1e-12) << name_of(measure);
    }
  }
  for (const OverlapMeasure measure : kMeasures) {
    EXPECT_NEAR(phi(ConvexPolygon::square(Metres(1)), 0.1, 1, 0, measure), kPi, 1e-12);
  }
}

TEST(ConvexPolygon, IsExactlyZeroApartAndAWholeTurnOverTheBody) {
  for (const OverlapMeasure measure : kMeasures) {
    EXPECT_EQ(phi(regular_polygon(7, 0.1), 0.05, 0.2, 0.1, measure), 0.0);
    EXPECT_EQ(phi(regular_polygon(7, 0.1), 0.05, 0.0, 0.01, measure), 2 * kPi);
  }
}

TEST(ConvexPolygon, CountsABodyWhollyUnderTheDiskByAreaAndLoadButNotByItsRim) {
  const ConvexPolygon body = ConvexPolygon::square(Metres(0.02));
  EXPECT_EQ(phi(body, 0.0635, 0.003, 0, OverlapMeasure::rim_arc), 0.0);
  EXPECT_NEAR(phi(body, 0.0635, 0.003, 0, OverlapMeasure::area_share), 2 * 0.04 * 0.04 / (0.0635 * 0.0635), 1e-12);
  EXPECT_LT(phi(body, 0.0635, 0, 0, OverlapMeasure::load_share), phi(body, 0.0635, 0, 0, OverlapMeasure::area_share));
}

TEST(ConvexPolygon, DoesNotCareForTurningMovingOrScalingBodyAndDiskTogether) {
  std::mt19937_64 random(33);
  std::uniform_real_distribution<double> place(-0.15, 0.15), turn(0, 6);
  for (int i = 0; i < 2000; ++i) {
    const double t = turn(random), x = place(random), y = place(random);
    const ConvexPolygon body = regular_polygon(5, 0.08), turned = regular_polygon(5, 0.16, t);
    const double turned_x = 2 * (x * std::cos(t) - y * std::sin(t)), turned_y = 2 * (x * std::sin(t) + y * std::cos(t));
    for (const OverlapMeasure measure : kMeasures) {
      EXPECT_NEAR(phi(body, 0.07, x, y, measure), phi(turned, 0.14, turned_x, turned_y, measure), 1e-7);
    }
  }
}

TEST(ConvexPolygon, IsNeverNaN) {
  const double odd[] = {kNaN, kInfinity, -kInfinity, 1e300, -1e300, 0.0, 5e-324, 0.05};
  for (int i = 0; i < 8 * 8 * 8; ++i) {
    for (const OverlapMeasure measure : kMeasures) {
      const double r = odd[i / 64], x = odd[i / 8 % 8], y = odd[i % 8],
                   angle = phi(regular_polygon(6, 0.1), r, x, y, measure);
      EXPECT_TRUE(angle >= 0 && angle <= 2 * kPi) << angle << " at " << r << ' ' << x << ' ' << y;
    }
  }
}

TEST(ConvexPolygon, CannotExistInvalid) {
  const auto made = [](const std::vector<Position>& corners) {
    return ConvexPolygon::from(corners.data(), corners.size()).has_value();
  };
  EXPECT_TRUE(made({at(0, 0), at(1, 0), at(0, 1)}));
  EXPECT_FALSE(made({at(0, 0), at(0, 1), at(1, 0)})) << "clockwise";
  EXPECT_FALSE(made({at(0, 0), at(1, 0)}));
  EXPECT_FALSE(made({at(0, 0), at(1, 0), at(2, 1e-10), at(0, 1)})) << "a corner on the line of its neighbours";
  EXPECT_FALSE(made({at(0, 0), at(2, 0), at(0.5, 0.5), at(0, 2)})) << "a dent";
  EXPECT_FALSE(made({at(0, 0), at(1, 0), at(1, 0), at(0, 1)})) << "a corner twice";
  for (const double bad : {kNaN, kInfinity}) EXPECT_FALSE(made({at(0, 0), at(1, bad), at(0, 1)}));
  EXPECT_FALSE(made(std::vector<Position>(ConvexPolygon::kMaxCorners + 1, at(0, 0))));
  std::vector<Position> star;
  for (int i = 0; i < 5; ++i) star.push_back(at(std::cos(4 * kPi * i / 5), std::sin(4 * kPi * i / 5)));
  EXPECT_FALSE(made(star)) << "every corner a left turn, but twice round";
  static_assert(!std::is_default_constructible_v<ConvexPolygon>);
}

TEST(OverlapMeasure, IsNamedAsInTheFiles) {
  for (const OverlapMeasure measure : kMeasures) EXPECT_EQ(overlap_measure_named(name_of(measure)), measure);
  EXPECT_EQ(name_of(OverlapMeasure::rim_arc), "rim_arc");
  EXPECT_EQ(overlap_measure_named("rim arc"), std::nullopt);
  EXPECT_EQ(name_of(static_cast<OverlapMeasure>(7)), "unknown");
}

}  // namespace convex_polygon_test
}  // namespace kphi::compensation
