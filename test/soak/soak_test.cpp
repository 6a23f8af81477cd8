// Short campaigns with random faults of every device, mistakes of the operator, a refusing disk and kills: each from
// its seed. What is held of each stands in soak_verdict.hpp; ./run soak lives through ten thousand of them.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "test/soak/soak_verdict.hpp"

namespace kphi::soak {
namespace {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr int kSeedsInOne = 5;
#else
constexpr int kSeedsInOne = 50;
#endif

class Soak : public testing::TestWithParam<int> {};

TEST_P(Soak, NothingIsWrongWhateverGoesWrong) {
  for (int i = 0; i < kSeedsInOne; ++i) {
    const Mixture mixture = draw(static_cast<std::uint64_t>(1 + GetParam() * kSeedsInOne + i));
    World world(mixture, quick_folder());
    world.live();
    for (const std::string& line : judge(world))
      ADD_FAILURE() << line << "\n" << words(mixture) << "again: ./run soak --seed " << mixture.seed;
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, Soak, testing::Range(0, 10));

}  // namespace
}  // namespace kphi::soak
