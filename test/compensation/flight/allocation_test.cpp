// Counts what operator new is asked for while a drone flies.
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <new>

#include "test/compensation/flight/flight_fixture.hpp"

namespace {
std::atomic<long> allocations{0};

void* counted_allocation(std::size_t size) {
  ++allocations;
  if (void* memory = std::malloc(size == 0 ? 1 : size)) return memory;
  throw std::bad_alloc();
}
}  // namespace

void* operator new(std::size_t size) { return counted_allocation(size); }
void* operator new[](std::size_t size) { return counted_allocation(size); }
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t) noexcept { std::free(memory); }

namespace kphi::flight {
namespace {

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

}  // namespace
}  // namespace kphi::flight
