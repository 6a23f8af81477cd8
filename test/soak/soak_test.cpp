// Short campaigns with random faults of every device, mistakes of the operator, a refusing disk and kills: each from
// its seed. What is held of each stands in soak_verdict.hpp; ./run soak lives through ten thousand of them.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <set>

#include "drivers/sim/faults.hpp"
#include "drivers/sim/iq_faults.hpp"
#include "drivers/sim/supply_faults.hpp"
#include "drivers/sim/usb_faults.hpp"
#include "test/soak/soak_lives.hpp"

namespace kphi::soak {
namespace {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr int kSeedsInOne = 5;
#else
constexpr int kSeedsInOne = 50;
#endif

/// The kinds of one script that some entry of `faults` has, by name.
template <class Kind>
void expect_all_drawn(Kind last, const std::string& prefix, const std::string& faults, std::set<Kind> left_out = {}) {
  for (int i = 0; i <= static_cast<int>(last); ++i) {
    const auto kind = static_cast<Kind>(i);
    const std::string name = prefix + std::string(sim::name_of(kind));
    const bool drawn = faults.find("kind: " + name + "}") != std::string::npos ||
                       faults.find("kind: " + name + ",") != std::string::npos;
    EXPECT_NE(drawn, left_out.contains(kind)) << name;
  }
}

TEST(SoakMixtures, DrawEveryFaultOfEveryDevice) {
  std::string faults;
  for (std::uint64_t seed = 1; seed <= 2000; ++seed) faults += draw(seed).faults;
  expect_all_drawn(sim::FaultKind::tcp_short, "", faults);
  expect_all_drawn(sim::MotorFaultKind::locked, "", faults);
  // Wrong values of registers are the driver's to find; the deterministic bench has no frames between.
  expect_all_drawn(sim::SupplyFaultKind::sag, "", faults,
                   {sim::SupplyFaultKind::ignored_writes, sim::SupplyFaultKind::reads_as});
  // One wrong register of the calibration is wrong air, and nobody can tell.
  expect_all_drawn(sim::UsbFaultKind::stuck_bus, "ambient_", faults);
}

TEST(SoakMixtures, AreTheSameFromTheSameSeed) {
  EXPECT_EQ(words(draw(7)), words(draw(7)));
  EXPECT_NE(words(draw(7)), words(draw(8)));
}

struct Steps {
  std::uint64_t clean = 0, in_doubt = 0;
};

Steps expect_nothing_wrong(std::uint64_t seed) {
  Steps steps;
  live_through(seed, [&](const Evidence& evidence, const Verdict& verdict) {
    steps.clean += verdict.clean_steps;
    steps.in_doubt += verdict.clean_steps_in_doubt;
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
    sum.in_doubt += steps.in_doubt;
  }
  EXPECT_TRUE(is_chance(sum.in_doubt, sum.clean)) << sum.in_doubt << " of " << sum.clean << " clean steps in doubt";
}

INSTANTIATE_TEST_SUITE_P(Seeds, Soak, testing::Range(0, 10));

/// They were told wrong once, for reasons of their own.
class OnceWrong : public testing::TestWithParam<std::uint64_t> {};

TEST_P(OnceWrong, IsRight) { expect_nothing_wrong(GetParam()); }

INSTANTIATE_TEST_SUITE_P(Seeds, OnceWrong, testing::Values(421, 1619, 2420, 4123, 6724, 6807, 8001));

}  // namespace
}  // namespace kphi::soak
