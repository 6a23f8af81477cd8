#include "fit/uncertainty/curvature.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace kphi::fit {
namespace {

std::vector<LinePoint> points(double bend, double error = 0.01) {
  std::vector<LinePoint> result;
  for (const double phi : {45.0, 90.0, 180.0, 270.0}) {
    const double u = phi / 270;
    result.push_back({phi, 1 - 0.7 * u + bend * u * u, error});
  }
  return result;
}

TEST(Curvature, OfALineIsNothing) {
  const Curvature found = curvature(points(0), 10);
  EXPECT_NEAR(found.lack_of_fit.value, 0, 1e-12);
  EXPECT_FALSE(found.bends());
  EXPECT_NEAR(found.quadratic_aic - found.linear_aic, 2, 1.5) << "a term for nothing costs two, and a little";
}

TEST(Curvature, OfAParabolaIsMeasured) {
  const Curvature found = curvature(points(0.2), 10);
  EXPECT_TRUE(found.lack_of_fit.rejected());
  EXPECT_TRUE(found.quadratic.rejected());
  EXPECT_NEAR(found.second_order, 0.2 / (270 * 270), 1e-12);
  EXPECT_LT(found.quadratic_aic, found.linear_aic);
  EXPECT_EQ(found.lack_of_fit.freedom, 2);
  EXPECT_EQ(found.quadratic.error_freedom, 10);
  EXPECT_FALSE(curvature(points(0.2, 0.2), 10).bends()) << "the same bend is nothing where the errors are large";
}

TEST(Curvature, OfThreePointsHasOneTest) {
  auto three = points(0.2);
  three.pop_back();
  const Curvature found = curvature(three, 10);
  EXPECT_NEAR(found.lack_of_fit.p, found.quadratic.p, 1e-12);
  three.pop_back();
  EXPECT_FALSE(curvature(three, 10).lack_of_fit.tested());
  EXPECT_FALSE(curvature(points(0.2, 0), 10).bends()) << "without errors nothing can be said";
}

}  // namespace
}  // namespace kphi::fit
