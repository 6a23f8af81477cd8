#include "daq/guard/cell_trust.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <random>

namespace kphi::daq {
namespace cell_trust_test {

using testing::HasSubstr;

/// A cell with noise of `counts` around a level that moves slowly, rounded to counts; `memory`: share of the last
/// sample's noise that the next one keeps, as behind a filter.
class Cell {
 public:
  explicit Cell(double counts, double memory = 0, unsigned seed = 1)
      : counts_(counts), memory_(memory), random_(seed) {}
  std::array<std::int32_t, 6> next() {
    std::array<std::int32_t, 6> all{};
    for (std::size_t axis = 0; axis < all.size(); ++axis) {
      noise_[axis] = memory_ * noise_[axis] + std::sqrt(1 - memory_ * memory_) * normal_(random_);
      const double level = 5 * std::sin(1e-5 * static_cast<double>(n_)) + 0.1 * static_cast<double>(axis);
      all[axis] = static_cast<std::int32_t>(std::lround(level + counts_ * noise_[axis]));
    }
    ++n_;
    return all;
  }

 private:
  const double counts_, memory_;
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
  std::array<double, 6> noise_{};
  std::uint64_t n_ = 0;
};

/// Which has learnt the noise of a zero of a second.
FrozenWatch learnt(Cell& cell, double rate_hz = 7000) {
  FrozenWatch watch(rate_hz);
  watch.learn(true);
  for (int i = 0; i < std::max(100.0, rate_hz); ++i) (void)watch.take(cell.next());
  watch.learn(false);
  return watch;
}

TEST(FrozenWatch, CallsNoLivingCellFrozenHoweverQuietCoarseOrFiltered) {
  for (const double counts : {0.0, 0.02, 0.1, 0.3, 0.5, 0.7, 1.0, 3.0, 1000.0})
    for (const double memory : {0.0, 0.9, 0.97, 0.999}) {
      Cell cell(counts, memory);
      FrozenWatch watch = learnt(cell);
      for (int i = 0; i < 500'000; ++i) ASSERT_FALSE(watch.take(cell.next())) << counts << " " << memory << " " << i;
    }
}

TEST(FrozenWatch, FindsWhatStandsStillWithinFiftyMilliseconds) {
  for (std::size_t axis = 0; axis < 6; ++axis) {
    Cell cell(1000);
    FrozenWatch watch = learnt(cell);
    EXPECT_EQ(watch.limit(axis), 350u);
    std::array<std::int32_t, 6> counts = cell.next();
    const std::int32_t frozen = counts[axis];
    (void)watch.take(counts);
    int samples = 0;
    for (std::optional<std::size_t> found; !found; ++samples) {
      ASSERT_LT(samples, 400);
      counts = cell.next();
      counts[axis] = frozen;
      found = watch.take(counts);
      EXPECT_EQ(found.value_or(axis), axis);
    }
    EXPECT_EQ(samples, 350);
  }
}

TEST(FrozenWatch, CountsRecordsOfASlowCell) {
  Cell cell(3);
  FrozenWatch watch = learnt(cell, 80);
  ASSERT_TRUE(watch.limit(2));
  EXPECT_LE(*watch.limit(2), 20u) << "a quarter of a second";
  EXPECT_GE(*watch.limit(2), 5u);
}

TEST(FrozenWatch, NoticesACellThatFroze) {
  Cell cell(50);
  FrozenWatch watch(7000);
  watch.learn(true);
  for (int i = 0; i < 3000; ++i) (void)watch.take(cell.next());
  const std::array<std::int32_t, 6> frozen = cell.next();
  for (int i = 0; i < 4000; ++i) (void)watch.take(frozen);
  watch.learn(false);
  EXPECT_TRUE(watch.take(frozen)) << "in the zero itself";
}

TEST(FrozenWatch, KnowsNothingOfACellWithoutNoise) {
  Cell cell(0);
  EXPECT_EQ(learnt(cell).limit(2), std::nullopt) << "such a zero is refused: sequence_test";
}

std::optional<std::string> doubt(double thrust_n, double rpm, const ThrustExpectation& expected,
                                 double torque_nm = -0.02) {
  ThrustWatch watch(7000);
  watch.begin(from_rpm(rpm));
  for (int i = 0; i < 699; ++i) EXPECT_FALSE(watch.add(thrust_n, torque_nm));
  EXPECT_TRUE(watch.add(thrust_n, torque_nm));
  EXPECT_FALSE(watch.add(thrust_n, torque_nm)) << "once a step";
  return watch.doubt(+1, expected);
}

TEST(ThrustWatch, SaysWhatToCheckWhereThrustIsMirroredOrMissing) {
  const ThrustExpectation expected{0.1, 0.6e-6};
  EXPECT_EQ(doubt(0.6, 6000, expected), std::nullopt);
  EXPECT_THAT(*doubt(-0.6, 6000, expected, +0.02), HasSubstr("at 6000 RPM: thrust is negative, and so is the sense of "
                                                             "the torque: mirror thrust_axis"));
  EXPECT_THAT(*doubt(-0.6, 6000, expected, -0.02), HasSubstr("the propeller pushes"));
  EXPECT_THAT(*doubt(-0.6, 6000, expected, 0), HasSubstr("check thrust_axis"));
  EXPECT_THAT(*doubt(0.01, 10000, expected), HasSubstr("at least 0.66 N expected: is the propeller mounted"));
}

TEST(ThrustWatch, SaysNothingWhereTooLittleIsExpected) {
  EXPECT_EQ(doubt(0.01, 2000, {0.1, 0.6e-6}), std::nullopt) << "at a low speed";
  EXPECT_EQ(doubt(-0.09, 6000, {0.1, 0}), std::nullopt) << "within the noise, of an unknown propeller";
  EXPECT_NE(doubt(-0.6, 6000, {0.1, 0}), std::nullopt) << "the sign needs no estimate";
  EXPECT_EQ(doubt(-0.6, 6000, {}), std::nullopt) << "nothing is expected";
}

TEST(DoubtAboutSigns, TellsMirroredAxisPushingPropellerAndWrongSenseApart) {
  EXPECT_EQ(doubt_about_signs(6, -0.08, +1), std::nullopt);
  EXPECT_EQ(doubt_about_signs(6, +0.08, -1), std::nullopt);
  EXPECT_EQ(doubt_about_signs(0.01, 0.08, +1), std::nullopt) << "too little to say";
  EXPECT_EQ(doubt_about_signs(std::nan(""), std::nan(""), +1), std::nullopt);
  EXPECT_THAT(*doubt_about_signs(-6, +0.08, +1), HasSubstr("mirror thrust_axis"));
  EXPECT_THAT(*doubt_about_signs(-6, -0.08, +1), HasSubstr("the propeller pushes"));
  EXPECT_THAT(*doubt_about_signs(6, +0.08, +1), HasSubstr("turns the other way"));
}

}  // namespace cell_trust_test
}  // namespace kphi::daq
