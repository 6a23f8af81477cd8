#include "daq/guard/interlock.hpp"

#include <gtest/gtest.h>

#include <string>
#include <thread>
#include <vector>

namespace kphi::daq {
namespace {

const GuardLimit kThrust{Watched::thrust, "thrust", 20, "N", "campaign limits.thrust_max_n"};

TEST(Trip, SaysValueLimitAndSource) {
  const Trip trip = passed(kThrust, 21.3, Instant(5));
  EXPECT_EQ(trip.reason, "thrust 21.3 N is above 20 N (campaign limits.thrust_max_n)");
  EXPECT_EQ(trip.watched, Watched::thrust);
  EXPECT_EQ(trip.value, 21.3);
  EXPECT_EQ(trip.limit, kThrust);
  EXPECT_EQ(trip.sample, Instant(5));
}

TEST(Trip, SaysRevolutionsAsPeopleReadThem) {
  const GuardLimit speed{Watched::speed, "speed", 20055, "RPM", "campaign"};
  EXPECT_EQ(passed(speed, 20500.4, Instant(0)).reason, "speed 20500 RPM is above 20055 RPM (campaign)");
}

TEST(Trip, SaysWhichLimitIsALowerOne) {
  const GuardLimit low{Watched::supply_voltage_low, "supply voltage", 5, "V", "device", true};
  EXPECT_EQ(passed(low, 4.2, Instant(0)).reason, "supply voltage 4.2 V is below 5 V (device)");
}

TEST(Trip, SaysHowMuchOfItsRangeTheCellCarries) {
  const GuardLimit range{Watched::torque_y, "Ty", kRangeBorne * 1.0, "N m", "device"};
  EXPECT_EQ(passed(range, 1.15, Instant(0)).reason, "load cell: Ty carries 115 % of its range of 1 N m");
}

TEST(Latch, HoldsTheFirstTrip) {
  Latch latch;
  EXPECT_EQ(latch.trip(), nullptr);
  EXPECT_NO_THROW(latch.check());
  EXPECT_TRUE(latch.set({"first"}));
  EXPECT_FALSE(latch.set({"second"}));
  ASSERT_NE(latch.trip(), nullptr);
  EXPECT_EQ(latch.trip()->reason, "first");
  EXPECT_THROW(latch.check(), SafetyStop);
}

TEST(Latch, HoldsOneOfThoseThatMeet) {
  for (int round = 0; round < 200; ++round) {
    Latch latch;
    std::atomic<int> firsts{0};
    std::vector<std::thread> threads;
    for (const char* reason : {"one", "two", "three"})
      threads.emplace_back([&latch, &firsts, reason] { firsts += latch.set({reason}); });
    for (auto& thread : threads) thread.join();
    EXPECT_EQ(firsts, 1);
    EXPECT_NE(latch.trip(), nullptr);
  }
}

}  // namespace
}  // namespace kphi::daq
