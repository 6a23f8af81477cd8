// Short campaigns with random faults of every device, mistakes of the operator, a refusing disk and kills: each from
// its seed. What is held of each stands in soak_verdict.hpp; ./run soak lives through ten thousand of them.
#include <gtest/gtest.h>

#include "drivers/sim/script/faults.hpp"
#include "test/soak/soak_verdict.hpp"

namespace kphi::soak::soak_test {

#ifdef KPHI_SANITIZED
constexpr int kSeedsInOne = 5;
#else
constexpr int kSeedsInOne = 50;
#endif

TEST(SoakMixtures, DrawEveryFaultOfEveryDevice) {
  std::string faults;
  for (std::uint64_t seed = 1; seed <= 2000; ++seed) faults += draw(seed).faults;
  // Wrong values of registers are the driver's to find; the deterministic bench has no frames between. One wrong
  // register of the calibration is wrong air, as a warm board beside the sensor is, and nobody can tell. Nor does that
  // bench let an interface of USB go, or have a hand at the supply's keys.
  using K = sim::FaultKind;
  const std::set<K> left_out{K::supply_ignored_writes, K::supply_reads_as, K::ambient_reads_as, K::ambient_warm,
                             K::ambient_slow_close,    K::supply_key,      K::supply_keys_free};
  for (std::size_t i = 0; i < static_cast<std::size_t>(K::usb_wrong_tag); ++i) {
    const std::string name = "kind: " + std::string(sim::name_of(static_cast<K>(i)));
    const bool drawn = faults.find(name + "}") != std::string::npos || faults.find(name + ",") != std::string::npos;
    EXPECT_NE(drawn, left_out.contains(static_cast<K>(i))) << name;
  }
}

TEST(SoakMixtures, AreTheSameFromTheSameSeed) {
  EXPECT_EQ(words(draw(7)), words(draw(7)));
  EXPECT_NE(words(draw(7)), words(draw(8)));
}

struct Steps {
  std::uint64_t clean = 0, flagged = 0;
};

Steps expect_nothing_wrong(std::uint64_t seed) {
  Steps steps;
  live_through(seed, [&](const Evidence& evidence, const Verdict& verdict) {
    steps.clean += verdict.clean_steps;
    steps.flagged += verdict.clean_steps_flagged;
    for (const std::string& line : verdict.wrong)
      ADD_FAILURE() << line << "\n" << words(evidence.mixture) << "again: ./run soak --seed " << seed;
  });
  return steps;
}

class Soak : public testing::TestWithParam<int> {};

TEST_P(Soak, NothingIsWrongWhateverGoesWrong) {
  Steps sum;
  for (int i = 0; i < kSeedsInOne; ++i) {
    const Steps steps = expect_nothing_wrong(static_cast<std::uint64_t>(1 + GetParam() * kSeedsInOne + i));
    sum.clean += steps.clean;
    sum.flagged += steps.flagged;
  }
  EXPECT_TRUE(is_chance(sum.flagged, sum.clean)) << sum.flagged << " of " << sum.clean << " clean steps flagged";
}

INSTANTIATE_TEST_SUITE_P(Some, Soak, testing::Values(0));
INSTANTIATE_TEST_SUITE_P(Long, Soak, testing::Range(1, 10));

/// They were told wrong once, for reasons of their own.
class OnceWrong : public testing::TestWithParam<std::uint64_t> {};

TEST_P(OnceWrong, IsRight) { expect_nothing_wrong(GetParam()); }

INSTANTIATE_TEST_SUITE_P(Seeds, OnceWrong, testing::Values(421, 1619, 2420, 4123, 6724, 6807, 8001));

}  // namespace kphi::soak::soak_test
