// Whole campaigns on the deterministic bench, each in another order.
#include "daq/campaign/campaign_review.hpp"

#include "daq/campaign/resume.hpp"
#include "test/daq/campaign_on_bench.hpp"

namespace kphi::daq {
namespace campaign_review_test {

using nlohmann::json;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

class OrderedCampaign : public CampaignOnBench {
 protected:
  /// Steps long enough to settle. `more`: further lines of the campaign file.
  static profiles::Campaign campaign(const std::string& occlusions, int repetitions, const std::string& more,
                                     const std::string& more_profile = {}, int last_rpm = 15000) {
    return profiles::parse_campaign(
        fmt::format("format: kphi-campaign/1\nname: ordered\n"
                    "propeller: {{id: 5x3, name: 5-inch three-blade, diameter_in: 5, blades: 3}}\n"
                    "occlusions_deg: [{}]\nrepetitions: {}\n"
                    "profile: {{steps: 4, dwell_s: 1.4, first_rpm: 9000, last_rpm: {}{}}}\n"
                    "zero_s: 1.0\nminimum_discard_s: 0.6\nsupply_v: 12.0\n"
                    "limits: {{speed_max_rpm: 19100, thrust_max_n: 20, supply_current_max_a: 35, "
                    "coil_temperature_max_degc: 110}}\n{}",
                    occlusions, repetitions, last_rpm, more_profile, more),
        "ordered.yaml");
  }
  std::vector<std::string> runs_in_order() {
    std::vector<std::string> names;
    for (const json& data : journaled("run_accepted")) names.push_back(data.at("file").get<std::string>().substr(5));
    return names;
  }
  /// Pretends that somebody moved the occlusion, unasked, once a line says `when`.
  void move_occlusion(const std::string& when, double to_deg) {
    said_.then = [this, when, to_deg, before = said_.then](const std::string& line) {
      if (before) before(line);
      if (line.find(when) != std::string::npos) bench_->mounted("5x3", to_deg);
    };
  }
  /// As if the occlusion had stood elsewhere during the second of several runs.
  void spoil_second_run() {
    move_occlusion("5x3_phi000_rep1.h5", 20);
    move_occlusion("5x3_phi000_rep2.h5", 0);
  }
};

std::vector<double> speeds_rpm(const std::filesystem::path& run) {
  std::vector<double> speeds;
  for (const auto& mark : results::read_run(run).phases) {
    if (mark.phase == results::Phase::step) speeds.push_back(std::round(to_rpm(RadPerSec(mark.speed_rad_s))));
  }
  return speeds;
}

TEST_F(OrderedCampaign, ShuffledByASeedAsksForOneMountingPerBlockAndLeavesTheSameFiles) {
  (void)run(campaign("0, 90, 270", 2, "order: {runs: shuffled, seed: 4}\n"));
  const auto plan = profiles::make_plan(campaign_, config_);
  EXPECT_NE(plan.mounting_angles(), (std::vector<double>{0, 90, 270})) << "choose a seed that shuffles";
  EXPECT_EQ(person_.mounted_deg, plan.mounting_angles());
  std::vector<std::string> planned;
  for (const auto& one : plan.runs) planned.push_back(results::run_file_name("5x3", one.occlusion_deg, one.repetition));
  EXPECT_EQ(runs_in_order(), planned);
  ASSERT_EQ(steps().size(), 24u);
  EXPECT_EQ(steps().front().occlusion_deg, 0) << "rows are as listed, whatever the order of the runs";
  EXPECT_EQ(steps().back().occlusion_deg, 270);
  expect_whole();
}

TEST_F(OrderedCampaign, MountedAnewForEachRunAsksEachTime) {
  (void)run(campaign("0, 90", 2, "order: {runs: shuffled, seed: 3, remount_each_repetition: true}\n"));
  EXPECT_EQ(person_.mounted_deg.size(), 4u);
  EXPECT_EQ(journaled("mounted").size(), 4u);
  expect_whole();
}

TEST_F(OrderedCampaign, DownwardsBeginsAtTheTopAndNumbersLevelsAsEver) {
  (void)run(campaign("0", 1, "order: {steps: down}\n"));
  EXPECT_THAT(speeds_rpm(runs().at(0)), ElementsAre(15000, 13000, 11000, 9000));
  EXPECT_EQ(steps().front().step, 3);
  EXPECT_EQ(steps().back().step, 0);
  expect_whole();
}

TEST_F(OrderedCampaign, ShuffledStepsDifferFromRunToRunAndAreAveragedByLevel) {
  (void)run(campaign("0", 3, "order: {steps: shuffled, seed: 8}\n"));
  EXPECT_NE(speeds_rpm(runs().at(0)), speeds_rpm(runs().at(1)));
  for (const auto& mean : means())
    EXPECT_NEAR(to_rpm(RadPerSec(mean.commanded_speed_rad_s)), 9000 + 2000 * mean.step, 1e-6);
  for (const auto& step : steps())
    EXPECT_NEAR(step.speed_rad_s / step.commanded_speed_rad_s, 1, 0.01)
        << results::quality_flag_names(step.quality_flags);
  expect_whole();
}

TEST_F(OrderedCampaign, UpAndDownTellsTheHysteresisOfEachRun) {
  (void)run(campaign("0, 90", 1, "order: {steps: up_and_down}\n"));
  EXPECT_THAT(speeds_rpm(runs().at(0)), ElementsAre(9000, 11000, 13000, 15000, 13000, 11000, 9000));
  const auto told = journaled("hysteresis");
  ASSERT_EQ(told.size(), 2u);
  EXPECT_EQ(told[0].at("run"), "5x3_phi000_rep1.h5");
  EXPECT_EQ(told[0].at("speeds").size(), 3u);
  EXPECT_LT(std::abs(told[0].at("share_of_k").get<double>()), 0.003) << "the simulated propeller has none";
  EXPECT_THAT(said_.lines, Contains(HasSubstr("5x3_phi000_rep1.h5: thrust going up minus going down: ")));
  expect_whole();
}

TEST_F(OrderedCampaign, ReferenceRunsStandApartAndTellWhatDrifted) {
  move_occlusion("5x3_phi090_rep1.h5", 0);  // the last reference run is asked for next: mounted() then says 0
  (void)run(campaign("90", 1, "order: {reference: true}\n"));
  EXPECT_THAT(person_.mounted_deg, ElementsAre(0, 90, 0));
  EXPECT_THAT(runs_in_order(), ElementsAre("5x3_phi000_ref1.h5", "5x3_phi090_rep1.h5", "5x3_phi000_ref2.h5"));
  for (const auto& step : steps()) EXPECT_EQ(step.occlusion_deg, 90);
  const auto references = results::read_steps(results_->references());
  ASSERT_EQ(references.size(), 8u);
  EXPECT_EQ(references.front().repetition, -1);
  EXPECT_EQ(references.back().repetition, -2);
  EXPECT_EQ(test::bytes_of(results_->references()), results::format_steps(steps_of(results_->reference_runs())));
  const auto drift = journaled("reference_drift");
  ASSERT_EQ(drift.size(), 1u);
  EXPECT_EQ(drift[0].at("drifted"), false) << drift[0];
  EXPECT_THAT(said_.lines.back(), HasSubstr("from the first to the last reference run k changed by"));
  expect_whole();
}

TEST_F(OrderedCampaign, SaysWhenTheBenchHasDriftedBetweenTheReferenceRuns) {
  move_occlusion("5x3_phi000_rep1.h5", 20);  // no mounting is asked for: whoever bumps the plate is not noticed
  (void)run(campaign("0", 1, "order: {reference: true}\n"));
  EXPECT_THAT(person_.mounted_deg, ElementsAre(0));
  EXPECT_EQ(journaled("reference_drift").at(0).at("drifted"), true);
  EXPECT_LT(journaled("reference_drift").at(0).at("share").get<double>(), -0.02);
  EXPECT_THAT(said_.lines.back(), HasSubstr("the bench has drifted"));
}

TEST_F(OrderedCampaign, RunsAnOutlyingRepetitionAgainAndKeepsIt) {
  const auto three = campaign("0", 3, "");
  spoil_second_run();
  const CampaignResult result = run(three);
  EXPECT_EQ(result.runs, 4);
  ASSERT_EQ(person_.questions.size(), 1u) << "then three agree";
  EXPECT_THAT(person_.questions[0].reason, HasSubstr("repetition 2"));
  EXPECT_EQ(person_.mounted_deg.size(), 1u);
  EXPECT_EQ(steps().size(), 16u) << "it stays on record";
  EXPECT_EQ(means().at(0).repetitions_left_out, 0)
      << "a repetition is not left out just because it is far from the others";
  const auto judged = journaled("repetitions_judged");
  ASSERT_EQ(judged.size(), 2u);
  EXPECT_EQ(judged[1].at("repetitions").at(1).at("outlying"), true);
  EXPECT_EQ(journaled("another_run").at(0).at("decided"), true);
  EXPECT_THAT(said_.lines, Contains(HasSubstr("run  4/4  5x3_phi000_rep4.h5")));
  expect_whole();
}

/// What a person reads beside a campaign that takes ten minutes: each time that percent, run, step or time left falls
/// back, and no line said why since the last one.
class WatchedProgress : public OrderedCampaign {
 protected:
  WatchedProgress() {
    said_.at_tick = [this](const Position& at, const Observation&) {
      const bool same_run = at.run == last_.run && at.repetition == last_.repetition && !said({"resumed"});
      if ((std::floor(100 * at.done) < std::floor(100 * last_.done) && !said({"runs in all", "resumed"})) ||
          (at.run < last_.run) || (same_run && at.step >= 0 && at.step < last_.step) ||
          (at.remaining_s > last_.remaining_s + 1 && !said({"time left: ", "resumed"})) ||
          (at.remaining_s > last_.remaining_s + 1e-6 && said_.lines.size() == lines_))
        fallen_.push_back(fmt::format("run {} step {}: {:.4f} to {:.4f}, step {}, {:.1f} to {:.1f} s left", at.run,
                                      at.step, last_.done, at.done, last_.step, last_.remaining_s, at.remaining_s));
      last_ = at, lines_ = said_.lines.size(), ++ticks_;
    };
    last_.remaining_s = 1e9;
  }
  /// Any of these, since the last tick.
  [[nodiscard]] bool said(const std::vector<std::string>& words) const {
    return std::any_of(said_.lines.begin() + static_cast<std::ptrdiff_t>(lines_), said_.lines.end(),
                       [&](const std::string& line) {
                         return std::ranges::any_of(
                             words, [&](const std::string& one) { return line.find(one) != std::string::npos; });
                       });
  }
  void expect_no_fall() const {
    EXPECT_THAT(fallen_, IsEmpty());
    EXPECT_GT(ticks_, 1000);
    EXPECT_NEAR(last_.done, 1, 1e-9) << "the end is the end";
  }
  Position last_;
  int ticks_ = 0;
  std::size_t lines_ = 0;
  std::vector<std::string> fallen_;
};

TEST_F(WatchedProgress, NeverFallsBackInAPlainCampaign) {
  EXPECT_EQ(run(campaign("0, 90", 2, "")).runs, 4);
  expect_no_fall();
}

TEST_F(WatchedProgress, FallsWithAWordWhenARunIsAdded) {
  spoil_second_run();
  EXPECT_EQ(run(campaign("0", 3, "")).runs, 4);
  expect_no_fall();
  EXPECT_THAT(said_.lines, Contains(HasSubstr("time left: "))) << "it says that it grew";
}

TEST_F(WatchedProgress, NeverFallsBackWhereStepsEndByThemselves) {
  auto until = campaign("0, 90", 2, "");
  until.profile.until = profiles::Until{0.002, Seconds(0.9)};
  EXPECT_EQ(run(until).runs, 4);
  expect_no_fall();
}

TEST_F(WatchedProgress, NeverFallsBackWithReferenceRuns) {
  EXPECT_EQ(run(campaign("90", 2, "order: {reference: true}\n")).runs, 4);
  expect_no_fall();
}

TEST_F(WatchedProgress, NeverFallsBackWhereStepsAreFlagged) {
  std::ofstream(folder_.path() / "faults.yaml")
      << "format: kphi-faults/1\nfaults:\n  - {at_s: 2, for_s: 20, kind: loss, p: 0.05, burst: 3}\n";
  config_ = test::deterministic_config(2, (folder_.path() / "faults.yaml").string());
  EXPECT_GT(run(campaign("0, 90", 2, "")).steps.flagged, 0u);
  expect_no_fall();
}

TEST_F(WatchedProgress, FallsWithAWordWhenACampaignIsResumed) {
  person_.refuse_at_deg = 90;
  EXPECT_THROW((void)run(campaign("0, 90", 2, "")), NotMounted);
  person_.refuse_at_deg = -1;
  const Resumption resumption = inspect(*results_, false);
  bench_.emplace(config_);
  EXPECT_EQ(go(*bench_, *results_, &resumption).runs, 4);
  expect_no_fall();
}

TEST_F(OrderedCampaign, DoesNotRunAgainWhenThePersonOrTheCampaignSaysNo) {
  spoil_second_run();
  person_.decision = false;
  EXPECT_EQ(run(campaign("0", 3, "")).runs, 3);
  EXPECT_EQ(person_.questions.size(), 1u);
  EXPECT_EQ(journaled("another_run").at(0).at("decided"), false);
  EXPECT_EQ(means().at(0).repetitions_left_out, 0);
}

TEST_F(OrderedCampaign, NeverAsksBeyondWhatTheCampaignAllows) {
  spoil_second_run();
  EXPECT_EQ(run(campaign("0", 3, "repetitions_extra_max: 0\n")).runs, 3);
  EXPECT_TRUE(person_.questions.empty());
  EXPECT_THAT(said_.lines, Contains(HasSubstr("0°: repetition 2 gives a k that is")));
}

TEST_F(OrderedCampaign, ChangesTheSpeedNoFasterThanItsSlewAndAveragesNoRamp) {
  (void)run(campaign("0", 1, "order: {steps: up_and_down}\n", ", slew_rpm_s: 4000"));
  const auto recording = results::read_run(runs().at(0));
  const auto plan = profiles::make_plan(campaign_, config_);
  double ramps_s = 0;
  for (std::size_t i = 0; i + 1 < recording.phases.size(); ++i) {
    if (recording.phases[i].phase == results::Phase::ramp)
      ramps_s += 1e-9 * static_cast<double>(recording.phases[i + 1].time_ns - recording.phases[i].time_ns);
  }
  EXPECT_NEAR(ramps_s, ramp_time(campaign_.profile, plan.runs[0]).value(), 0.1);
  EXPECT_NEAR(ramps_s, 9000 / 4000.0 + 6 * 2000 / 4000.0, 0.1);
  double last_s = 0, last = 0;
  for (const auto& reading : recording.motor) {
    if (reading.channel != MotorChannel::speed) continue;
    if (reading.time_ns > recording.phases.back().time_ns) break;
    const double now_s = 1e-9 * static_cast<double>(reading.time_ns);
    const double rpm = to_rpm(RadPerSec(std::abs(reading.value)));
    if (rpm > 2000 && rpm >= last && last_s > 0) {
      EXPECT_LT((rpm - last) / (now_s - last_s), 4000 * 1.5) << now_s;
    }
    last_s = now_s, last = rpm;
  }
  for (const auto& step : steps()) {
    EXPECT_EQ(results::quality_flag_names(step.quality_flags), "") << step.step;
    EXPECT_NEAR(step.speed_rad_s / step.commanded_speed_rad_s, 1, 0.002);
  }
  expect_whole();
}

std::string motor_on(double volts) {
  return fmt::format(
      "format: kphi-sim-motor/1\nsupply: {{voltage_v: {}}}\nsensors: {{voltage_gain_error_relative: 0}}\n", volts);
}

TEST_F(OrderedCampaign, LearnsFromASaturatedMotorHowFastLaterRunsMayGo) {
  use_motor(motor_on(8.3));
  auto weak = campaign("0, 90", 1, "", "", 18000);
  weak.supply = Volts(8.3);
  (void)run(weak);
  const auto caps = journaled("speed_cap");
  ASSERT_EQ(caps.size(), 1u) << test::bytes_of(results_->steps());
  EXPECT_EQ(caps[0].at("run"), "5x3_phi000_rep1.h5");
  EXPECT_THAT(said_.lines, Contains(HasSubstr("motor: full drive gives ")));
  const double cap_rpm = to_rpm(RadPerSec(caps[0].at("cap_rad_s").get<double>()));
  const auto second = speeds_rpm(runs().at(1));
  EXPECT_EQ(speeds_rpm(runs().at(0)).size(), 4u);
  EXPECT_LT(second.size(), 4u);
  EXPECT_NEAR(second.back(), cap_rpm, 1);
  EXPECT_EQ(journaled("run_accepted").at(1).at("steps_left_out"), 4 - second.size());
  expect_whole();
}

TEST_F(OrderedCampaign, LeavesOutWhatIsAboveASaturatedStepInTheSameRun) {
  use_motor(motor_on(7.8));
  auto weak = campaign("0", 2, "order: {steps: up_and_down}\n", "", 18000);
  weak.profile.steps = 7;  // every 1500 RPM, up and down
  weak.supply = Volts(7.8);
  (void)run(weak);
  EXPECT_THAT(said_.lines, Contains(testing::ContainsRegex("^motor: full drive gives [0-9]+ of [0-9]+ RPM; "
                                                           "skipping [0-9]+ steps at or above$")));
  std::vector<results::StepMean> first, second;
  for (const auto& step : steps()) (step.repetition == 1 ? first : second).push_back(step);
  const auto fell_short = [](const results::StepMean& step) {
    return (step.quality_flags & static_cast<std::uint32_t>(results::QualityFlag::speed_not_reached)) != 0;
  };
  EXPECT_EQ(std::count_if(first.begin(), first.end(), fell_short), 1) << "one step was pushed, no more";
  EXPECT_EQ(std::count_if(second.begin(), second.end(), fell_short), 0);
  const auto fastest = std::max_element(first.begin(), first.end(), [](const auto& a, const auto& b) {
    return a.commanded_speed_rad_s < b.commanded_speed_rad_s;
  });
  EXPECT_TRUE(fell_short(*fastest)) << "nothing above it was tried";
  EXPECT_LT(to_rpm(RadPerSec(fastest->commanded_speed_rad_s)), 17500);
  EXPECT_EQ(journaled("run_accepted").at(0).at("steps_left_out"), 13 - first.size());
  EXPECT_EQ(journaled("run_accepted").at(1).at("steps_left_out"), 13 - second.size());
  EXPECT_EQ(journaled("speed_cap").size(), 1u);
  expect_whole();
}

/// What one run leaves in the coil of the motor that is built in: some degrees, for the better part of a minute.
TEST_F(OrderedCampaign, WaitsBetweenRunsUntilTheCoilHasCooledDown) {
  auto warm = campaign("0", 2, "", "", 18000);
  warm.limits.cooling = profiles::Cooling{Celsius(27), Celsius(26.5)};
  (void)run(warm);
  const auto cooling = journaled("cooling"), cooled = journaled("cooled_down");
  ASSERT_EQ(cooling.size(), 1u) << "the first run begins cold, the second warm";
  ASSERT_EQ(cooled.size(), 1u) << "the pause ends";
  EXPECT_GT(cooling[0].at("coil_degc").get<double>(), 27);
  EXPECT_THAT(said_.lines, Contains(testing::ContainsRegex("^coil at [0-9]+ ..C: pausing until below 26.5 ..C$")));
  const double paused_s = cooled[0].at("seconds").get<double>();
  EXPECT_GT(paused_s, 1);
  ASSERT_EQ(runs().size(), 2u);
  const auto before = recording(0), after = recording(1);
  const auto coil_degc = [](const results::RunRecording& run) {
    std::vector<double> all;
    for (const auto& reading : run.motor)
      if (reading.channel == MotorChannel::coil_temperature && reading.time_ns >= run.load_cell.front().arrival_ns)
        all.push_back(reading.value);
    return all;
  };
  EXPECT_GT(coil_degc(before).back(), 27) << "warm at the end of the first";
  EXPECT_LT(coil_degc(after).front(), 26.6) << "cool at the begin of the second";
  const double apart_s =
      1e-9 * static_cast<double>(after.load_cell.front().arrival_ns - before.load_cell.back().arrival_ns);
  EXPECT_GE(apart_s, paused_s) << "nothing was driven meanwhile";
}

// Settled, and certain enough, after half a second behind the discard; the same k in a fraction of the time.
TEST_F(OrderedCampaign, EndsStepsThatAreCertainEnoughBeforeTheirTime) {
  const auto text = campaign("0", 1, "").text;
  const auto with = [&](const std::string& dwell) {
    std::string changed = text;
    changed.replace(changed.find("dwell_s: 1.4"), 12, dwell);
    changed.replace(changed.find("minimum_discard_s: 0.6"), 22, "minimum_discard_s: 0.3");
    return profiles::parse_campaign(changed, "until.yaml");
  };
  const auto held_s = [&] {
    std::vector<double> held;
    const auto phases = recording(0).phases;
    for (std::size_t i = 0; i + 1 < phases.size(); ++i)
      if (phases[i].phase == results::Phase::step)
        held.push_back(1e-9 * static_cast<double>(phases[i + 1].time_ns - phases[i].time_ns));
    return held;
  };
  (void)run(with("dwell_s: [0.9, 4], until: {k_percent: 0.5}"));
  ASSERT_EQ(held_s().size(), 4u);
  for (const double held : held_s()) {
    EXPECT_GE(held, 0.9);
    EXPECT_LT(held, 2);
  }
  for (const auto& step : steps()) {
    EXPECT_EQ(step.quality_flags, 0u);
    EXPECT_NEAR(step.thrust_n / (step.speed_rad_s * step.speed_rad_s), 1.55e-6, 0.02e-6);
  }
  expect_whole();
  (void)run(with("dwell_s: [0.9, 1.5], until: {k_percent: 0.01}"));
  for (const double held : held_s()) EXPECT_NEAR(held, 1.5, 0.02) << "never certain enough: held to its end";
}

/// 20 steps that end by themselves; as `repetitions` and `order` say.
profiles::Campaign until(std::string text, const std::string& repetitions, const std::string& k_percent) {
  const auto change = [&](const std::string& from, const std::string& to) {
    text.replace(text.find(from), from.size(), to);
  };
  change("repetitions: 2", "repetitions: " + repetitions);
  change("steps: 4, dwell_s: 1.4", "steps: 20, dwell_s: [0.9, 4], until: {k_percent: " + k_percent + "}");
  change("minimum_discard_s: 0.6", "minimum_discard_s: 0.3");
  return profiles::parse_campaign(text, "until.yaml");
}

TEST_F(OrderedCampaign, LeavesOutStepsThatItsKDoesNotNeed) {
  Position last;
  said_.at_tick = [&](const Position& position, const Observation&) {
    if (position.step >= 0) last = position;
  };
  (void)run(until(campaign("0", 2, "").text, "2", "0.5"));
  EXPECT_EQ(last.step + 1, 11);
  EXPECT_EQ(last.steps, 11) << "progress counts no step that is not needed";
  for (const json& accepted : journaled("run_accepted")) {
    EXPECT_EQ(accepted.at("steps_not_needed"), 9) << "every second, but the fastest";
    EXPECT_FALSE(accepted.contains("steps_left_out")) << "all could be reached";
  }
  EXPECT_EQ(speeds_rpm(runs().at(0)).size(), 11u);
  EXPECT_EQ(speeds_rpm(runs().at(0)).front(), 9000);
  EXPECT_EQ(speeds_rpm(runs().at(0)).back(), 15000);
  EXPECT_EQ(speeds_rpm(runs().at(0)), speeds_rpm(runs().at(1)));
  for (const auto& step : steps()) EXPECT_EQ(step.step % 2 == 0 || step.step == 19, true) << step.step;
  EXPECT_THAT(said_.lines, Contains(HasSubstr("0 of 11 steps flagged, 9 not needed")));
  expect_whole();
  (void)run(until(campaign("0", 2, "").text, "2", "0.01"));
  EXPECT_EQ(speeds_rpm(runs().at(0)).size(), 20u) << "never certain enough";
}

TEST_F(OrderedCampaign, RunsAnOcclusionAgainWhileThatWouldMoveItsK) {
  spoil_second_run();
  const std::string text = campaign("0, 90", 2, "").text;
  EXPECT_EQ(run(until(text, "[2, 4]", "0.5")).runs, 8) << "0° scatters, so 90° is not trusted either";
  EXPECT_TRUE(person_.questions.empty()) << "the campaign file has decided";
  const auto decided = journaled("another_run");
  ASSERT_EQ(decided.size(), 4u);
  EXPECT_EQ(decided[0].at("occlusion_deg"), 0);
  EXPECT_EQ(decided[0].at("decided_by"), "campaign file");
  EXPECT_THAT(said_.lines, Contains(testing::ContainsRegex("^0°: another run would move k by up to [0-9.]+ %, "
                                                           "0.5 % is enough: running it again, 3 of at most 4$")));
  EXPECT_THAT(said_.lines, Contains(HasSubstr("not run again: 4 runs are the most")));
  expect_whole();
}

TEST_F(WatchedProgress, FallsWithAWordWhereTheCampaignAddsRunsWhoseStepsEndByThemselves) {
  spoil_second_run();
  EXPECT_EQ(run(until(campaign("0, 90", 2, "").text, "[2, 4]", "0.5")).runs, 8);
  expect_no_fall();
}

TEST_F(OrderedCampaign, DoesNotRunAnOcclusionAgainThatIsKnown) {
  EXPECT_EQ(run(until(campaign("0, 90", 2, "").text, "[2, 4]", "0.5")).runs, 4);
  EXPECT_TRUE(journaled("another_run").empty());
  EXPECT_THAT(said_.lines, Contains(testing::ContainsRegex("^90°: another run would move k by up to [0-9.]+ %, "
                                                           "0.5 % is enough$")));
}

TEST_F(OrderedCampaign, RemountsForARunThatTheCampaignAdds) {
  const std::string text = campaign("0", 2, "order: {remount_each_repetition: true}\n").text;
  EXPECT_EQ(run(until(text, "[2, 3]", "0.01")).runs, 3) << "never that certain";
  EXPECT_THAT(person_.mounted_deg, ElementsAre(0, 0, 0));
}

TEST_F(OrderedCampaign, TellsAfterEachRunWhatIsKnownSoFar) {
  campaign_ = campaign("0", 2, "order: {reference: true}\n");
  prepare();
  AutoConfirmOperator robot;
  std::vector<std::size_t> steps;
  const SoFar so_far = [&](std::span<const results::StepMean> known) {
    steps.push_back(known.size());
    return known.size() > campaign_.profile.levels().size() ? std::string("so far: two runs") : std::string();
  };
  (void)run_campaign(*bench_, campaign_, config_, *results_, robot, said_, test::never, nullptr, nullptr, so_far);
  const std::size_t one = campaign_.profile.levels().size();
  EXPECT_THAT(steps, testing::ElementsAre(one, 2 * one)) << "reference runs do not count";
  EXPECT_EQ(std::ranges::count(said_.lines, "so far: two runs"), 1);
}

TEST_F(OrderedCampaign, JournalsWhatWasAskedAndAnswered) {
  campaign_ = campaign("0", 1, "");
  prepare();
  AutoConfirmOperator robot;
  (void)run_campaign(*bench_, campaign_, config_, *results_, robot, said_, test::never);
  EXPECT_EQ(journaled("mounted").at(0).at("confirmed_by"), "--yes");
}

}  // namespace campaign_review_test
}  // namespace kphi::daq
