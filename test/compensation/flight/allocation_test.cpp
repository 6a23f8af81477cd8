#include <gtest/gtest.h>

#include "test/compensation/counted_allocations.hpp"
#include "test/compensation/flight/flight_fixture.hpp"

namespace kphi::flight {
namespace allocation_test {

TEST(Flight, AllocatesNothing) {
  const Scene scene = example_scene();
  const Shadow& shadow = example_shadow();
  ASSERT_TRUE(allocations_are_counted());
  const long before = allocations.load();
  const FlightResult flight = fly(kExperiments[kHoverCompensated], scene, shadow);
  EXPECT_EQ(allocations.load(), before);
  EXPECT_FALSE(flight.lost);
}

}  // namespace allocation_test
}  // namespace kphi::flight
