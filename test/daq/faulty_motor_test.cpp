// Campaigns on the deterministic bench whose motor module, its line or its supply go wrong by a script.
#include "test/daq/faulty_campaign.hpp"

namespace kphi::daq {
namespace faulty_motor_test {

using testing::Contains;
using testing::HasSubstr;

using FaultyMotor = FaultyCampaign;

TEST_F(FaultyMotor, StopsWhenTheModuleRestartsAndSaysSo) {
  EXPECT_THAT(stop("  - {at_s: 2.0, kind: motor_brown_out, down_s: 0.05}\n"), HasSubstr("restarted by itself"));
  EXPECT_THAT(events(aborted()), Contains(EventKind::motor_reset));
}

TEST_F(FaultyMotor, StopsWhenTheAdapterIsUnpluggedAndNeverSpinsAgainByItself) {
  const std::string why = stop("  - {at_s: 2.0, for_s: 0.3, kind: motor_unplug}\n");
  EXPECT_THAT(why, HasSubstr("the serial port is gone"));
  EXPECT_EQ(why.find("the serial port is gone"), why.rfind("the serial port is gone")) << "reported once: " << why;
  EXPECT_THAT(events(aborted()), Contains(EventKind::motor_port_lost));
  EXPECT_THROW(bench_->motor().spin_at(RadPerSec(500)), DeviceError);
}

TEST_F(FaultyMotor, StopsWhenTheModuleFallsSilentOrDeaf) {
  EXPECT_THAT(stop("  - {at_s: 2.0, for_s: 10, kind: motor_mute}\n"), HasSubstr("motor"));
  EXPECT_THAT(stop("  - {at_s: 2.0, for_s: 10, kind: motor_deaf}\n"), HasSubstr("motor"));
}

TEST_F(FaultyMotor, StopsWhenTheRotorIsHeldAndTellsSo) {
  for (const int seed : {4, 5, 6, 7, 8}) {
    EXPECT_THAT(stop(fmt::format("  - {{at_s: {}, for_s: 10, kind: motor_locked}}\n", 0.8 + 0.4 * (seed - 4))),
                HasSubstr("speed off target"));
  }
}

TEST_F(FaultyMotor, StopsWhenARotorIsHeldAtASpeedThatTellsNothing) {
  campaign_.profile.first = from_rpm(100);
  campaign_.profile.last = from_rpm(160);
  EXPECT_THAT(stop("  - {at_s: 0.3, for_s: 10, kind: motor_locked}\n"), HasSubstr("the rotor is stalled"));
  EXPECT_LT(bench_->simulation().plant().motor().coil_celsius, 32);
}

TEST_F(FaultyMotor, StopsWhenItsSpeedCannotBeReadOrIsNotBelieved) {
  EXPECT_THAT(stop("  - {at_s: 1.5, for_s: 10, kind: motor_drop, type: 50, sub: 13}\n"), HasSubstr("no speed reading"));
  EXPECT_THAT(stop("  - {at_s: 1.2, for_s: 10, kind: motor_stuck, type: 50, sub: 13}\n"), HasSubstr(" of 10000 RPM"));
}

TEST_F(FaultyMotor, FindsNothingWrongWithTheRotorInALongCleanRun) {
  campaign_ = test::short_campaign("0", 1, 40);
  campaign_.profile.first = from_rpm(100);
  campaign_.profile.last = from_rpm(19100);
  campaign_.profile.dwell = Seconds(2);
  campaign_.limits["speed_max_rpm"] = 19100;
  EXPECT_NO_THROW((void)run("  []\n"));
  std::swap(campaign_.profile.first, campaign_.profile.last);
  EXPECT_NO_THROW((void)run("  []\n", 5));
}

TEST_F(FaultyMotor, FlagsStepsWithoutEnoughSupply) {
  (void)run("  - {at_s: 1.4, for_s: 0.5, kind: motor_sag, volts: 1.5}\n");
  EXPECT_EQ(flags(0)[0], "");
  EXPECT_THAT(flags(0)[1], HasSubstr("supply_out_of_band"));
  EXPECT_EQ(flags(0)[3], "");
  expect_whole();
}

TEST_F(FaultyMotor, BearsLostDoubledAndDamagedRepliesWithoutAFlag) {
  (void)run(
      "  - {at_s: 1.0, for_s: 2, kind: motor_drop, p: 0.05}\n"
      "  - {at_s: 1.0, for_s: 2, kind: motor_flip, p: 0.05}\n"
      "  - {at_s: 1.0, for_s: 2, kind: motor_duplicate, p: 0.2}\n");
  EXPECT_EQ(flags(0), kNoFlags);
  const auto done = [&](sim::FaultKind kind) { return bench_->simulation().motor_line().truth().done.at(kind); };
  ASSERT_GT(done(sim::FaultKind::motor_drop), 0u);
  const auto& [requests, replies, timeouts, late, unasked, crc_errors, discarded, skipped, dropped] =
      recording(0).motor_counts;
  EXPECT_GE(requests, replies + timeouts);
  EXPECT_LE(requests, replies + timeouts + 16) << "still open, before and after";
  EXPECT_NEAR(timeouts, done(sim::FaultKind::motor_drop) + done(sim::FaultKind::motor_flip), 5);
  EXPECT_NEAR(unasked + late, done(sim::FaultKind::motor_duplicate), 10);
  EXPECT_NEAR(crc_errors, done(sim::FaultKind::motor_flip), 5);
  EXPECT_GT(discarded, 0u);
  EXPECT_EQ(dropped, 0u);
  expect_whole();
}

TEST_F(FaultyMotor, WaitsUntilTheCoilHasCooledDown) {
  campaign_.limits.cooling = profiles::Cooling{Celsius(60), Celsius(50)};
  (void)run("  - {at_s: 0, for_s: 5, kind: motor_hot, coil_celsius: 60}\n");
  EXPECT_GT(recording(0).load_cell.front().arrival_ns, 4'500'000'000);
  EXPECT_THAT(journaled(), testing::IsSupersetOf({"cooling", "cooled_down"}));
  EXPECT_THAT(said_.lines, Contains(HasSubstr("pausing until below 50 °C")));
}

TEST_F(FaultyMotor, GivesTheSameBytesFromTheSameSeed) {
  expect_bytes_to_follow_from_the_seed(
      "  - {at_s: 1.0, for_s: 2, kind: motor_drop, p: 0.2}\n"
      "  - {at_s: 1.0, for_s: 2, kind: motor_delay, delay_s: 0.002, jitter_s: 0.01}\n");
}

}  // namespace faulty_motor_test
}  // namespace kphi::daq
