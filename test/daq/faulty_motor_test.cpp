// Campaigns on the deterministic bench whose motor module, its line or its supply go wrong by a script.
#include <random>

#include "test/daq/faulty_campaign.hpp"

namespace kphi::daq {
namespace {

using results::EventKind;
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
  EXPECT_THAT(stop("  - {at_s: 2.0, for_s: 0.3, kind: motor_unplug}\n"), HasSubstr("the serial port is gone"));
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

TEST_F(FaultyMotor, DoubtsStepsWithoutEnoughSupply) {
  (void)run("  - {at_s: 1.4, for_s: 0.5, kind: motor_sag, volts: 1.5}\n");
  EXPECT_EQ(doubts(0)[0], "");
  EXPECT_THAT(doubts(0)[1], HasSubstr("supply_out_of_band"));
  EXPECT_EQ(doubts(0)[3], "");
  expect_replay_agrees();
}

TEST_F(FaultyMotor, BearsLostDoubledAndDamagedRepliesWithoutADoubt) {
  (void)run(
      "  - {at_s: 1.0, for_s: 2, kind: motor_drop, p: 0.05}\n"
      "  - {at_s: 1.0, for_s: 2, kind: motor_flip, p: 0.05}\n"
      "  - {at_s: 1.0, for_s: 2, kind: motor_duplicate, p: 0.2}\n");
  EXPECT_EQ(doubts(0), (std::vector<std::string>{"", "", "", ""}));
  EXPECT_GT(bench_->simulation().motor_line().truth().done[static_cast<std::size_t>(sim::MotorFaultKind::drop)], 0u);
  expect_replay_agrees();
}

TEST_F(FaultyMotor, WaitsUntilTheCoilHasCooledDown) {
  campaign_.limits.cooling = profiles::Cooling{Celsius(60), Celsius(50)};
  (void)run("  - {at_s: 0, for_s: 5, kind: motor_hot, coil_celsius: 60}\n");
  EXPECT_GT(recording(0).load_cell.front().arrival_ns, 4'500'000'000);
  std::vector<std::string> names;
  for (const auto& entry : results::read_journal(results_->journal()).entries) names.push_back(entry.event);
  EXPECT_THAT(names, testing::IsSupersetOf({"cooling", "cooled_down"}));
  EXPECT_THAT(said_.lines, Contains(HasSubstr("waiting for 50 °C")));
}

/// One entry of a fault script in the first run, drawn from `random`.
std::string random_fault(std::mt19937& random) {
  static const std::vector<std::string> kinds{"for_s: 0.5, kind: motor_flip, p: 0.2, bits: 2",
                                              "for_s: 0.5, kind: motor_bad_crc, p: 0.3",
                                              "for_s: 0.5, kind: motor_drop, p: 0.5",
                                              "for_s: 0.5, kind: motor_duplicate, p: 0.5",
                                              "for_s: 0.5, kind: motor_reorder, p: 0.3, delay_s: 0.005",
                                              "for_s: 0.5, kind: motor_truncate, p: 0.2, size: 6",
                                              "for_s: 0.5, kind: motor_garbage, p: 0.3, bytes: 55 3B 32",
                                              "for_s: 0.5, kind: motor_merge, p: 0.5, delay_s: 0.016",
                                              "for_s: 0.5, kind: motor_delay, delay_s: 0.01, jitter_s: 0.02",
                                              "for_s: 0.5, kind: motor_value, p: 0.2, value: nan",
                                              "for_s: 0.5, kind: motor_wrong_id, p: 0.3, id: 5",
                                              "for_s: 0.5, kind: motor_stuck",
                                              "for_s: 0.3, kind: motor_mute",
                                              "for_s: 2, kind: motor_mute",
                                              "for_s: 0.3, kind: motor_deaf",
                                              "for_s: 2, kind: motor_deaf",
                                              "for_s: 0.4, kind: motor_unplug",
                                              "for_s: 0.4, kind: motor_unplug, other: 1",
                                              "kind: motor_brown_out, down_s: 0.1",
                                              "for_s: 0.5, kind: motor_ignore_sets",
                                              "kind: motor_baud",
                                              "for_s: 0.5, kind: motor_redline, speed_rad_s: 900",
                                              "for_s: 0.5, kind: motor_hot, coil_celsius: 80",
                                              "for_s: 0.5, kind: motor_sag, volts: 3",
                                              "for_s: 0.5, kind: motor_over_voltage, volts: 4"};
  const double at = std::uniform_real_distribution<double>(0.0, 3.5)(random);
  return fmt::format("  - {{at_s: {:.4f}, {}}}\n", at, kinds[random() % kinds.size()]);
}

std::string random_faults(unsigned seed) {
  std::mt19937 random(seed);
  std::string faults;
  for (unsigned n = 1 + random() % 3; n > 0; --n) faults += random_fault(random);
  return faults;
}

TEST_F(FaultyMotor, IsWholeSafelyStoppedOrRefusedWhateverHappens) {
  campaign_ = test::short_campaign("0", 1);
  int finished = 0, stopped = 0, refused = 0;
  for (unsigned seed = 1; seed <= 60; ++seed) {
    const std::string faults = random_faults(seed);
    SCOPED_TRACE(fmt::format("seed {}:\n{}", seed, faults));
    bench_.reset();
    try {
      (void)run(faults, static_cast<int>(seed));
      ++finished;
      expect_replay_agrees();
    } catch (const SafetyStop&) {
      ++stopped;
      EXPECT_TRUE(results::verify_run(results_->other_runs().at(0)).whole())
          << testing::PrintToString(results::verify_run(results_->other_runs().at(0)).problems);
    } catch (const DeviceError&) {
      ++refused;  // before anything turned
    } catch (const ConfigurationError&) {
      ++refused;
    }
    EXPECT_TRUE(!bench_ || motor_is_let_go());
  }
  EXPECT_GT(finished, 15);
  EXPECT_GT(stopped, 10);
  RecordProperty("finished", finished);
  RecordProperty("stopped", stopped);
  RecordProperty("refused", refused);
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

}  // namespace
}  // namespace kphi::daq
