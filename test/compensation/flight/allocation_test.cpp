#include <gtest/gtest.h>

#include "test/compensation/counted_allocations.hpp"
#include "test/compensation/flight/flight_fixture.hpp"

namespace kphi::flight {
namespace allocation_test {

TEST(Flight, AllocatesNothing) {
  const Scene scene = example_scene();
  const Shadow& shadow = example_shadow();
  const long before_control = allocations.load();
  delete new int;
  ASSERT_GT(allocations.load(), before_control) << "the count must see an allocation at all";
  const long before = allocations.load();
  const FlightResult flight = fly(kExperiments[kHoverCompensated], scene, shadow);
  EXPECT_EQ(allocations.load(), before);
  EXPECT_FALSE(flight.lost);
}

}  // namespace allocation_test
}  // namespace kphi::flight
