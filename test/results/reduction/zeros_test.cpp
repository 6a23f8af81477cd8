#include "results/reduction/zeros.hpp"

#include <gmock/gmock.h>

#include "test/results/synthetic_run.hpp"

namespace kphi::results::zeros_test {

using namespace test;
using namespace testing;

struct Built {
  explicit Built(const Truth& truth) : run(make_run(truth)) {}
  explicit Built(RunRecording recording) : run(std::move(recording)) {}
  RunRecording run;
  LoadCellColumns columns{run.load_cell, run.header};
  CellStream cell{run, columns};
  MotorSeries motor{run.motor};
  Zeros zeros{run, cell, motor};
};

TEST(Zeros, LieOnALineBetweenBeforeAndAfter) {
  Truth truth;
  truth.noise_n = 0.001;
  truth.drift_n_per_s = 0.01;
  const Built built(truth);
  for (const double t : {1.0, 4.0, 8.0}) {
    EXPECT_NEAR(built.zeros.at(1e9 * t, 0).force, 1e6 * (truth.zero_force_n + 0.01 * t), 300) << t;
  }
}

TEST(Zeros, AreLeastCertainNearEachAndMoreBetweenThem) {
  const Built built(Truth{});
  const double at_one = built.zeros.at(0.5e9, 0).u;
  const double between = built.zeros.at(5e9, 0).u;
  EXPECT_NEAR(at_one, 1e6 * 0.02 / std::sqrt(1000.0), 300);
  EXPECT_NEAR(between, at_one / std::sqrt(2.0), 0.3 * at_one) << "there both count half";
}

TEST(Zeros, HaveEachItsOwnUncertainty) {
  RunRecording run = make_run({});
  std::mt19937 random(1);
  std::int32_t wander = 0;
  for (std::size_t i = run.load_cell.size() / 2; i < run.load_cell.size(); ++i) {
    if (i % 10 == 0) wander = random() % 2 == 0 ? 40000 : -40000;
    run.load_cell[i].counts[2] += wander;
  }
  const Built built(run);
  const double end = 0.5e9 + static_cast<double>(run.phases[run.phases.size() - 2].time_ns);
  EXPECT_NEAR(built.zeros.at(0.5e9, 0).u, 1e6 * 0.02 / std::sqrt(1000.0), 300);
  EXPECT_GT(built.zeros.at(end, 0).u, 1.5 * built.zeros.at(0.5e9, 0).u);
  EXPECT_GT(built.zeros.largest_u(), 1.5 * built.zeros.at(0.5e9, 0).u);
  EXPECT_NEAR(built.zeros.largest_deviation(), 1e6 * std::hypot(0.02, 0.04), 1000);
}

TEST(Zeros, PayADegreeOfFreedomForTheTrendOfANoiseThatSwings) {
  RunRecording run = make_run({});
  for (std::size_t i = 0; i < run.load_cell.size(); ++i) run.load_cell[i].counts[2] += i / 10 % 2 == 0 ? 1e6 : -1e6;
  EXPECT_NEAR(Built(run).zeros.at(0.5e9, 0).freedom, 11, 1e-6) << "twelve waves";
}

TEST(Zeros, MayMoveByHalfAPercentOfTheLargestThrust) {
  EXPECT_DOUBLE_EQ(tolerated_drift(10), 0.05);
  EXPECT_DOUBLE_EQ(tolerated_drift(1), 0.02);
}

TEST(Zeros, AreNoLessCertainForDrifting) {
  Truth truth;
  truth.zero_s = 8;
  const double still = Built(truth).zeros.largest_u();
  truth.drift_n_per_s = 0.003;
  EXPECT_NEAR(Built(truth).zeros.largest_u(), still, 0.01 * still);
}

TEST(ZeroCheck, SaysNothingOfAGoodZero) {
  EXPECT_THAT((ZeroCheck{0.001, 0.02, 0.03, false, 0.001}.reasons()), IsEmpty());
}

TEST(ZeroCheck, SaysWhyAZeroIsRefused) {
  EXPECT_THAT((ZeroCheck{0.03, 0.02, 0.03, false, 0.001}.reasons()), ElementsAre(HasSubstr("moved by 0.03 N")));
  EXPECT_THAT((ZeroCheck{0.001, 0.02, 2.0, false, 0.001}.reasons()), ElementsAre(HasSubstr("scatter by 2 N")));
  EXPECT_THAT((ZeroCheck{0.001, 0.02, 0.1, false, 0.011}.reasons()), ElementsAre(HasSubstr("known to 0.011 N only")));
  EXPECT_THAT((ZeroCheck{0, 0.02, 0.1, true, 0.001}.reasons()), ElementsAre(HasSubstr("only one")));
}

TEST(ZeroCheck, RefusesAZeroThatWandersThoughItsSamplesScatterLittle) {
  Truth truth;
  truth.zero_s = 3;
  truth.correlated_n = 0.08;
  truth.correlation_s = 0.1;
  const Built built(truth);
  const ZeroCheck check{0, tolerated_drift(1), 1e-6 * built.zeros.largest_deviation(), false,
                        1e-6 * built.zeros.largest_u()};
  EXPECT_LT(check.deviation_n, kNoisyZero);
  EXPECT_TRUE(check.noisy());
}

}  // namespace kphi::results::zeros_test
