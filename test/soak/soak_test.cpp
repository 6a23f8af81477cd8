// Short campaigns with random faults of every device, mistakes of the operator, a refusing disk and kills: each from
// its seed. What is held of each stands in soak_verdict.hpp; ./run soak lives through ten thousand of them.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <set>

#include "drivers/sim/faults.hpp"
#include "drivers/sim/iq_faults.hpp"
#include "drivers/sim/supply_faults.hpp"
#include "drivers/sim/usb_faults.hpp"
#include "test/soak/soak_verdict.hpp"

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

class Soak : public testing::TestWithParam<int> {};

TEST_P(Soak, NothingIsWrongWhateverGoesWrong) {
  int clean = 0, in_doubt = 0;
  for (int i = 0; i < kSeedsInOne; ++i) {
    const Mixture mixture = draw(static_cast<std::uint64_t>(1 + GetParam() * kSeedsInOne + i));
    World world(mixture, quick_folder());
    world.live();
    const Verdict verdict = judge(world);
    clean += verdict.clean_steps;
    in_doubt += verdict.clean_steps_in_doubt;
    for (const std::string& line : verdict.wrong)
      ADD_FAILURE() << line << "\n" << words(mixture) << "again: ./run soak --seed " << mixture.seed;
  }
  EXPECT_LE(20 * in_doubt, clean + 200) << in_doubt << " of " << clean << " clean steps unsettled or drifting";
}

INSTANTIATE_TEST_SUITE_P(Seeds, Soak, testing::Range(0, 10));

}  // namespace
}  // namespace kphi::soak
