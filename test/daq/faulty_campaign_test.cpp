// Campaigns on the deterministic bench whose load cell's wire and box go wrong by a script.
#include "test/daq/faulty_campaign.hpp"

#include "results/digest.hpp"

namespace kphi::daq {
namespace faulty_campaign_test {

using testing::AllOf;
using testing::AnyOf;
using testing::Contains;
using testing::Each;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::ThrowsMessage;

constexpr const char* kManyFaults =
    "  - {at_s: 1.0, for_s: 0.5, kind: loss, p: 0.05, burst: 2}\n"
    "  - {at_s: 1.6, for_s: 0.4, kind: duplicate, p: 0.2}\n"
    "  - {at_s: 2.0, for_s: 0.3, kind: reorder, p: 0.2, depth: 1}\n"
    "  - {at_s: 2.44, kind: restart}\n"
    "  - {at_s: 2.5, for_s: 0.3, kind: wrong_size, p: 0.1, size: 71}\n"
    "  - {at_s: 2.5, for_s: 0.3, kind: foreign_source, p: 0.1}\n"
    "  - {at_s: 5.5, for_s: 1.0, kind: loss, p: 0.02}\n"
    "  - {at_s: 0, kind: clock_skew, ppm: 80}\n";

profiles::Campaign biased() {
  return profiles::parse_campaign(test::short_campaign_text() + "box_bias: true\n", "short.yaml");
}

TEST_F(FaultyCampaign, AccountsForEverySampleAsTheTruthSays) {
  const CampaignResult result = run(kManyFaults);
  EXPECT_EQ(result.runs, 2);
  SampleAccount sum;
  for (std::size_t i = 0; i < 2; ++i) {
    const SampleAccount account = recording(i).account;
    EXPECT_EQ(account.received + account.lost_network + account.lost_host, account.expected);
    sum.lost_network += account.lost_network;
    sum.duplicates += account.duplicates;
    sum.malformed += account.malformed;
    sum.restarts += account.restarts;
    sum.reordered += account.reordered;
    sum.late += account.late;
  }
  const sim::WireTruth& truth = bench_->simulation().wire().truth();
  EXPECT_GT(truth.records_dropped, 0u);
  std::uint64_t never_sent = 0;  // by a box that begins anew with a datagram half filled
  for (const auto& event : recording(0).events) never_sent += event.kind == EventKind::restarted ? event.records : 0;
  EXPECT_LT(never_sent, 40u);
  EXPECT_EQ(sum.lost_network, truth.records_dropped + never_sent);
  EXPECT_GT(truth.records_duplicated, 0u);
  EXPECT_EQ(sum.duplicates, truth.records_duplicated);
  EXPECT_GT(truth.malformed, 0u);
  EXPECT_EQ(sum.malformed, truth.malformed);
  EXPECT_GT(truth.foreign, 0u);
  EXPECT_EQ(sum.restarts, truth.restarts);
  EXPECT_EQ(sum.reordered, 40 * truth.overtaken);
  EXPECT_EQ(sum.late, 0u);
  EXPECT_THAT(events(0), Contains(EventKind::restarted));
  EXPECT_NEAR(recording(0).health.skew_ppm, -80, 5);
  expect_whole();
}

TEST_F(FaultyCampaign, GivesTheSameBytesFromTheSameSeed) { expect_bytes_to_follow_from_the_seed(kManyFaults); }

TEST_F(FaultyCampaign, FlagsTheStepInWhichTheStreamBeganAnew) {
  (void)run("  - {at_s: 2.44, kind: restart}\n");
  EXPECT_THAT(flags(0), ElementsAre("", "", "lost_samples+stream_restarted", ""));
  EXPECT_EQ(flags(1), kNoFlags);
  EXPECT_THAT(said_.lines, Contains(HasSubstr("the stream restarted")));
  EXPECT_THAT(journal().at(3).data.at("events").at(0).get<std::string>(), HasSubstr("the stream restarted"));
  expect_whole();
}

TEST_F(FaultyCampaign, ShowsTenEventsOfARunAndKeepsTheOthersInItsFile) {
  std::string faults;
  for (int i = 0; i < 12; ++i) faults += fmt::format("  - {{at_s: {:.1f}, kind: restart}}\n", 1.0 + 0.1 * i);
  (void)run(faults);
  EXPECT_EQ(events(0).size(), 12u);
  EXPECT_EQ(said_.count("the stream restarted"), 10);
  EXPECT_THAT(said_.lines, Contains(HasSubstr("further events of this run go to its file only")));
}

TEST_F(FaultyCampaign, FlagsAllStepsAfterARestartOfTheBoxUntilTheNextRun) {
  EXPECT_EQ(run("  - {at_s: 1.6, kind: reboot, down_s: 0.1, resume: true}\n").runs, 2);
  EXPECT_THAT(flags(0),
              ElementsAre("zero_drifted", HasSubstr("rebooted"), "rebooted+zero_drifted", "rebooted+zero_drifted"))
      << "since the box restarted, no zero was taken after a run";
  EXPECT_EQ(flags(1), kNoFlags);
  EXPECT_EQ(recording(0).account.reboots, 1u);
  EXPECT_EQ(said_.count("the box has booted"), 1);
  expect_whole();
}

TEST_F(FaultyCampaign, FlagsStallsAndKeepsTheClockAfterThem) {
  (void)run("  - {at_s: 1.5, for_s: 0.1, kind: stall}\n");
  EXPECT_THAT(flags(0), ElementsAre("", HasSubstr("stalled"), "", ""));
  for (const auto& step : reduce(recording(0))) {
    EXPECT_NEAR(step.thrust_n, test::kTrueK5x3 * step.speed_rad_s * step.speed_rad_s, 0.01 * step.thrust_n)
        << "step " << step.step << ": a clock that stood still must not misplace what follows";
  }
  EXPECT_GT(recording(0).account.stalled, 600u);
  expect_whole();
}

TEST_F(FaultyCampaign, FlagsTheStepInWhichTheBoxSawItsCommunicationFail) {
  (void)run("  - {at_s: 1.6, for_s: 0.05, kind: status, bits: 0x80100000}\n");
  EXPECT_THAT(flags(0)[1], HasSubstr("box_trouble"));
  EXPECT_EQ(flags(0)[2], "");
}

TEST_F(FaultyCampaign, StopsTheMotorWhenTheBoxReportsAnErrorForGood) {
  EXPECT_THAT(stop("  - {at_s: 2.0, kind: status, bits: 0x88000000}\n"),
              HasSubstr("the Net Box reports \"serial link communication error\" (status 0x88000000)"));
  EXPECT_THAT(events(aborted()), ElementsAre(EventKind::box_error, EventKind::guard_trip));
  EXPECT_THAT(said_.lines, Not(Contains(AllOf(testing::StartsWith("load cell: "), HasSubstr("the Net Box ")))))
      << "the stop itself says it";
  EXPECT_THAT(journaled(results::kRunAborted).at(0).at("reason").get<std::string>(),
              HasSubstr("its samples cannot be trusted"));
}

TEST_F(FaultyCampaign, BearsAnErrorOfOneDatagramFlaggedAndTellsIt) {
  (void)run("  - {at_s: 1.75, for_s: 0.005, kind: status, bits: 0x88000000}\n");
  EXPECT_THAT(flags(0)[1], HasSubstr("bad_status"));
  EXPECT_EQ(flags(0)[2], "");
  ASSERT_THAT(events(0), ElementsAre(EventKind::box_error, EventKind::box_error_ended));
  EXPECT_EQ(recording(0).events[1].records, 35u) << "5 ms at 7 kHz";
  EXPECT_EQ(said_.count("the Net Box "), 2) << "its beginning and its end";
  EXPECT_EQ(journaled(results::kRunAccepted).at(0).at("events").size(), 2u);
  expect_whole();
}

TEST_F(FaultyCampaign, TurnsNothingWithoutAZeroOrBiasOfSoundSamples) {
  const auto expect_no_step = [&](const char* faults, results::Phase at, const char* why) {
    SCOPED_TRACE(faults);
    EXPECT_THROW((void)run(faults), SafetyStop);
    EXPECT_EQ(aborted().outcome, results::Outcome::aborted);
    ASSERT_EQ(aborted().phases.size(), 1u);
    EXPECT_EQ(aborted().phases[0].phase, at);
    EXPECT_THAT(aborted().outcome_reason, testing::ContainsRegex(why));
  };
  const char* saturated = "  - {at_s: 0, for_s: 20, kind: saturation, axes: 1}\n";
  expect_no_step(saturated, results::Phase::zero_before, "take the zero.*no valid sample arrived");
  expect_no_step("  - {at_s: 0.3, for_s: 0.05, kind: status, bits: 0x88000000}\n", results::Phase::zero_before,
                 "its samples cannot be trusted");
  expect_no_step("  - {at_s: 0.5, kind: taken_over}\n", results::Phase::zero_before, "");
  campaign_ = biased();
  expect_no_step(saturated, results::Phase::bias_before, "take the bias.*no valid sample arrived");
}

TEST_F(FaultyCampaign, TakesALatchedMonitorConditionAndOneLostPageForNothing) {
  for (const char* faults : {"  - {at_s: 0, kind: status, bits: 0x80010000}\n",
                             "  - {at_s: 1.5, count: 1, kind: http_status, code: 500}\n"}) {
    EXPECT_EQ(run(faults).runs, 2);
    EXPECT_EQ(flags(0), kNoFlags) << faults;
    EXPECT_THAT(events(0), IsEmpty()) << faults;
  }
}

TEST_F(FaultyCampaign, NamesTheErrorsOfAnAxiaByItsOwnBits) {
  EXPECT_THAT(stop("  - {at_s: 2.0, kind: status, bits: 0x80000004}\nquirks: {axia: true}\n"),
              HasSubstr("the Axia reports \"broken gage\" (status 0x80000004)"));
}

TEST_F(FaultyCampaign, GoesOnBeyondARangeFlaggedWithOneWarning) {
  for (const char* box : {"", "quirks: {axia: true}\n"}) {
    (void)run(std::string("  - {at_s: 1.5, for_s: 0.2, kind: saturation, axes: 1}\n") + box);
    EXPECT_THAT(flags(0)[1], AllOf(HasSubstr("saturated"), Not(HasSubstr("bad_status")))) << box;
    EXPECT_EQ(flags(0)[3], "");
    EXPECT_THAT(events(0), ElementsAre(EventKind::beyond_range)) << box;
    EXPECT_EQ(said_.count("Fx carries 100 % of its range of 20 N"), 1);
    said_.lines.clear();
  }
}

TEST_F(FaultyCampaign, FlagsAllStepsOfARunInWhichTheBoxWasGivenOtherUnits) {
  EXPECT_EQ(run("  - {at_s: 4, kind: units, force_unit: 6}\n").runs, 2);  // gf, while the rotor coasts
  EXPECT_THAT(flags(0), Each(HasSubstr("configuration_changed")));
  EXPECT_EQ(flags(1), kNoFlags) << "read with its own scale";
  EXPECT_THAT(events(0), ElementsAre(EventKind::configuration_changed));
  EXPECT_EQ(said_.count("configuration changed since the run began: units, counts per unit; all steps"), 1);
  EXPECT_EQ(said_.count("configuration changed since it was last read: units, counts per unit; recording this run"), 1);
  expect_whole();
}

TEST_F(FaultyCampaign, StopsInUnitsInWhichTheCellShowsNothing) {
  EXPECT_THAT(stop("  - {at_s: 1.5, kind: units, force_unit: 5}\n"),  // whole kilograms of force
              HasSubstr("repeats one value"));
  EXPECT_THAT(said_.lines, Contains(HasSubstr("configuration changed")));
}

TEST_F(FaultyCampaign, StopsWhenThrustIsMirroredOrMissing) {
  otherwise_ = [](profiles::BenchConfig& config) { config.thrust_sign = -1; };
  EXPECT_THAT(stop("  []\n"), AllOf(HasSubstr("N at 6000 RPM"), HasSubstr("mirror thrust_axis in the bench file")));
  otherwise_ = [](profiles::BenchConfig& config) { config.thrust_axis = 0; };
  campaign_.limits["thrust_max_n"] = 10;
  EXPECT_THAT(stop("  []\n"), HasSubstr("does the load cell carry the motor?"));
}

TEST_F(FaultyCampaign, RefusesAFrozenZeroBeforeAnythingTurns) {
  EXPECT_THAT(stop("  - {at_s: 0, kind: frozen, axes: 63}\n"),
              AllOf(HasSubstr("take the zero"), HasSubstr("Fz repeated one value in all"), HasSubstr("it is frozen")));
  for (const auto& reading : aborted().motor) {
    EXPECT_TRUE(reading.channel != MotorChannel::speed || std::abs(reading.value) < 1.0) << reading.value;
  }
}

TEST_F(FaultyCampaign, SaysThatItDoesNotKnowWhenTheBoxCannotBeReadAgain) {
  EXPECT_EQ(run("  - {at_s: 1.5, count: 2, kind: http_status, code: 500}\n").runs, 2);
  EXPECT_THAT(events(0), ElementsAre(EventKind::unreachable));
  EXPECT_THAT(said_.lines, Contains(HasSubstr("configuration not verified after the run")));
  EXPECT_EQ(flags(0), kNoFlags);
}

TEST_F(FaultyCampaign, FlagsARunAtWhoseEndThePageOfTheBoxMakesNoSense) {
  EXPECT_EQ(run("  - {at_s: 1.5, count: 2, kind: http_charset, utf16: true}\n").runs, 2);
  ASSERT_THAT(events(0), ElementsAre(EventKind::unusable));
  EXPECT_THAT(recording(0).events[0].text, HasSubstr("NUL byte"));
  EXPECT_THAT(flags(0), Each("configuration_changed"));
  expect_whole();
}

TEST_F(FaultyCampaign, TellsWhatUnitsHaveToDoWithALimitThatWasPassed) {
  (void)stop(
      "  - {at_s: 0, kind: units, force_unit: 4}\n"      // kN, a thousandth of a newton per count
      "  - {at_s: 2.5, kind: units, force_unit: 2}\n");  // N, a millionth
  EXPECT_THAT(said_.lines, Contains(HasSubstr("configuration changed")));
}

TEST_F(FaultyCampaign, FlagsAllStepsOfARunDuringWhichTheZeroDrifted) {
  EXPECT_EQ(run("  - {at_s: 1.0, kind: zero_drift, amount: 1, tau_s: 1}\n").runs, 2);
  EXPECT_THAT(flags(0), Each(testing::StartsWith("zero_drifted")));
  EXPECT_THAT(said_.lines, Contains(AllOf(HasSubstr("zero moved by 0.9"), HasSubstr("limit 0.03 N"))));
  expect_whole();
}

TEST_F(FaultyCampaign, RefusesANoisyZeroBeforeAnythingTurns) {
  EXPECT_THAT(stop("  - {at_s: 0.45, kind: zero_drift, amount: 2, tau_s: 0.01}\n"),
              AllOf(HasSubstr("take the zero"), HasSubstr("Fz is noisy"), HasSubstr("limit 0.15 N"),
                    HasSubstr("come to rest")));
  for (const auto& reading : aborted().motor) {
    EXPECT_TRUE(reading.channel != MotorChannel::speed || std::abs(reading.value) < 1.0) << reading.value;
  }
}

TEST_F(FaultyCampaign, StopsWhenTheBoxRepeatsItselfForLongAndSaysSo) {
  // Whoever looks first: the interlock, or with a more patient one the silence.
  EXPECT_THAT(stop("  - {at_s: 1.5, for_s: 1.5, kind: stall}\n"),
              AllOf(AnyOf(HasSubstr("newest load-cell sample"), HasSubstr("the stream fell silent")),
                    HasSubstr("the box repeats one measurement")));
}

TEST_F(FaultyCampaign, KeepsTheScriptBesideTheBenchFile) {
  (void)run("  []\n");
  EXPECT_EQ(test::bytes_of(results_->faults_file()), "format: kphi-faults/1\nfaults:\n  []\n");
  EXPECT_EQ(journal().at(0).data.at("faults_sha256"), results::sha256_of_file(results_->faults_file()));
}

TEST_F(FaultyCampaign, StopsWhenTheStreamIsTakenOverSaysSoAndShowsNoOldThrustAsFresh) {
  Duration oldest_shown{0};
  int stale = 0;
  said_.at_tick = [&](const Position&, const Observation& seen) {
    if (seen.load_cell_is_fresh()) oldest_shown = std::max(oldest_shown, seen.load_cell_age);
    stale += !seen.load_cell_is_fresh();
  };
  EXPECT_THAT(stop("  - {at_s: 2.0, kind: taken_over}\n"), HasSubstr("another client has taken the stream"));
  EXPECT_GT(stale, 5);
  EXPECT_LT(oldest_shown, std::chrono::milliseconds(80));
}

TEST_F(FaultyCampaign, StopsWhenTheBoxGoesAndSaysThatItDoesNotAnswer) {
  EXPECT_THAT(stop("  - {at_s: 2.0, kind: reboot, down_s: 100}\n"), HasSubstr("does not answer over HTTP"));
}

TEST_F(FaultyCampaign, RefusesABoxWhosePagesCannotBeRead) {
  EXPECT_THAT([&] { (void)run("  - {at_s: 0, for_s: 10, kind: http_charset, utf16: true}\n"); },
              ThrowsMessage<DeviceError>(AllOf(HasSubstr("NUL byte"), HasSubstr("power-cycle"))));
  EXPECT_THROW((void)run("  - {at_s: 0, for_s: 10, kind: http_status, code: 500}\n"), DeviceError);
  EXPECT_THROW((void)run("  - {at_s: 0, for_s: 10, kind: http_refused}\n"), DeviceError);
  EXPECT_THROW((void)run("  - {at_s: 0, for_s: 10, kind: http_slow, delay_s: 6}\n"), DeviceError);
  EXPECT_NO_THROW((void)run("  - {at_s: 0, count: 1, kind: http_slow, delay_s: 2}\n"));
}

TEST_F(FaultyCampaign, RefusesAScriptThatIsNone) {
  EXPECT_THROW((void)run("  - {at_s: 2.0, kind: earthquake}\n"), ConfigurationError);
  EXPECT_THROW(DeterministicBench(test::deterministic_config(1, "/nowhere/faults.yaml")), ConfigurationError);
}

/// At the end of the range of the gages it shows more than the range.
class ShiftedCell : public FaultyCampaign {
  void prepare() override {
    FaultyCampaign::prepare();
    test::shift_cell(*bench_, 0);
  }
};

TEST_F(ShiftedCell, LetsTheMotorGoAboveATenthBeyondARange) {
  EXPECT_THAT(stop("  - {at_s: 2.0, for_s: 1, kind: saturation, axes: 1}\n"),
              HasSubstr("load cell: Fx carries 120 % of its range of 20 N"));
  EXPECT_EQ(results_->other_runs().size(), 1u);
  EXPECT_EQ(aborted().outcome, results::Outcome::aborted);
  EXPECT_EQ(aborted().events.back().kind, EventKind::range_trip);
  EXPECT_GT(aborted().load_cell.back().arrival_ns, 2'000'000'000) << "the last samples are kept";
}

TEST_F(FaultyCampaign, TakesTheBoxesBiasAsAMeasuredStepWhenTheCampaignSaysSo) {
  campaign_ = biased();
  (void)run("  []\n");
  for (std::size_t i = 0; i < 2; ++i) {
    const results::RunRecording run = recording(i);
    EXPECT_EQ(run.phases.at(0).phase, results::Phase::bias_before);
    EXPECT_EQ(run.phases.at(1).phase, results::Phase::bias_settling);
    EXPECT_EQ(run.phases.at(2).phase, results::Phase::bias_after);
    EXPECT_EQ(run.phases.at(3).phase, results::Phase::zero_before);
    EXPECT_GT(run.box_bias.records, 3000u);
    EXPECT_NEAR(run.box_bias.before_sd[2], 0.025, 0.002);
    EXPECT_LT(std::abs(run.box_bias.after[2]), 0.05) << "the box takes one noisy sample as its zero";
    for (const auto& step : reduce(run))
      EXPECT_NEAR(step.zero_n, run.box_bias.after[2], 0.002) << "and the rest is ours";
  }
  EXPECT_GT(std::abs(recording(0).box_bias.before[2]), 0.06) << "there was something to take away";
  EXPECT_EQ(flags(0), kNoFlags);
  expect_whole();
}

TEST_F(FaultyCampaign, TakesNoBiasUnaskedAndKeepsThePageOfTheCalibrationAndTheHealthOfTheStream) {
  (void)run("  []\n");
  EXPECT_EQ(recording(0).box_bias.records, 0u);
  EXPECT_EQ(recording(0).phases.at(0).phase, results::Phase::zero_before);
  const results::RunRecording run = recording(1);
  EXPECT_THAT(run.header.load_cell.slots_json, AllOf(HasSubstr("netftcalapi.xml?index=0"), HasSubstr("FT21001")));
  EXPECT_NEAR(run.health.records_per_second, 7000, 1);
  EXPECT_NEAR(run.health.datagrams_per_second, 175, 1);
}

}  // namespace faulty_campaign_test
}  // namespace kphi::daq
