#include "fit/numerics/linear_regression.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "base/error.hpp"
#include "test/source_dir.hpp"

namespace kphi::fit {
namespace linear_regression_test {

struct Certified {
  bool polynomial = false;
  int lowest = 0, highest = 0;
  std::vector<double> estimates, errors, y;
  double residual_deviation = 0;
  std::vector<std::vector<double>> x;
};

Certified read(const std::string& name) {
  std::ifstream file(
      (std::filesystem::path(kphi::test::source_dir()) / "test/fit/nist" / name).replace_extension("txt"));
  Certified set;
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line);
    std::string word;
    words >> word;
    if (word == "model") {
      words >> word;
      set.polynomial = word == "polynomial";
      words >> set.lowest >> set.highest;
    } else if (word == "certified") {
      double estimate = 0, error = 0;
      words >> estimate >> error;
      set.estimates.push_back(estimate);
      set.errors.push_back(error);
    } else if (word == "residual_deviation") {
      words >> set.residual_deviation;
    } else if (word == "data") {
      double y = 0;
      words >> y;
      set.y.push_back(y);
      set.x.emplace_back();
      for (double x = 0; words >> x;) set.x.back().push_back(x);
    }
  }
  return set;
}

Regression fit(const Certified& set) {
  if (set.polynomial) {
    std::vector<double> x;
    for (const auto& row : set.x) x.push_back(row.front());
    return regress_polynomial(x, set.y, set.lowest, set.highest);
  }
  std::vector<std::vector<double>> rows;
  for (const auto& row : set.x) {
    rows.push_back({1});
    rows.back().insert(rows.back().end(), row.begin(), row.end());
  }
  return regress(rows, set.y);
}

/// Digits that agree; of a certified 0 those before which the number found is 0.
double digits(double found, double certified) {
  const double error = certified == 0 ? std::abs(found) : std::abs(found / certified - 1);
  return error == 0 ? 16 : -std::log10(error);
}

class NistReference : public ::testing::TestWithParam<const char*> {};

TEST_P(NistReference, IsReproducedToTenDigits) {
  const Certified set = read(GetParam());
  ASSERT_FALSE(set.y.empty());
  const Regression found = fit(set);
  ASSERT_EQ(found.estimates.size(), set.estimates.size());
  for (std::size_t i = 0; i < set.estimates.size(); ++i) {
    EXPECT_GE(digits(found.estimates[i], set.estimates[i]), 10) << "term " << i;
    EXPECT_GE(digits(found.standard_errors[i], set.errors[i]), 9) << "error of term " << i;
  }
  EXPECT_GE(digits(found.residual_deviation, set.residual_deviation), 9);
}

INSTANTIATE_TEST_SUITE_P(LinearRegression, NistReference,
                         ::testing::Values("Norris", "Pontius", "NoInt1", "NoInt2", "Filip", "Longley", "Wampler1",
                                           "Wampler2", "Wampler3", "Wampler4", "Wampler5"),
                         [](const auto& set) { return std::string(set.param); });

TEST(LinearRegression, WeighsAsRepeatingAPointWould) {
  const std::vector<double> x{1, 2, 3, 4}, y{1.1, 1.9, 3.2, 3.9}, weights{1, 3, 1, 1};
  const std::vector<double> longer_x{1, 2, 2, 2, 3, 4}, longer_y{1.1, 1.9, 1.9, 1.9, 3.2, 3.9};
  const Regression weighted = regress_polynomial(x, y, 0, 1, weights);
  const Regression repeated = regress_polynomial(longer_x, longer_y, 0, 1);
  for (int i : {0, 1}) EXPECT_NEAR(weighted.estimates[i], repeated.estimates[i], 1e-15);
  EXPECT_NEAR(weighted.weighted_squares, repeated.weighted_squares, 1e-15);
}

TEST(LinearRegression, RefusesWhatCannotBeToldApart) {
  EXPECT_THROW((void)regress({{1, 2}, {2, 4}, {3, 6}}, std::vector<double>{1, 2, 3}), FitError);
  EXPECT_THROW((void)regress({{1, 2}}, std::vector<double>{1}), FitError);
  EXPECT_THROW((void)regress({{1, 0}, {2, 0}}, std::vector<double>{1, 2}), FitError);
  EXPECT_THROW((void)regress({}, {}), FitError);
}

}  // namespace linear_regression_test
}  // namespace kphi::fit
