#include "daq/campaign_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "daq/awake.hpp"
#include "daq/bench_audit.hpp"
#include "daq/campaign_review.hpp"
#include "daq/interrupt.hpp"
#include "daq/reduction.hpp"
#include "daq/rest_guard.hpp"
#include "daq/run.hpp"
#include "drivers/device_error.hpp"
#include "drivers/iq/quality.hpp"
#include "profiles/plan.hpp"
#include "profiles/strict_yaml.hpp"
#include "results/journal.hpp"
#include "results/record_error.hpp"
#include "results/run_reader.hpp"

namespace kphi::daq {
namespace {

using nlohmann::json;

constexpr Duration kCoolingLook = std::chrono::seconds(1);
constexpr Duration kCoolingTickWall = std::chrono::milliseconds(100);

json to_json(const iq::StopReport& stop) {
  const auto seconds = [](const std::optional<Duration>& time) { return time ? json(to_seconds(*time)) : json(); };
  return {{"confirmed", stop.safe()},
          {"time_to_coast_s", seconds(stop.time_to_coast)},
          {"time_to_standing_s", seconds(stop.time_to_standing)},
          {"words", stop.summary()}};
}

std::string standing_words(const std::optional<iq::StopReport>& stop) {
  if (!stop) return "";
  if (!stop->time_to_standing) return ", " + stop->summary();
  return fmt::format(", stood after {:.1f} s", to_seconds(*stop->time_to_standing));
}

bool is_safety_stop(const std::exception_ptr& cause) {
  try {
    std::rethrow_exception(cause);
  } catch (const SafetyStop&) {
    return true;
  } catch (...) {
    return false;
  }
}

class CampaignRun {
 public:
  CampaignRun(Bench& bench, const profiles::Campaign& campaign, const profiles::Bench& place,
              const results::CampaignFolder& folder, Operator& person, Progress& progress,
              const std::function<bool()>& stop_asked)
      : bench_(bench),
        campaign_(campaign),
        place_(place),
        folder_(folder),
        person_(person),
        progress_(progress),
        stop_asked_(stop_asked),
        plan_(profiles::make_plan(campaign, place)),
        journal_(folder.journal(), bench.files()),
        review_(campaign, progress, [this](const char* event, const json& data) { note(event, data); }),
        planned_(static_cast<int>(plan_.runs.size())) {
    person.dictate_to([this](const char* event, const std::string& words) { note(event, {{"words", words}}); });
  }
  ~CampaignRun() {
    person_.dictate_to({});
    person_.let_watch({});
  }
  CampaignRun(const CampaignRun&) = delete;
  CampaignRun& operator=(const CampaignRun&) = delete;

  CampaignResult run(const Resumption* resumption) {
    json identity = identity_of(campaign_, place_);
    add_devices(identity, bench_);
    if (resumption == nullptr || resumption->state.identity.is_null()) {
      keep_files();
      note(results::kCampaignStarted, identity);
    } else {
      resume(*resumption, std::move(identity));
    }
    try {
      require_awake(bench_.clock());
      audit();
      for (const profiles::PlannedRun& planned : plan_.runs) {
        if (!is_accepted(planned)) one(planned);
        if (!planned.is_reference()) repeat(planned.occlusion_deg);
      }
      review_.conclude();
    } catch (...) {
      end_early(std::current_exception());
    }
    note(results::kCampaignFinished, {{"runs", result_.runs}});
    return result_;
  }

 private:
  /// Writes down why, and throws it again with what the person needs to continue.
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
        fmt::format("{} of {} runs are finished, in {}", result_.runs, planned_, folder_.path().string());
    const std::string how = fmt::format("continue with: kphi run {} --bench {} --resume {}", campaign_.path,
                                        place_.path, folder_.path().string());
    words.data = (words.data.empty() ? runs : fmt::format("{}; this run up to here in {}", runs, words.data)) +
                 "\n         " + how;
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

  /// Beside each other: the files of the campaign, and those that the bench file names.
  void keep_files() {
    keep_copy(folder_.campaign_file(), campaign_.text, bench_.files());
    keep_copy(folder_.bench_file(), place_.text, bench_.files());
    if (!place_.simulation) return;
    const auto keep = [&](const std::string& file, const std::filesystem::path& copy) {
      if (!file.empty()) keep_copy(copy, profiles::read_text(file), bench_.files());
    };
    keep(place_.simulation->faults, folder_.faults_file());
    keep(place_.simulation->motor, folder_.motor_file());
  }

  void resume(const Resumption& resumption, json identity) {
    const std::vector<std::string> changes = require_unchanged(folder_, resumption, identity);
    if (!changes.empty()) keep_files();
    const std::vector<std::string> aside = results::set_leftovers_aside(folder_, resumption.state, bench_.files());
    if (!resumption.state.safety_stop.empty()) {
      if (resumption.cleared_by.empty())
        throw ConfigurationError("a safety stop ended this campaign and nobody has cleared it: " +
                                 resumption.state.safety_stop);
      identity["cleared_safety_stop"] = {{"reason", resumption.state.safety_stop}, {"by", resumption.cleared_by}};
    }
    identity["accepted_runs"] = resumption.state.accepted.size();
    if (!changes.empty()) identity["accepted_changes"] = changes;
    if (!aside.empty()) identity["set_aside"] = aside;
    note(results::kCampaignResumed, identity);
    for (const std::string& change : changes) progress_.say("going on although " + change);
    for (const std::string& file : aside) progress_.say("left behind unfinished, kept as " + file);
    for (const results::AcceptedRun& run : resumption.state.accepted) {
      const auto file = folder_.path() / run.file;
      const results::RunRecording recording = results::read_run(file);
      const std::vector<results::StepMean> means = reduce(recording);
      review_.restore(means);
      count(file, recording, means);
      accepted_at_ = Instant(run.time_ns);
    }
    if (result_.runs > 0) review_.write(folder_, bench_.files());
    const auto open = std::count_if(plan_.runs.begin(), plan_.runs.end(),
                                    [this](const profiles::PlannedRun& planned) { return !is_accepted(planned); });
    planned_ = result_.runs + static_cast<int>(open);
    progress_.say(fmt::format("resumed: {} of {} runs are accepted", result_.runs, planned_));
  }

  [[nodiscard]] std::filesystem::path file_of(const profiles::PlannedRun& planned) const {
    return folder_.run(campaign_.propeller.id, planned.occlusion_deg, planned.repetition);
  }

  [[nodiscard]] bool is_accepted(const profiles::PlannedRun& planned) const {
    return accepted_.contains(file_of(planned).filename().string());
  }

  void one(const profiles::PlannedRun& planned) {
    mount(planned);
    bench_.begin_run({planned.occlusion_deg, planned.repetition, accepted_at_});
    const auto file = file_of(planned);
    const double per_run_s = plan_.bench.value() / static_cast<double>(plan_.runs.size());
    const double remaining_s = per_run_s * (planned_ - result_.runs);
    profiles::PlannedRun capped = planned;
    (void)review_.cap().apply(capped.steps);
    try {
      cool_down();
      if (place_.ambient.known() && !bench_.air())
        progress_.say("air: its sensor measures no more: the density of this run is unknown");
      const auto awake = keep_awake();
      const RunOrder order{campaign_, place_, *mounted_, capped, remaining_s, file};
      accept(record_run(bench_, order, progress_, stop_asked_), planned);
    } catch (...) {
      const auto cause = std::current_exception();
      note_the_end(results::kRunAborted, {{"run", file.filename().string()},
                                          {"reason", words_of(cause).line()},
                                          {"safety_stop", is_safety_stop(cause)}});
      throw;
    }
  }

  /// While its repetitions disagree, and somebody agrees to another: once they are all there.
  void repeat(double occlusion_deg) {
    if (review_.repetitions(occlusion_deg) < campaign_.repetitions || !judged_.insert(occlusion_deg).second) return;
    while (const auto question = review_.another(occlusion_deg)) {
      const bool yes = ask_for_another(*question);
      note("another_run", {{"occlusion_deg", occlusion_deg},
                           {"reason", question->reason},
                           {"decided", yes},
                           {"decided_by", person_.name()}});
      if (!yes) return;
      ++planned_;
      one(profiles::extra_run(campaign_, occlusion_deg, review_.repetitions(occlusion_deg) + 1));
    }
  }

  bool ask_for_another(const AnotherRun& question) {
    const RestGuard guard(bench_, true);
    person_.let_watch([&] { guard.check(); });
    const bool yes = person_.run_again(question);
    person_.let_watch({});
    return yes;
  }

  void audit() {
    for (const BenchFinding& found : audit_bench(bench_, campaign_, place_)) {
      const Finding& finding = found.finding;
      if (finding.severity != Severity::note) progress_.say(found.line());
      note(found.device == "motor" ? "motor_finding" : "load_cell_finding",
           {{"severity", name_of(finding.severity)}, {"what", finding.what}, {"next_move", finding.next_move}});
    }
    if (!place_.iq.clock_gain) note("clock_unchecked", {{"uid", bench_.motor().parameters().uid()}});
  }

  /// For as long as the handle lives; that it cannot be done is said once.
  [[nodiscard]] std::shared_ptr<void> keep_awake() {
    std::string why_not;
    auto awake = bench_.keep_awake(why_not);
    if (!why_not.empty() && !std::exchange(may_sleep_, true)) {
      progress_.say(why_not);
      note("may_sleep", {{"reason", why_not}});
    }
    return awake;
  }

  /// The motor is at rest meanwhile, and watched.
  void cool_down() {
    const auto& limits = campaign_.limits;
    if (!limits.cooling) return;
    const RestGuard guard(bench_, true);
    const iq::CoolingRule rule{limits.cooling->pause_above.value(), limits.cooling->resume_below.value()};
    const Instant begun = bench_.clock().now();
    for (bool pausing = false;; pausing = true) {
      const auto coil = bench_.motor().coil_temperature();
      if (!rule.pauses(pausing, coil ? coil->value() : std::nan(""))) {
        if (pausing) note("cooled_down", {{"seconds", to_seconds(bench_.clock().now() - begun)}});
        return;
      }
      if (!coil) throw DeviceError("IQ module", "ask its coil temperature", "it tells none; remove limits.cooling");
      if (!pausing) {
        progress_.say(
            fmt::format("the coil has {:.0f} °C: waiting for {:g} °C", coil->value(), rule.resume_below_degc));
        note("cooling", {{"coil_degc", coil->value()}, {"resume_below_degc", rule.resume_below_degc}});
      }
      const Instant next = bench_.clock().now() + kCoolingLook;
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
    const Mounted confirmed = let_mount(occlusion_deg);
    bench_.mounted(campaign_.propeller.id, occlusion_deg);
    bench_.repower();
    mounted_ = confirmed;
    note("mounted",
         {{"propeller", campaign_.propeller.id}, {"occlusion_deg", occlusion_deg}, {"confirmed_by", person_.name()}});
  }

  /// Nobody is asked to come near before the rotor was seen at rest; without power if the supply is ours. Watched to
  /// the end.
  Mounted let_mount(double occlusion_deg) {
    std::optional<RestGuard> guard(std::in_place, bench_, true);
    guard->await_rest(stop_asked_);
    const bool has_power = !bench_.unpower();
    if (!has_power) guard.emplace(bench_, false);
    person_.let_watch([&] { guard->check(); });
    const Mounted confirmed = person_.confirm_mounting(
        campaign_.propeller, occlusion_deg,
        has_power ? "The rotor is at rest and its module coasts, but the motor HAS POWER: cut it at the switch first."
                  : "The rotor is at rest and the supply's output is off.");
    person_.let_watch({});
    guard->check();
    if (stop_asked_()) throw Interrupted("stopped by request");
    return confirmed;
  }

  /// The file is whole, named and on disk: the journal's line accepts it. The tables follow from the files.
  void accept(const RunResult& run, const profiles::PlannedRun& planned) {
    const results::RunRecording recording = results::read_run(run.file);
    const std::uint64_t lost = run.account.lost_network + run.account.lost_host;
    json accepted = {{"file", "runs/" + run.file.filename().string()},
                     {"sha256", run.sha256},
                     {"samples", run.account.received},
                     {"lost", lost}};
    const auto driven = std::count_if(recording.phases.begin(), recording.phases.end(),
                                      [](const auto& mark) { return mark.phase == results::Phase::step; });
    // For want of drive: in earlier runs, or in this one.
    if (const auto left_out = static_cast<std::ptrdiff_t>(planned.steps.size()) - driven; left_out > 0)
      accepted["steps_left_out"] = left_out;
    if (run.stop) accepted["stop"] = to_json(*run.stop);
    for (const results::StreamEvent& event : recording.events) accepted["events"].push_back(event.text);
    accepted_at_ = bench_.clock().now();
    note(results::kRunAccepted, accepted);
    const auto [means, zero] = reduce_with_zeros(recording);
    review_.add(run.file.filename().string(), means);
    const int doubtful = count(run.file, recording, means);
    review_.write(folder_, bench_.files());
    for (const std::string& reason : zero.reasons()) progress_.say("load cell: " + reason);
    progress_.say(fmt::format("run {:2}/{}  {}  {} samples, {} lost, {} of {} steps in doubt{}", result_.runs, planned_,
                              run.file.filename().string(), run.account.received, lost, doubtful, means.size(),
                              standing_words(run.stop)));
  }

  /// Returns how many of its steps are in doubt.
  int count(const std::filesystem::path& file, const results::RunRecording& run,
            const std::vector<results::StepMean>& means) {
    int doubtful = 0;
    for (const auto& step : means) doubtful += step.doubts != 0;
    ++result_.runs;
    result_.samples += run.account.received;
    result_.lost += run.account.lost_network + run.account.lost_host;
    result_.steps += static_cast<int>(means.size());
    result_.doubtful_steps += doubtful;
    accepted_.insert(file.filename().string());
    return doubtful;
  }

  void note(const std::string& event, const json& data) {
    const Instant now = bench_.clock().now();
    journal_.append(event, data, now.count(), utc_text(bench_.clock(), now));
  }

  /// After a failure, which matters more than that the disk takes this line no more.
  void note_the_end(const std::string& event, const json& data) {
    try {
      note(event, data);
    } catch (const results::RecordError& error) {
      progress_.say(error.what());
    }
  }

  Bench& bench_;
  const profiles::Campaign& campaign_;
  const profiles::Bench& place_;
  const results::CampaignFolder& folder_;
  Operator& person_;
  Progress& progress_;
  const std::function<bool()>& stop_asked_;
  const profiles::Plan plan_;
  results::Journal journal_;
  CampaignReview review_;
  int planned_;                     ///< runs, with those that were added
  std::set<double> judged_;         ///< occlusions whose repetitions are all there
  std::set<std::string> accepted_;  ///< names of files
  Instant accepted_at_{0};          ///< the last of them
  std::optional<Mounted> mounted_;
  bool may_sleep_ = false;  ///< nothing keeps this computer awake
  CampaignResult result_;
};

}  // namespace

CampaignResult run_campaign(Bench& bench, const profiles::Campaign& campaign, const profiles::Bench& place,
                            const results::CampaignFolder& folder, Operator& person, Progress& progress,
                            const std::function<bool()>& stop_asked, const Resumption* resumption) {
  return CampaignRun(bench, campaign, place, folder, person, progress, stop_asked).run(resumption);
}

}  // namespace kphi::daq
