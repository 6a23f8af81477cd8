// Campaigns on the deterministic bench whose motor module, its line or its supply go wrong by a script.
#include "test/daq/faulty_campaign.hpp"

namespace kphi::daq {
namespace faulty_motor_test {

using testing::Contains;
using testing::HasSubstr;

class FaultyMotor : public FaultyCampaign {
 protected:
  /// Why the campaign was stopped.
  std::string stop(const std::string& faults) {
    try {
      (void)run(faults);
    } catch (const SafetyStop& stop) {
      return stop.what();
    }
    ADD_FAILURE() << "went unnoticed: " << faults;
    return "";
  }
  [[nodiscard]] std::vector<EventKind> aborted_events() const {
    std::vector<EventKind> kinds;
    for (const auto& event : results::read_run(results_->other_runs().at(0)).events) kinds.push_back(event.kind);
    return kinds;
  }
};

TEST_F(FaultyMotor, StopsWhenTheModuleRestartsAndSaysSo) {
  EXPECT_THAT(stop("  - {at_s: 2.0, kind: motor_brown_out, down_s: 0.05}\n"), HasSubstr("restarted by itself"));
  EXPECT_THAT(aborted_events(), Contains(EventKind::motor_reset));
  EXPECT_TRUE(motor_is_let_go());
}

TEST_F(FaultyMotor, StopsWhenTheAdapterIsUnpluggedAndNeverSpinsAgainByItself) {
  const std::string why = stop("  - {at_s: 2.0, for_s: 0.3, kind: motor_unplug}\n");
  EXPECT_THAT(why, HasSubstr("the serial port is gone"));
  EXPECT_EQ(why.find("the serial port is gone"), why.rfind("the serial port is gone")) << "reported once: " << why;
  EXPECT_THAT(aborted_events(), Contains(EventKind::motor_port_lost));
  EXPECT_TRUE(motor_is_let_go());
  EXPECT_THROW(bench_->motor().spin_at(RadPerSec(500)), DeviceError);
}

TEST_F(FaultyMotor, StopsWhenTheModuleFallsSilentOrDeaf) {
  EXPECT_THAT(stop("  - {at_s: 2.0, for_s: 10, kind: motor_mute}\n"), HasSubstr("motor"));
  EXPECT_TRUE(motor_is_let_go());
  EXPECT_THAT(stop("  - {at_s: 2.0, for_s: 10, kind: motor_deaf}\n"), HasSubstr("motor"));
  EXPECT_TRUE(motor_is_let_go());
}

TEST_F(FaultyMotor, StopsWhenTheRotorIsHeldAndTellsSo) {
  for (const int seed : {4, 5, 6, 7, 8}) {
    EXPECT_THAT(stop(fmt::format("  - {{at_s: {}, for_s: 10, kind: motor_locked}}\n", 0.8 + 0.4 * (seed - 4))),
                HasSubstr("speed off target"));
    EXPECT_TRUE(motor_is_let_go());
  }
}

TEST_F(FaultyMotor, StopsWhenARotorIsHeldAtASpeedThatTellsNothing) {
  campaign_.profile.first = from_rpm(100);
  campaign_.profile.last = from_rpm(160);
  EXPECT_THAT(stop("  - {at_s: 0.3, for_s: 10, kind: motor_locked}\n"), HasSubstr("the rotor is stalled"));
  EXPECT_LT(bench_->simulation().plant().motor().coil_celsius, 32);
  EXPECT_TRUE(motor_is_let_go());
}

TEST_F(FaultyMotor, StopsWhenItsSpeedCannotBeReadOrIsNotBelieved) {
  EXPECT_THAT(stop("  - {at_s: 1.5, for_s: 10, kind: motor_drop, type: 50, sub: 13}\n"), HasSubstr("no speed reading"));
  EXPECT_TRUE(motor_is_let_go());
  EXPECT_THAT(stop("  - {at_s: 1.2, for_s: 10, kind: motor_stuck, type: 50, sub: 13}\n"), HasSubstr(" of 10000 RPM"));
  EXPECT_TRUE(motor_is_let_go());
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
  expect_replay_agrees();
}

TEST_F(FaultyMotor, BearsLostDoubledAndDamagedRepliesWithoutAFlag) {
  (void)run(
      "  - {at_s: 1.0, for_s: 2, kind: motor_drop, p: 0.05}\n"
      "  - {at_s: 1.0, for_s: 2, kind: motor_flip, p: 0.05}\n"
      "  - {at_s: 1.0, for_s: 2, kind: motor_duplicate, p: 0.2}\n");
  EXPECT_EQ(flags(0), (std::vector<std::string>{"", "", "", ""}));
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
  expect_replay_agrees();
}

TEST_F(FaultyMotor, WaitsUntilTheCoilHasCooledDown) {
  campaign_.limits.cooling = profiles::Cooling{Celsius(60), Celsius(50)};
  (void)run("  - {at_s: 0, for_s: 5, kind: motor_hot, coil_celsius: 60}\n");
  EXPECT_GT(recording(0).load_cell.front().arrival_ns, 4'500'000'000);
  std::vector<std::string> names;
  for (const auto& entry : results::read_journal(results_->journal()).entries) names.push_back(entry.event);
  EXPECT_THAT(names, testing::IsSupersetOf({"cooling", "cooled_down"}));
  EXPECT_THAT(said_.lines, Contains(HasSubstr("pausing until below 50 °C")));
}

TEST_F(FaultyMotor, GivesTheSameBytesFromTheSameSeed) {
  const auto digest = [&](int seed) {
    (void)run(
        "  - {at_s: 1.0, for_s: 2, kind: motor_drop, p: 0.2}\n"
        "  - {at_s: 1.0, for_s: 2, kind: motor_delay, delay_s: 0.002, jitter_s: 0.01}\n",
        seed);
    return results::sha256_of_file(results_->complete_runs().at(0));
  };
  const std::string once = digest(9);
  EXPECT_EQ(once, digest(9));
  EXPECT_NE(once, digest(10));
}

}  // namespace faulty_motor_test
}  // namespace kphi::daq
