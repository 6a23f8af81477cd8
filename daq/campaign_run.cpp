#include "daq/campaign_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "daq/bench_audit.hpp"
#include "daq/campaign_review.hpp"
#include "daq/interrupt.hpp"
#include "daq/reduction.hpp"
#include "daq/run.hpp"
#include "drivers/device_error.hpp"
#include "drivers/iq/quality.hpp"
#include "profiles/plan.hpp"
#include "profiles/strict_yaml.hpp"
#include "results/journal.hpp"
#include "results/run_reader.hpp"
#include "results/sha256.hpp"
#include "results/version.hpp"

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
  ~CampaignRun() { person_.dictate_to({}); }
  CampaignRun(const CampaignRun&) = delete;
  CampaignRun& operator=(const CampaignRun&) = delete;

  CampaignResult run() {
    results::write_text(folder_.campaign_file(), campaign_.text, bench_.files());
    results::write_text(folder_.bench_file(), place_.text, bench_.files());
    json started{{"tool_version", kVersion},
                 {"campaign_sha256", results::sha256(campaign_.text)},
                 {"bench_sha256", results::sha256(place_.text)},
                 {"motor", bench_.motor().identity()}};
    if (place_.simulation) {
      keep(place_.simulation->faults, folder_.faults_file(), "faults_sha256", started);
      keep(place_.simulation->motor, folder_.motor_file(), "motor_sha256", started);
    }
    note("campaign_started", started);
    try {
      audit();
      for (const profiles::PlannedRun& planned : plan_.runs) {
        one(planned);
        if (!planned.is_reference()) repeat(planned.occlusion_deg);
      }
      review_.conclude();
    } catch (const std::exception& e) {
      note("campaign_stopped", {{"reason", e.what()}});
      progress_.say(
          fmt::format("{} of {} runs are finished and kept in {}", result_.runs, planned_, folder_.path().string()));
      throw;
    }
    note("campaign_finished", {{"runs", result_.runs}});
    return result_;
  }

 private:
  /// A file that the bench file names, if it names one, beside the copy of the bench file.
  void keep(const std::string& file, const std::filesystem::path& copy, const char* hash, json& noted) {
    if (file.empty()) return;
    const std::string text = profiles::read_text(file);
    results::write_text(copy, text, bench_.files());
    noted[hash] = results::sha256(text);
  }

  void one(const profiles::PlannedRun& planned) {
    mount(planned);
    const auto file = folder_.run(campaign_.propeller.id, planned.occlusion_deg, planned.repetition);
    const double per_run_s = plan_.bench.value() / static_cast<double>(plan_.runs.size());
    const double remaining_s = per_run_s * (planned_ - result_.runs);
    profiles::PlannedRun capped = planned;
    const int left_out = review_.cap().apply(capped.steps);
    try {
      cool_down();
      if (place_.ambient.known() && !bench_.air())
        progress_.say("air: its sensor measures no more: the density of this run is unknown");
      const RunOrder order{campaign_, place_, *mounted_, capped, remaining_s, file};
      accept(record_run(bench_, order, progress_, stop_asked_), left_out);
    } catch (const std::exception& e) {
      note(results::kRunAborted, {{"run", file.filename().string()}, {"reason", e.what()}});
      throw;
    }
  }

  /// While its repetitions disagree, and somebody agrees to another.
  void repeat(double occlusion_deg) {
    while (const auto question = review_.another(occlusion_deg)) {
      const bool yes = person_.run_again(*question);
      note("another_run", {{"occlusion_deg", occlusion_deg},
                           {"reason", question->reason},
                           {"decided", yes},
                           {"decided_by", person_.name()}});
      if (!yes) return;
      ++planned_;
      one(profiles::extra_run(campaign_, occlusion_deg, review_.repetitions(occlusion_deg) + 1));
    }
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

  /// The motor stands meanwhile.
  void cool_down() {
    const auto& limits = campaign_.limits;
    if (!limits.cooling) return;
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
        bench_.wait_until(std::min(next, bench_.clock().now() + bench_.clock().stretched(kCoolingTickWall)));
      }
    }
  }

  void mount(const profiles::PlannedRun& planned) {
    const double occlusion_deg = planned.occlusion_deg;
    if (!planned.mount && mounted_ && mounted_->occlusion_deg() == occlusion_deg) return;
    mounted_.reset();
    const Mounted confirmed = person_.confirm_mounting(campaign_.propeller, occlusion_deg);
    bench_.mounted(campaign_.propeller.id, occlusion_deg);
    mounted_ = confirmed;
    note("mounted",
         {{"propeller", campaign_.propeller.id}, {"occlusion_deg", occlusion_deg}, {"confirmed_by", person_.name()}});
  }

  void accept(const RunResult& run, int left_out) {
    const results::RunRecording recording = results::read_run(run.file);
    const auto [means, zero] = reduce_with_zeros(recording);
    const std::uint64_t lost = run.account.lost_network + run.account.lost_host;
    json accepted = {{"file", "runs/" + run.file.filename().string()},
                     {"sha256", run.sha256},
                     {"samples", run.account.received},
                     {"lost", lost}};
    if (left_out > 0) accepted["steps_left_out"] = left_out;
    if (run.stop) accepted["stop"] = to_json(*run.stop);
    for (const results::StreamEvent& event : recording.events) accepted["events"].push_back(event.text);
    note(results::kRunAccepted, accepted);
    review_.add(run.file.filename().string(), means);
    review_.write(folder_, bench_.files());
    for (const std::string& reason : zero.reasons()) progress_.say("load cell: " + reason);
    int doubtful = 0;
    for (const auto& step : means) doubtful += step.doubts != 0;
    ++result_.runs;
    result_.samples += run.account.received;
    result_.lost += lost;
    result_.steps += static_cast<int>(means.size());
    result_.doubtful_steps += doubtful;
    progress_.say(fmt::format("run {:2}/{}  {}  {} samples, {} lost, {} of {} steps in doubt{}", result_.runs, planned_,
                              run.file.filename().string(), run.account.received, lost, doubtful, means.size(),
                              standing_words(run.stop)));
  }

  void note(const std::string& event, const json& data) {
    const Instant now = bench_.clock().now();
    journal_.append(event, data, now.count(), utc_text(bench_.clock(), now));
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
  int planned_;  ///< runs, with those that were added
  std::optional<Mounted> mounted_;
  CampaignResult result_;
};

}  // namespace

CampaignResult run_campaign(Bench& bench, const profiles::Campaign& campaign, const profiles::Bench& place,
                            const results::CampaignFolder& folder, Operator& person, Progress& progress,
                            const std::function<bool()>& stop_asked) {
  return CampaignRun(bench, campaign, place, folder, person, progress, stop_asked).run();
}

}  // namespace kphi::daq
