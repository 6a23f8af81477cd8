#include "daq/virtual/deterministic_air.hpp"

#include <gmock/gmock.h>

#include "base/error.hpp"

namespace kphi::daq {
namespace deterministic_air_test {

using namespace std::chrono_literals;

constexpr sim::TrueAir kAir{18, 102689, 0.45};

sim::Fault unplugged(Instant at, Duration lasts) {
  sim::Fault fault;
  fault.kind = sim::FaultKind::ambient_unplug;
  fault.at = at;
  fault.lasts = lasts;
  return fault;
}

void pass_until(Instant when, ManualClock& clock, DeterministicAir& air) {
  for (; clock.now() < when; clock.advance(100ms)) air.look();
}

TEST(DeterministicAir, MeasuresTheTrueAir) {
  const ManualClock clock;
  const DeterministicAir air(clock, kAir, {});
  ASSERT_TRUE(air.density());
  EXPECT_NEAR(air.density()->kg_m3, 1.225, 0.003);
}

TEST(DeterministicAir, OfASensorBesideAWarmBoardIsTooThinAndSaysSoWhereTheBenchFileDoes) {
  const ManualClock clock;
  sim::Fault warm;
  warm.kind = sim::FaultKind::ambient_warm;
  warm.coil = 3.7;
  profiles::AmbientConfig placed;
  const double true_kg_m3 = DeterministicAir(clock, kAir, {}).density()->kg_m3;
  const auto trusted = DeterministicAir(clock, kAir, {warm}, placed).density();
  const double error = 1 - trusted->kg_m3 / true_kg_m3;
  EXPECT_NEAR(error, 0.013, 0.002) << "1.3 % for 3.7 °C";
  EXPECT_GT(error * true_kg_m3, 4 * trusted->u_kg_m3) << "what the data sheet says does not hold it";
  placed.u_temperature_c = 3;
  const auto doubted = DeterministicAir(clock, kAir, {warm}, placed).density();
  EXPECT_EQ(doubted->kg_m3, trusted->kg_m3);
  EXPECT_LT(error * true_kg_m3, 2 * doubted->u_kg_m3);
  placed.u_temperature_c = 0.01;
  EXPECT_EQ(DeterministicAir(clock, kAir, {warm}, placed).density()->u_kg_m3, trusted->u_kg_m3)
      << "never better than its data sheet";
}

TEST(DeterministicAir, IsRefusedWhenNoReadingComes) {
  const ManualClock clock;
  EXPECT_THROW(DeterministicAir(clock, kAir, {unplugged(0s, 60s)}), DeviceError);
}

TEST(DeterministicAir, KnowsNothingOnceItsReadingIsAMinuteOldAndComesBackWithTheSensor) {
  ManualClock clock;
  DeterministicAir air(clock, kAir, {unplugged(8s, 100s)});
  pass_until(60s, clock, air);
  EXPECT_TRUE(air.density());
  pass_until(75s, clock, air);
  EXPECT_FALSE(air.density());
  pass_until(160s, clock, air);
  EXPECT_TRUE(air.density());
}

}  // namespace deterministic_air_test
}  // namespace kphi::daq
