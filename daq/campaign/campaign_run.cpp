#include "daq/campaign/campaign_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <utility>

#include "base/error.hpp"
#include "daq/campaign/at_the_stand.hpp"
#include "daq/campaign/campaign_review.hpp"
#include "daq/campaign/resume.hpp"
#include "daq/guard/interlock.hpp"
#include "daq/guard/rest_guard.hpp"
#include "daq/guard/run_stopped.hpp"
#include "daq/run/run.hpp"
#include "profiles/plan.hpp"
#include "profiles/stand_drawing.hpp"
#include "profiles/strict_yaml.hpp"
#include "results/journal.hpp"
#include "results/reduction/reduction.hpp"
#include "results/run_reader.hpp"

namespace kphi::daq {
namespace {

using nlohmann::json;

constexpr Duration kCoolingPoll = std::chrono::seconds(1);
constexpr Duration kCoolingTickWall = std::chrono::milliseconds(100);

json to_json(const iq::StopReport& stop) {
  const auto seconds = [](const std::optional<Duration>& time) { return time ? json(to_seconds(*time)) : json(); };
  return {{"confirmed", stop.safe()},
          {"time_to_coast_s", seconds(stop.time_to_coast)},
          {"time_to_standing_s", seconds(stop.time_to_standing)},
          {"words", stop.summary()}};
}

std::string rest_words(const std::optional<iq::StopReport>& stop) {
  if (!stop) return "";
  if (!stop->time_to_standing) return ", " + stop->summary();
  return fmt::format(", at rest after {:.1f} s", to_seconds(*stop->time_to_standing));
}

bool is_safety_stop(const std::exception_ptr& cause) { return as<SafetyStop>(cause) != nullptr; }

class CampaignRun {
 public:
  CampaignRun(Bench& bench, const profiles::Campaign& campaign, const profiles::BenchConfig& config,
              const results::CampaignFolder& folder, Operator& person, Progress& progress,
              const std::function<bool()>& stop_asked, const SoFar& so_far)
      : bench_(bench),
        campaign_(campaign),
        config_(config),
        folder_(folder),
        person_(person),
        progress_(progress),
        stop_asked_(stop_asked),
        so_far_(so_far),
        plan_(profiles::make_plan(campaign, config)),
        journal_(folder.journal(), bench.files()),
        review_(campaign, progress, [this](const char* event, const json& data) { note(event, data); }),
        planned_(static_cast<int>(plan_.runs.size())) {
    person.log_to([this](const char* event, const std::string& words, const std::optional<Duration>& took) {
      json data{{"words", words}};
      if (took) data["after_s"] = to_seconds(*took);
      note(event, data);
    });
  }
  ~CampaignRun() {
    person_.log_to({});
    person_.while_waiting({});
  }

  CampaignResult run(const Resumption* resumption, const std::vector<BenchFinding>* audited) {
    json identity = identity_of(campaign_, config_);
    add_devices(identity, bench_);
    if (resumption == nullptr || resumption->state.identity.is_null()) {
      keep_files();
      note(results::kCampaignStarted, identity);
    } else {
      resume(*resumption, std::move(identity));
    }
    try {
      require_awake(bench_.clock());
      note_findings(audited != nullptr ? *audited : audit_bench(bench_, campaign_, config_));
      for (const profiles::PlannedRun& planned : plan_.runs) {
        if (!is_accepted(planned)) execute_run(planned);
        if (!planned.is_reference()) add_repetitions(planned.occlusion_deg);
      }
      review_.conclude();
    } catch (...) {
      end_early(std::current_exception());
    }
    note(results::kCampaignFinished, {{"runs", result_.runs}});
    return result_;
  }

 private:
  /// Records the cause, and throws it again with what the person needs to continue.
  [[noreturn]] void end_early(std::exception_ptr cause) {
    if (has_slept(bench_.clock()) && !is_safety_stop(cause)) {
      SafetyStop stop(slept(bench_.clock()));
      StopWords words = stop.words();
      words.also(words_of(cause).line());
      cause = std::make_exception_ptr(SafetyStop(words));
    }
    StopWords words = words_of(cause);
    note_the_end("campaign_stopped", {{"reason", words.line()}, {"safety_stop", is_safety_stop(cause)}});
    const std::string runs =
        fmt::format("{} of {} runs finished, in {}", result_.runs, planned_, folder_.path().string());
    const std::string how = fmt::format("continue with: kphi run {} --bench {} --resume {}", campaign_.path,
                                        config_.path, folder_.path().string());
    words.data =
        (words.data.empty() ? runs : fmt::format("{}; this run so far in {}", runs, words.data)) + "\n         " + how;
    try {
      std::rethrow_exception(cause);
    } catch (const SafetyStop&) {
      throw SafetyStop(words);
    } catch (const NotMounted&) {
      throw NotMounted(words);
    } catch (const Interrupted&) {
      throw Interrupted(words);
    } catch (...) {
      progress_.say(runs);
      progress_.say(how);
      throw;
    }
  }

  /// Copies the campaign's files, and those that the bench file names.
  void keep_files() {
    keep_copy(folder_.campaign_file(), campaign_.text, bench_.files());
    keep_copy(folder_.bench_file(), config_.text, bench_.files());
    if (!config_.simulation) return;
    const auto keep = [&](const std::string& file, const std::filesystem::path& copy) {
      if (!file.empty()) keep_copy(copy, profiles::read_text(file), bench_.files());
    };
    keep(config_.simulation->faults, folder_.faults_file());
    keep(config_.simulation->motor, folder_.motor_file());
  }

  void resume(const Resumption& resumption, json identity) {
    const std::vector<std::string> changes = require_unchanged(folder_, resumption, identity);
    if (!changes.empty()) keep_files();
    const std::vector<std::string> aside = results::set_leftovers_aside(folder_, resumption.state, bench_.files());
    if (!resumption.state.safety_stop.empty()) {
      if (resumption.cleared_by.empty())
        throw ConfigurationError("a safety stop ended this campaign and has not been cleared: " +
                                 resumption.state.safety_stop);
      identity["cleared_safety_stop"] = {{"reason", resumption.state.safety_stop}, {"by", resumption.cleared_by}};
    }
    identity["accepted_runs"] = resumption.state.accepted.size();
    if (!changes.empty()) identity["accepted_changes"] = changes;
    if (!aside.empty()) identity["set_aside"] = aside;
    note(results::kCampaignResumed, identity);
    for (const std::string& change : changes) progress_.say("resuming although " + change);
    for (const std::string& file : aside) progress_.say("unfinished run kept as " + file);
    std::optional<double> before_deg;  // of the run before
    for (const results::AcceptedRun& run : resumption.state.accepted) {
      const auto file = folder_.path() / run.file;
      const results::RunRecording recording = results::read_run(file);
      const std::vector<results::StepMean> means = reduce(recording);
      const double occlusion_deg = recording.header.occlusion_deg;
      const bool is_reference = recording.header.repetition < 0;
      // What came after an occlusion was whole shows that its repetitions were found to do.
      if (before_deg && (is_reference || occlusion_deg != *before_deg) && is_whole(*before_deg))
        judged_.insert(*before_deg);
      before_deg = is_reference ? std::nullopt : std::optional(occlusion_deg);
      review_.restore(means);
      count(file, recording, means);
      accepted_at_ = Instant(run.time_ns);
    }
    if (result_.runs > 0) review_.write(folder_, bench_.files());
    const auto open = std::ranges::count_if(
        plan_.runs, [this](const profiles::PlannedRun& planned) { return !is_accepted(planned); });
    planned_ = result_.runs + static_cast<int>(open);
    progress_.say(fmt::format("resumed: {} of {} runs accepted", result_.runs, planned_));
  }

  [[nodiscard]] std::filesystem::path file_of(const profiles::PlannedRun& planned) const {
    return folder_.run(campaign_.propeller.id, planned.occlusion_deg, planned.repetition);
  }

  [[nodiscard]] bool is_accepted(const profiles::PlannedRun& planned) const {
    return accepted_.contains(file_of(planned).filename().string());
  }

  /// All planned repetitions are there.
  [[nodiscard]] bool is_whole(double occlusion_deg) const {
    return review_.repetitions(occlusion_deg) >= campaign_.repetitions;
  }

  void execute_run(const profiles::PlannedRun& planned) {
    mount(planned);
    bench_.begin_run(
        {planned.occlusion_deg, planned.repetition, campaign_.order.remount_each_repetition, accepted_at_});
    const auto file = file_of(planned);
    const double planned_s = plan_.bench.value() / static_cast<double>(plan_.runs.size());
    const Instant begun = bench_.clock().now();
    // Where runs end by themselves, each takes as long as the one before.
    const double expected_s = last_run_s_.value_or(planned_s);
    const double later_s = expected_s * (planned_ - result_.runs - 1);
    promise(expected_s + later_s, later_s);
    profiles::PlannedRun capped = planned;
    review_.cap().apply(capped.steps);
    try {
      cool_down();
      if (config_.ambient.known() && !bench_.air())
        progress_.say("air: no current reading; air density of this run unknown");
      const auto awake = keep(&Bench::keep_awake, "may_sleep");
      const RunOrder order{campaign_,
                           config_,
                           *mounted_,
                           capped,
                           expected_s,
                           !last_run_s_,
                           later_s,
                           file,
                           nullptr,
                           static_cast<int>(result_.runs) + 1,
                           static_cast<int>(planned_),
                           result_.samples};
      (void)keep(&Bench::keep_prompt, "may_be_late");  // asked for again by the run itself: only to tell a refusal
      const RunResult recorded = record_run(bench_, order, progress_, stop_asked_);
      if (campaign_.profile.until) last_run_s_ = to_seconds(bench_.clock().now() - begun);
      accept(recorded, planned);
    } catch (...) {
      const auto cause = std::current_exception();
      note_the_end(results::kRunAborted, {{"run", file.filename().string()},
                                          {"reason", words_of(cause).line()},
                                          {"safety_stop", is_safety_stop(cause)}});
      throw;
    }
  }

  /// Time left never grows without a word.
  void promise(double left_s, double after_this_run_s) {
    const double longer_s = to_seconds(bench_.clock().shrunk(from_seconds(left_s - promised_s_.value_or(left_s))));
    if (longer_s > 1)
      progress_.say(fmt::format("time left: {:.0f} s more than said before, {} runs in all", longer_s, planned_));
    promised_s_ = after_this_run_s;
  }

  /// Once all repetitions are there: adds runs while they disagree and the operator agrees, or the campaign says so.
  void add_repetitions(double occlusion_deg) {
    if (!is_whole(occlusion_deg) || !judged_.insert(occlusion_deg).second) return;
    while (const auto question = review_.another(occlusion_deg)) {
      const bool yes = question->decided || ask_for_another(*question);
      note("another_run", {{"occlusion_deg", occlusion_deg},
                           {"reason", question->reason},
                           {"decided", yes},
                           {"decided_by", question->decided ? "campaign file" : person_.name()}});
      if (!yes) return;
      ++planned_;
      execute_run(profiles::extra_run(campaign_, occlusion_deg, review_.repetitions(occlusion_deg) + 1));
    }
  }

  bool ask_for_another(const AnotherRun& question) {
    RestGuard guard(bench_, true);
    guard.await_rest(stop_asked_);
    person_.while_waiting([&] { guard.check(); });
    progress_.asks({fmt::format("Run {:g}° again? {}", question.occlusion_deg, question.reason), question.occlusion_deg,
                    review_.repetitions(question.occlusion_deg) + 1, static_cast<int>(result_.runs) + 1});
    const Answered answered(progress_);
    const bool yes = person_.run_again(question);
    person_.while_waiting({});
    return yes;
  }

  void note_findings(const std::vector<BenchFinding>& findings) {
    for (const BenchFinding& found : findings) {
      if (found.finding.severity != Severity::note) progress_.say(found.line());
      note(found.device == Source::motor ? "motor_finding" : "load_cell_finding", found.finding);
    }
    if (!config_.iq.clock_gain && !config_.motor) note("clock_unchecked", {{"uid", bench_.motor().parameters().uid()}});
  }

  /// For as long as the handle lives; a refusal is reported once.
  [[nodiscard]] std::shared_ptr<void> keep(std::shared_ptr<void> (Bench::*how)(std::string& why_not),
                                           const char* event) {
    std::string why_not;
    auto kept = (bench_.*how)(why_not);
    if (!why_not.empty() && refused_.insert(event).second) {
      progress_.say(why_not);
      note(event, {{"reason", why_not}});
    }
    return kept;
  }

  /// Waits for the coil while a RestGuard watches the motor at rest.
  void cool_down() {
    const auto& limits = campaign_.limits;
    if (!limits.cooling) return;
    const RestGuard guard(bench_, true);
    const CoolingRule rule{limits.cooling->pause_above.value(), limits.cooling->resume_below.value()};
    const Instant begun = bench_.clock().now();
    for (bool pausing = false;; pausing = true) {
      const auto coil = bench_.motor().coil_temperature();
      if (!rule.pauses(pausing, coil ? coil->value() : std::nan(""))) {
        if (pausing) note("cooled_down", {{"seconds", to_seconds(bench_.clock().now() - begun)}});
        return;
      }
      if (!coil)
        throw DeviceError("IQ module", "read coil temperature", "the module reports none", "remove limits.cooling");
      if (!pausing) {
        progress_.say(
            fmt::format("coil at {:.0f} °C: pausing until below {:g} °C", coil->value(), rule.resume_below_degc));
        note("cooling", {{"coil_degc", coil->value()}, {"resume_below_degc", rule.resume_below_degc}});
      }
      const Instant next = bench_.clock().now() + kCoolingPoll;
      while (bench_.clock().now() < next) {
        if (stop_asked_()) throw Interrupted("stopped by request");
        guard.check();
        bench_.wait_until(std::min(next, bench_.clock().now() + bench_.clock().stretched(kCoolingTickWall)));
      }
    }
  }

  void mount(const profiles::PlannedRun& planned) {
    const double occlusion_deg = planned.occlusion_deg;
    if (!planned.mount && mounted_ && mounted_->occlusion_deg() == occlusion_deg) return;
    mounted_.reset();
    const MountConfirmation confirmed = let_mount(planned);
    bench_.mounted(campaign_.propeller.id, occlusion_deg);
    bench_.restore_power(stop_asked_);
    mounted_ = confirmed;
    note("mounted",
         {{"propeller", campaign_.propeller.id}, {"occlusion_deg", occlusion_deg}, {"confirmed_by", person_.name()}});
  }

  /// However the question ends.
  class Answered {
   public:
    explicit Answered(Progress& progress) : progress_(progress) {}
    Answered(const Answered&) = delete;
    Answered& operator=(const Answered&) = delete;
    ~Answered() { progress_.asks({}); }

   private:
    Progress& progress_;
  };

  MountConfirmation let_mount(const profiles::PlannedRun& planned) {
    const double occlusion_deg = planned.occlusion_deg;
    return ask_at_the_stand(bench_, person_, stop_asked_, [&](const StandAtRest& stand) {
      progress_.asks({occlusion_deg == 0 ? "Take the occlusion off, then type 0."
                                         : fmt::format("Mount {0:g}°, then type {0:g}.", occlusion_deg),
                      occlusion_deg, planned.repetition, static_cast<int>(result_.runs) + 1, stand.has_power(),
                      draw_plates(profiles::sketch_of(campaign_.propeller, config_.iq.spin), {occlusion_deg})});
      const Answered answered(progress_);
      const bool first = !std::exchange(has_asked_, true);
      return person_.confirm_mounting(campaign_.propeller, occlusion_deg,
                                      stand.condition() + (first ? about_keypad(bench_) : ""));
    });
  }

  /// The file is complete, named and on disk: the journal's line accepts it. The tables are made from the files.
  void accept(const RunResult& run, const profiles::PlannedRun& planned) {
    const results::RunRecording recording = results::read_run(run.file);
    const std::uint64_t lost = run.account.lost_network + run.account.lost_host;
    json accepted = {{"file", "runs/" + run.file.filename().string()},
                     {"sha256", run.digests.sha256},
                     {"contents_xxh128", run.digests.contents_xxh128},
                     {"samples", run.account.received},
                     {"lost", lost}};
    const auto driven =
        std::ranges::count_if(recording.phases, [](const auto& mark) { return mark.phase == results::Phase::step; });
    // Skipped at full drive, learned in earlier runs or in this one.
    if (const auto left_out = static_cast<std::ptrdiff_t>(planned.steps.size()) - driven - run.steps_not_needed;
        left_out > 0)
      accepted["steps_left_out"] = left_out;
    if (run.steps_not_needed > 0) accepted["steps_not_needed"] = run.steps_not_needed;
    if (run.stop) accepted["stop"] = to_json(*run.stop);
    for (const StreamEvent& event : recording.events) accepted["events"].push_back(event.text);
    accepted_at_ = bench_.clock().now();
    note(results::kRunAccepted, accepted);
    const auto [means, zero] = reduce_with_zeros(recording);
    review_.add(run.file.filename().string(), means);
    const results::FlaggedSteps flagged = count(run.file, recording, means);
    review_.write(folder_, bench_.files());
    for (const std::string& reason : zero.reasons()) progress_.say("load cell: " + reason);
    progress_.say(fmt::format("run {:2}/{}  {}  {}{} samples, {} lost, {}{}{}", result_.runs, planned_,
                              run.file.filename().string(), review_.k_words(planned.occlusion_deg, planned.repetition),
                              run.account.received, lost, results::in_words(flagged),
                              run.steps_not_needed > 0 ? fmt::format(", {} not needed", run.steps_not_needed) : "",
                              rest_words(run.stop)));
    if (!so_far_ || planned.is_reference()) return;
    if (const std::string words = so_far_(review_.steps()); !words.empty()) progress_.reached(words);
  }

  /// Returns the flags of its steps.
  results::FlaggedSteps count(const std::filesystem::path& file, const results::RunRecording& run,
                              const std::vector<results::StepMean>& means) {
    results::FlaggedSteps flagged;
    for (const auto& step : means) {
      flagged.add(step.quality_flags);
      result_.steps.add(step.quality_flags);
    }
    ++result_.runs;
    result_.samples += run.account.received;
    result_.lost += run.account.lost_network + run.account.lost_host;
    accepted_.insert(file.filename().string());
    return flagged;
  }

  void note(const std::string& event, const json& data) {
    const Instant now = bench_.clock().now();
    journal_.append(event, data, now.count(), utc_text(bench_.clock(), now));
  }

  /// After a failure, which matters more than an error while this line is written.
  void note_the_end(const std::string& event, const json& data) {
    try {
      note(event, data);
    } catch (const RecordError& error) {
      progress_.say(error.what());
    }
  }

  Bench& bench_;
  const profiles::Campaign& campaign_;
  const profiles::BenchConfig& config_;
  const results::CampaignFolder& folder_;
  Operator& person_;
  Progress& progress_;
  const std::function<bool()>& stop_asked_;
  const SoFar& so_far_;
  const profiles::Plan plan_;
  results::Journal journal_;
  CampaignReview review_;
  int planned_;                       ///< runs, with those that were added
  std::set<double> judged_;           ///< occlusions with all repetitions
  std::set<std::string> accepted_;    ///< names of files
  Instant accepted_at_{0};            ///< the last of them
  std::optional<double> last_run_s_;  ///< bench time of the last run, where steps end by themselves
  std::optional<double> promised_s_;  ///< bench time that was left after the last run
  std::optional<MountConfirmation> mounted_;
  bool has_asked_ = false;         ///< for a mounting
  std::set<std::string> refused_;  ///< what this computer did not grant; the operator was told
  CampaignResult result_;
};

}  // namespace

CampaignResult run_campaign(Bench& bench, const profiles::Campaign& campaign, const profiles::BenchConfig& config,
                            const results::CampaignFolder& folder, Operator& person, Progress& progress,
                            const std::function<bool()>& stop_asked, const Resumption* resumption,
                            const std::vector<BenchFinding>* audited, const SoFar& so_far) {
  return CampaignRun(bench, campaign, config, folder, person, progress, stop_asked, so_far).run(resumption, audited);
}

}  // namespace kphi::daq
