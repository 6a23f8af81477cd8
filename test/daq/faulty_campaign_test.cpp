// Campaigns on the deterministic bench whose load cell's wire and box go wrong by a script.
#include "test/daq/faulty_campaign.hpp"

#include "base/error.hpp"
#include "daq/guard/interlock.hpp"
#include "results/campaign_folder.hpp"
#include "results/file_layer.hpp"
#include "results/journal.hpp"
#include "results/reduction/reduction.hpp"
#include "results/run_reader.hpp"
#include "results/steps_csv.hpp"

namespace kphi::daq {
namespace faulty_campaign_test {

using testing::AllOf;
using testing::AnyOf;
using testing::Contains;
using testing::HasSubstr;
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
  EXPECT_GT(truth().records_dropped, 0u);
  std::uint64_t never_sent = 0;  // by a box that begins anew with a datagram half filled
  for (const auto& event : recording(0).events) never_sent += event.kind == EventKind::restarted ? event.records : 0;
  EXPECT_LT(never_sent, 40u);
  EXPECT_EQ(sum.lost_network, truth().records_dropped + never_sent);
  EXPECT_GT(truth().records_duplicated, 0u);
  EXPECT_EQ(sum.duplicates, truth().records_duplicated);
  EXPECT_GT(truth().malformed, 0u);
  EXPECT_EQ(sum.malformed, truth().malformed);
  EXPECT_GT(truth().foreign, 0u);
  EXPECT_EQ(sum.restarts, truth().restarts);
  EXPECT_EQ(sum.reordered, 40 * truth().overtaken);
  EXPECT_EQ(sum.late, 0u);
  EXPECT_THAT(events(0), Contains(EventKind::restarted));
  EXPECT_NEAR(recording(0).health.skew_ppm, -80, 5);
  expect_replay_agrees();
}

TEST_F(FaultyCampaign, GivesTheSameBytesFromTheSameSeed) {
  const auto digests = [&](int seed) {
    (void)run(kManyFaults, seed);
    std::vector<std::string> all{test::bytes_of(results_->steps())};
    for (const auto& file : results_->complete_runs()) all.push_back(results::sha256_of_file(file));
    return all;
  };
  // The path of the script is in the bench file, which is in the runs: one folder for all three.
  const auto once = digests(9);
  EXPECT_EQ(once, digests(9));
  EXPECT_NE(once[1], digests(10)[1]);
}

TEST_F(FaultyCampaign, FlagsTheStepInWhichTheStreamBeganAnew) {
  (void)run("  - {at_s: 2.44, kind: restart}\n");
  EXPECT_EQ(flags(0), (std::vector<std::string>{"", "", "lost_samples+stream_restarted", ""}));
  EXPECT_EQ(flags(1), (std::vector<std::string>{"", "", "", ""}));
  EXPECT_THAT(said_.lines, Contains(HasSubstr("the stream restarted")));
  EXPECT_THAT(results::read_journal(results_->journal()).entries.at(3).data.at("events").at(0).get<std::string>(),
              HasSubstr("the stream restarted"));
  expect_replay_agrees();
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
  const CampaignResult result = run("  - {at_s: 1.6, kind: reboot, down_s: 0.1, resume: true}\n");
  EXPECT_EQ(result.runs, 2);
  const auto found = flags(0);
  EXPECT_EQ(found[0], "zero_drifted") << "of this power-up there is no zero after the run";
  EXPECT_THAT(found[1], HasSubstr("rebooted"));
  EXPECT_EQ(found[2], "rebooted+zero_drifted");
  EXPECT_EQ(found[3], "rebooted+zero_drifted");
  EXPECT_EQ(flags(1), (std::vector<std::string>{"", "", "", ""}));
  EXPECT_EQ(recording(0).account.reboots, 1u);
  EXPECT_EQ(said_.count("the box has booted"), 1);
  expect_replay_agrees();
}

TEST_F(FaultyCampaign, FlagsStallsAndKeepsTheClockAfterThem) {
  (void)run("  - {at_s: 1.5, for_s: 0.1, kind: stall}\n");
  const auto found = flags(0);
  EXPECT_EQ(found[0], "");
  EXPECT_THAT(found[1], HasSubstr("stalled"));
  EXPECT_EQ(found[2], "");
  EXPECT_EQ(found[3], "");
  constexpr double kTrueK5x3 = 1.7e-8 / (kRadPerSecPerRpm * kRadPerSecPerRpm);
  for (const auto& step : reduce(recording(0))) {
    EXPECT_NEAR(step.thrust_n, kTrueK5x3 * step.speed_rad_s * step.speed_rad_s, 0.01 * step.thrust_n)
        << "step " << step.step << ": a clock that stood still must not misplace what follows";
  }
  EXPECT_GT(recording(0).account.stalled, 600u);
  expect_replay_agrees();
}

TEST_F(FaultyCampaign, FlagsTheStepInWhichTheBoxSawItsCommunicationFail) {
  (void)run("  - {at_s: 1.6, for_s: 0.05, kind: status, bits: 0x80100000}\n");
  EXPECT_THAT(flags(0)[1], HasSubstr("box_trouble"));
  EXPECT_EQ(flags(0)[2], "");
}

TEST_F(FaultyCampaign, StopsTheMotorWhenTheBoxReportsAnErrorForGood) {
  EXPECT_THAT([&] { (void)run("  - {at_s: 2.0, kind: status, bits: 0x88000000}\n"); },
              ThrowsMessage<SafetyStop>(
                  HasSubstr("the Net Box reports \"serial link communication error\" (status 0x88000000)")))
      << "the motor turned on samples that the box does not answer for";
  EXPECT_TRUE(motor_is_let_go());
  const results::RunRecording run = results::read_run(results_->other_runs().at(0));
  ASSERT_EQ(run.events.size(), 2u);
  EXPECT_EQ(run.events[0].kind, EventKind::box_error);
  EXPECT_EQ(run.events[1].kind, EventKind::guard_trip);
  const auto told = std::count_if(said_.lines.begin(), said_.lines.end(), [](const std::string& line) {
    return line.starts_with("load cell: ") && line.find("the Net Box ") != std::string::npos;
  });
  EXPECT_EQ(told, 0) << "the stop itself says it";
  const auto journal = results::read_journal(results_->journal());
  const auto aborted = std::find_if(journal.entries.begin(), journal.entries.end(),
                                    [](const auto& entry) { return entry.event == results::kRunAborted; });
  ASSERT_NE(aborted, journal.entries.end());
  EXPECT_THAT(aborted->data.at("reason").get<std::string>(), HasSubstr("its samples cannot be trusted"));
}

TEST_F(FaultyCampaign, BearsAnErrorOfOneDatagramFlaggedAndTellsIt) {
  (void)run("  - {at_s: 1.75, for_s: 0.005, kind: status, bits: 0x88000000}\n");
  EXPECT_THAT(flags(0)[1], HasSubstr("bad_status"));
  EXPECT_EQ(flags(0)[2], "");
  ASSERT_THAT(events(0), testing::ElementsAre(EventKind::box_error, EventKind::box_error_ended));
  EXPECT_EQ(recording(0).events[1].records, 35u) << "5 ms at 7 kHz";
  EXPECT_EQ(said_.count("the Net Box "), 2) << "its beginning and its end";
  const auto journal = results::read_journal(results_->journal());
  const auto accepted = std::find_if(journal.entries.begin(), journal.entries.end(),
                                     [](const auto& entry) { return entry.event == results::kRunAccepted; });
  ASSERT_NE(accepted, journal.entries.end());
  EXPECT_EQ(accepted->data.at("events").size(), 2u);
  expect_replay_agrees();
}

TEST_F(FaultyCampaign, StopsBeforeTheMotorTurnsOnAZeroOfFaultySamples) {
  EXPECT_THROW((void)run("  - {at_s: 0.3, for_s: 0.05, kind: status, bits: 0x88000000}\n"), SafetyStop);
  const results::RunRecording run = results::read_run(results_->other_runs().at(0));
  EXPECT_EQ(run.phases.size(), 1u);
  EXPECT_THAT(run.outcome_reason, HasSubstr("its samples cannot be trusted"));
}

TEST_F(FaultyCampaign, TakesNoZeroOfNoSoundSample) {
  EXPECT_THROW((void)run("  - {at_s: 0, for_s: 20, kind: saturation, axes: 1}\n"), SafetyStop);
  const results::RunRecording run = results::read_run(results_->other_runs().at(0));
  EXPECT_EQ(run.phases.size(), 1u);
  EXPECT_THAT(run.outcome_reason, AllOf(HasSubstr("take the zero"), HasSubstr("no valid sample arrived")));
}

TEST_F(FaultyCampaign, BearsALatchedMonitorConditionWithoutAFlag) {
  (void)run("  - {at_s: 0, kind: status, bits: 0x80010000}\n");
  EXPECT_EQ(flags(0), (std::vector<std::string>{"", "", "", ""}));
  EXPECT_THAT(events(0), testing::IsEmpty());
}

TEST_F(FaultyCampaign, NamesTheErrorsOfAnAxiaByItsOwnBits) {
  EXPECT_THAT([&] { (void)run("  - {at_s: 2.0, kind: status, bits: 0x80000004}\nquirks: {axia: true}\n"); },
              ThrowsMessage<SafetyStop>(HasSubstr("the Axia reports \"broken gage\" (status 0x80000004)")))
      << "the motor turned on the samples of a broken gage";
  EXPECT_TRUE(motor_is_let_go());
}

TEST_F(FaultyCampaign, BearsAShortSaturationOfAnAxiaFlagged) {
  (void)run("  - {at_s: 1.5, for_s: 0.2, kind: saturation, axes: 1}\nquirks: {axia: true}\n");
  EXPECT_THAT(flags(0)[1], HasSubstr("saturated"));
  EXPECT_THAT(flags(0)[1], Not(HasSubstr("bad_status")));
  EXPECT_THAT(events(0), testing::ElementsAre(EventKind::beyond_range));
}

TEST_F(FaultyCampaign, FlagsAllStepsOfARunInWhichTheBoxWasGivenOtherUnits) {
  const CampaignResult result = run("  - {at_s: 1.5, kind: units, force_unit: 4}\n");  // kN
  EXPECT_EQ(result.runs, 2);
  for (const std::string& names : flags(0)) EXPECT_THAT(names, HasSubstr("configuration_changed"));
  EXPECT_EQ(flags(1), (std::vector<std::string>{"", "", "", ""})) << "read with its own scale";
  EXPECT_THAT(events(0), testing::ElementsAre(EventKind::configuration_changed));
  EXPECT_EQ(said_.count("configuration changed since the run began: units, counts per unit; all steps"), 1);
  EXPECT_EQ(said_.count("configuration changed since it was last read: units, counts per unit; recording this run"), 1);
  constexpr double kTrueK5x3 = 1.7e-8 / (kRadPerSecPerRpm * kRadPerSecPerRpm);
  const auto steps = reduce(recording(0));
  EXPECT_LT(steps[3].thrust_n, 0.5 * kTrueK5x3 * steps[3].speed_rad_s * steps[3].speed_rad_s) << "a wrong number";
  expect_replay_agrees();
}

TEST_F(FaultyCampaign, RefusesTheNextRunOfABoxThatNoLongerSuitsTheCampaign) {
  EXPECT_THAT(
      [&] {
        (void)run("  - {at_s: 1.5, kind: units, force_unit: 5}\n");  // whole kilograms of force
      },
      ThrowsMessage<ConfigurationError>(HasSubstr("one count is 9.81 N")))
      << "a thrust of 0 N without a flag";
  for (const std::string& names : flags(0)) EXPECT_THAT(names, HasSubstr("configuration_changed"));
  EXPECT_EQ(results_->complete_runs().size(), 1u);
}

TEST_F(FaultyCampaign, SaysThatItDoesNotKnowWhenTheBoxCannotBeReadAgain) {
  EXPECT_EQ(run("  - {at_s: 1.5, count: 2, kind: http_status, code: 500}\n").runs, 2);
  EXPECT_THAT(events(0), testing::ElementsAre(EventKind::unreachable));
  EXPECT_THAT(said_.lines, Contains(HasSubstr("configuration not verified after the run")));
  EXPECT_EQ(flags(0), (std::vector<std::string>{"", "", "", ""}));
}

TEST_F(FaultyCampaign, FlagsARunAtWhoseEndThePageOfTheBoxMakesNoSense) {
  EXPECT_EQ(run("  - {at_s: 1.5, count: 2, kind: http_charset, utf16: true}\n").runs, 2);
  ASSERT_THAT(events(0), testing::ElementsAre(EventKind::unusable));
  EXPECT_THAT(recording(0).events[0].text, HasSubstr("NUL byte"));
  for (const std::string& names : flags(0)) EXPECT_EQ(names, "configuration_changed");
  expect_replay_agrees();
}

TEST_F(FaultyCampaign, TakesOneLostPageForNothing) {
  EXPECT_EQ(run("  - {at_s: 1.5, count: 1, kind: http_status, code: 500}\n").runs, 2);
  EXPECT_THAT(events(0), testing::IsEmpty());
}

TEST_F(FaultyCampaign, TellsWhatUnitsHaveToDoWithALimitThatWasPassed) {
  try {
    (void)run(
        "  - {at_s: 0, kind: units, force_unit: 4}\n"      // kN, a thousandth of a newton per count
        "  - {at_s: 2.5, kind: units, force_unit: 2}\n");  // N, a millionth
    FAIL() << "thousands of newtons were taken for granted";
  } catch (const SafetyStop&) {
    EXPECT_THAT(said_.lines, Contains(HasSubstr("configuration changed")));
  }
  EXPECT_TRUE(motor_is_let_go());
}

TEST_F(FaultyCampaign, FlagsAllStepsOfARunDuringWhichTheZeroDrifted) {
  EXPECT_EQ(run("  - {at_s: 1.0, kind: zero_drift, amount: 1, tau_s: 1}\n").runs, 2);
  for (const std::string& names : flags(0)) EXPECT_THAT(names, testing::StartsWith("zero_drifted"));
  EXPECT_THAT(said_.lines, Contains(AllOf(HasSubstr("zero moved by 0.9"), HasSubstr("limit 0.03 N"))));
  expect_replay_agrees();
}

TEST_F(FaultyCampaign, RefusesANoisyZeroBeforeAnythingTurns) {
  try {
    (void)run("  - {at_s: 0.45, kind: zero_drift, amount: 2, tau_s: 0.01}\n");
    FAIL() << "a zero during which the load jumped was taken";
  } catch (const SafetyStop& stop) {
    EXPECT_THAT(stop.what(), AllOf(HasSubstr("take the zero"), HasSubstr("Fz is noisy"), HasSubstr("limit 0.15 N"),
                                   HasSubstr("come to rest")));
  }
  for (const auto& reading : results::read_run(results_->other_runs().at(0)).motor) {
    EXPECT_TRUE(reading.channel != MotorChannel::speed || std::abs(reading.value) < 1.0) << reading.value;
  }
}

TEST_F(FaultyCampaign, StopsWhenTheBoxRepeatsItselfForLongAndSaysSo) {
  // Whoever looks first: the interlock, or with a more patient one the silence.
  EXPECT_THAT(
      [&] { (void)run("  - {at_s: 1.5, for_s: 1.5, kind: stall}\n"); },
      ThrowsMessage<SafetyStop>(AllOf(AnyOf(HasSubstr("newest load-cell sample"), HasSubstr("the stream fell silent")),
                                      HasSubstr("the box repeats one measurement"))))
      << "the motor went on turning without a measurement";
  EXPECT_TRUE(motor_is_let_go());
}

TEST_F(FaultyCampaign, RefusesAPageInUtf16) {
  EXPECT_THAT([&] { (void)run("  - {at_s: 0, for_s: 10, kind: http_charset, utf16: true}\n"); },
              ThrowsMessage<DeviceError>(AllOf(HasSubstr("NUL byte"), HasSubstr("power-cycle"))))
      << "a page with NUL bytes was taken";
}

TEST_F(FaultyCampaign, KeepsTheScriptBesideTheBenchFile) {
  (void)run("  []\n");
  EXPECT_EQ(test::bytes_of(results_->faults_file()), "format: kphi-faults/1\nfaults:\n  []\n");
  const auto started = results::read_journal(results_->journal()).entries.at(0);
  EXPECT_EQ(started.data.at("faults_sha256"), results::sha256_of_file(results_->faults_file()));
}

TEST_F(FaultyCampaign, TurnsNothingWhileNoSampleComes) {
  EXPECT_THROW((void)run("  - {at_s: 0.5, kind: taken_over}\n"), SafetyStop);  // in the zero before the steps
  const results::RunRecording aborted = results::read_run(results_->other_runs().at(0));
  EXPECT_EQ(aborted.phases.back().phase, results::Phase::zero_before);
}

/// What a person sees at the end of each step.
class ShownSteps final : public Progress {
 public:
  void tick(const Position&, const Observation& seen) override { check(seen); }
  void step_done(const Position&, const Observation& seen) override { check(seen); }
  Duration oldest_shown{0};
  int stale = 0;

 private:
  void check(const Observation& seen) {
    if (seen.load_cell_is_fresh()) oldest_shown = std::max(oldest_shown, seen.load_cell_age);
    stale += !seen.load_cell_is_fresh();
  }
};

TEST_F(FaultyCampaign, ShowsNoOldThrustAsFreshWhenTheStreamIsTakenOver) {
  const auto script = folder_.path() / "taken_over.yaml";
  std::ofstream(script) << "format: kphi-faults/1\nfaults: [{at_s: 2.0, kind: taken_over}]\n";
  config_ = test::deterministic_config(4, script.string());
  DeterministicBench bench(config_);
  const auto results = results::CampaignFolder::create(folder_.path(), "u", "c");
  AutoConfirmOperator person;
  ShownSteps shown;
  EXPECT_THROW((void)run_campaign(bench, campaign_, config_, results, person, shown, [] { return false; }), SafetyStop);
  EXPECT_GT(shown.stale, 5);
  EXPECT_LT(shown.oldest_shown, std::chrono::milliseconds(80));
}

TEST_F(FaultyCampaign, StopsWhenTheStreamIsTakenOverAndSaysSo) {
  EXPECT_THAT([&] { (void)run("  - {at_s: 2.0, kind: taken_over}\n"); },
              ThrowsMessage<SafetyStop>(HasSubstr("another client has taken the stream")))
      << "a stream taken over went unnoticed";
  EXPECT_TRUE(motor_is_let_go());
}

TEST_F(FaultyCampaign, StopsWhenTheBoxGoesAndSaysThatItDoesNotAnswer) {
  EXPECT_THAT([&] { (void)run("  - {at_s: 2.0, kind: reboot, down_s: 100}\n"); },
              ThrowsMessage<SafetyStop>(HasSubstr("does not answer over HTTP")))
      << "a dead box went unnoticed";
  EXPECT_TRUE(motor_is_let_go());
}

TEST_F(FaultyCampaign, RefusesABoxWhosePagesCannotBeRead) {
  EXPECT_THROW((void)run("  - {at_s: 0, for_s: 10, kind: http_status, code: 500}\n"), DeviceError);
  EXPECT_THROW((void)run("  - {at_s: 0, for_s: 10, kind: http_refused}\n"), DeviceError);
  EXPECT_THROW((void)run("  - {at_s: 0, for_s: 10, kind: http_slow, delay_s: 6}\n"), DeviceError);
  EXPECT_NO_THROW((void)run("  - {at_s: 0, count: 1, kind: http_slow, delay_s: 2}\n"));
}

TEST_F(FaultyCampaign, RefusesAScriptThatIsNone) {
  EXPECT_THROW((void)run("  - {at_s: 2.0, kind: earthquake}\n"), ConfigurationError);
  EXPECT_THROW(DeterministicBench(test::deterministic_config(1, "/nowhere/faults.yaml")), ConfigurationError);
}

TEST_F(FaultyCampaign, GoesOnBeyondARangeFlaggedWithOneWarning) {
  (void)run("  - {at_s: 1.5, for_s: 0.2, kind: saturation, axes: 1}\n");
  EXPECT_THAT(flags(0)[1], HasSubstr("saturated"));
  EXPECT_EQ(flags(0)[3], "");
  EXPECT_THAT(events(0), testing::ElementsAre(EventKind::beyond_range));
  EXPECT_THAT(said_.lines, Contains(HasSubstr("Fx carries 100 % of its range of 20 N")));
}

/// A gage bias shifts what the box shows: at the end of the range of the gages it then shows more than the range.
class ShiftedCell : public FaultyCampaign {
  void prepare(DeterministicBench& bench) override {
    sim::NetBoxSettings settings;
    settings.bias_vector[0] = -6554;  // a fifth of the range
    bench.simulation().netbox().configure(settings);
  }
};

TEST_F(ShiftedCell, LetsTheMotorGoAboveATenthBeyondARange) {
  EXPECT_THAT([&] { (void)run("  - {at_s: 2.0, for_s: 1, kind: saturation, axes: 1}\n"); },
              ThrowsMessage<SafetyStop>(HasSubstr("load cell: Fx carries 120 % of its range of 20 N")))
      << "the cell was loaded with 120 % of its range";
  EXPECT_TRUE(motor_is_let_go());
  const auto aborted = results_->other_runs();
  ASSERT_EQ(aborted.size(), 1u);
  const results::RunRecording run = results::read_run(aborted[0]);
  EXPECT_EQ(run.outcome, results::Outcome::aborted);
  EXPECT_EQ(run.events.back().kind, EventKind::range_trip);
  EXPECT_GT(run.load_cell.back().arrival_ns, 2'000'000'000) << "the last samples are kept";
}

TEST_F(FaultyCampaign, TakesTheBoxesBiasAsAMeasuredStepWhenTheCampaignSaysSo) {
  campaign_ = profiles::parse_campaign(test::short_campaign_text() + "box_bias: true\n", "short.yaml");
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
  EXPECT_EQ(flags(0), (std::vector<std::string>{"", "", "", ""}));
  expect_replay_agrees();
}

TEST_F(FaultyCampaign, TakesNoBiasFromSamplesThatAreNotSound) {
  campaign_ = profiles::parse_campaign(test::short_campaign_text() + "box_bias: true\n", "short.yaml");
  EXPECT_THAT([&] { (void)run("  - {at_s: 0, for_s: 20, kind: saturation, axes: 1}\n"); },
              ThrowsMessage<SafetyStop>(AllOf(HasSubstr("take the bias"), HasSubstr("no valid sample arrived"))))
      << "a saturated cell was biased";
  EXPECT_EQ(results::read_run(results_->other_runs().at(0)).outcome, results::Outcome::aborted);
}

TEST_F(FaultyCampaign, TakesNoBiasUnasked) {
  (void)run("  []\n");
  EXPECT_EQ(recording(0).box_bias.records, 0u);
  EXPECT_EQ(recording(0).phases.at(0).phase, results::Phase::zero_before);
}

TEST_F(FaultyCampaign, KeepsThePagesOfAllSlotsAndTheHealthOfTheStream) {
  (void)run("  []\n");
  const results::RunRecording run = recording(1);
  EXPECT_THAT(run.header.load_cell.slots_json, AllOf(HasSubstr("netftapi2.xml?index=15"), HasSubstr("FT21001")));
  EXPECT_NEAR(run.health.records_per_second, 7000, 1);
  EXPECT_NEAR(run.health.datagrams_per_second, 175, 1);
}

}  // namespace faulty_campaign_test
}  // namespace kphi::daq
