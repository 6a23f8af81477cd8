#include "base/ordered_work.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <latch>
#include <stdexcept>
#include <vector>

namespace kphi {
namespace ordered_work_test {

using ::testing::ElementsAre;

TEST(OrderedWork, IsTakenInTheOrderOfAddingWhicheverEndsFirst) {
  std::vector<int> taken;
  OrderedWork<int> work([&](int one) { taken.push_back(one); });
  std::latch second_began(1);
  if (std::thread::hardware_concurrency() < 2)
    second_began.count_down();  // the first is taken before the second begins
  work.add(std::launch::async, [&] {
    second_began.wait();
    return 1;
  });
  work.add(std::launch::async, [&] {
    if (!second_began.try_wait()) second_began.count_down();
    return 2;
  });
  work.add(std::launch::deferred, [] { return 3; });
  work.finish();
  EXPECT_THAT(taken, ElementsAre(1, 2, 3));
}

TEST(OrderedWork, ThrowsWhatAPieceThrowsWhenItsTurnHasCome) {
  std::vector<int> taken;
  OrderedWork<int> work([&](int one) { taken.push_back(one); });
  work.add(std::launch::deferred, [] { return 1; });
  work.add(std::launch::deferred, []() -> int { throw std::runtime_error("no"); });
  EXPECT_THROW(work.finish(), std::runtime_error);
  EXPECT_THAT(taken, ElementsAre(1));
}

}  // namespace ordered_work_test
}  // namespace kphi
