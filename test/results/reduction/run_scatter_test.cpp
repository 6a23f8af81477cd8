#include "results/reduction/run_scatter.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <random>
#include <vector>

namespace kphi::results::run_scatter_test {
using namespace testing;

/// Runs of occlusions whose k fall to a quarter, with what scatters them.
struct Stand {
  double share = 0, zero_n = 0, explained_n = 0.003;
  bool offsets = true;
  [[nodiscard]] std::vector<std::vector<RunShare>> draw(std::mt19937& random, int each = 1) const {
    std::normal_distribution<double> normal;
    std::vector<std::vector<RunShare>> occlusions;
    for (int i = 0; i < each; ++i) {
      for (const double per_n : {0.25, 0.28, 0.33, 0.5, 1.0}) {
        occlusions.emplace_back();
        for (int run = 0; run < 3; ++run) {
          const double zero = zero_n * normal(random);
          RunShare one{1 + share * normal(random) + per_n * (zero + explained_n * normal(random)),
                       std::pow(per_n * explained_n, 2), per_n};
          if (offsets) one.offset_n = zero + explained_n * normal(random);
          if (offsets) one.offset_variance = explained_n * explained_n;
          occlusions.back().push_back(one);
        }
      }
    }
    return occlusions;
  }
};

TEST(ScatterBetween, TellsWhatIsInProportionFromWhatAdds) {
  std::mt19937 random(3);
  for (const bool offsets : {true, false}) {
    const auto occlusions = Stand{.share = 0.004, .zero_n = 0.01, .offsets = offsets}.draw(random, 200);
    const RunScatter found = scatter_between(occlusions);
    EXPECT_NEAR(found.share, 0.004, 0.0003) << offsets;
    EXPECT_NEAR(found.zero_n, 0.01, 0.0006) << offsets;
    EXPECT_GT(found.share_freedom, 100);
    EXPECT_LT(found.share_freedom, freedom_between(occlusions));
    const RunScatter expected = scatter_expected(found.share, found.zero_n, occlusions);
    EXPECT_NEAR(expected.share_freedom, found.share_freedom, 1e-6 * found.share_freedom);
  }
}

TEST(ScatterBetween, IsOfOneKindWhereTheOtherIsNot) {
  std::mt19937 random(4);
  const RunScatter mounting = scatter_between(Stand{.share = 0.004}.draw(random, 200)),
                   zero = scatter_between(Stand{.zero_n = 0.01}.draw(random, 200));
  EXPECT_NEAR(mounting.share, 0.004, 0.0003);
  EXPECT_LT(mounting.zero_n, 0.001);
  EXPECT_NEAR(zero.zero_n, 0.01, 0.0005);
  EXPECT_LT(zero.share, 0.0005);
}

// One campaign of five occlusions: what noise and zeros explain is not much exceeded by chance, and what the runs
// scatter beyond it in proportion to k has ten degrees of freedom.
TEST(ScatterBetween, OfOneCampaignIsSmallWhereThereIsNone) {
  std::mt19937 random(5);
  double share = 0, zero = 0, squares = 0;
  for (int i = 0; i < 1000; ++i) {
    const RunScatter found = scatter_between(Stand{}.draw(random));
    share += std::pow(found.share / (0.33 * 0.003), 2) / 1000;
    zero += std::pow(found.zero_n / 0.003, 2) / 1000;
    squares += std::pow(scatter_between(Stand{.share = 0.01}.draw(random)).share / 0.01, 2) / 1000;
  }
  EXPECT_LT(share, 0.15) << "of the variance that noise gives the middle one";
  EXPECT_LT(zero, 0.15) << "of the variance that noise gives";
  EXPECT_NEAR(squares, 1, 0.05);
}

TEST(ScatterBetween, IsNothingWithoutRepetitions) {
  const std::vector<std::vector<RunShare>> none, once{{{1, 1e-6, 0.2}}, {{1, 1e-6, 0.4}}};
  EXPECT_EQ(freedom_between(once), 0);
  for (const auto& occlusions : {none, once}) {
    EXPECT_EQ(scatter_between(occlusions).share, 0);
    EXPECT_EQ(scatter_between(occlusions).zero_n, 0);
  }
  const std::vector<std::vector<RunShare>> equal{{{1, 0}, {1, 0}, {1, 0}}};
  EXPECT_EQ(scatter_between(equal).share, 0);
  EXPECT_EQ(freedom_between(equal), 2);
}

}  // namespace kphi::results::run_scatter_test
