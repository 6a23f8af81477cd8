#include "daq/campaign_run.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <optional>

#include "daq/load_cell_audit.hpp"
#include "daq/reduction.hpp"
#include "daq/repetitions.hpp"
#include "daq/run.hpp"
#include "daq/zero_limits.hpp"
#include "profiles/plan.hpp"
#include "profiles/strict_yaml.hpp"
#include "results/journal.hpp"
#include "results/run_reader.hpp"
#include "results/sha256.hpp"
#include "results/steps_csv.hpp"
#include "results/version.hpp"

namespace kphi::daq {
namespace {

using nlohmann::json;

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
        journal_(folder.journal(), bench.files()) {}

  CampaignResult run() {
    results::write_text(folder_.campaign_file(), campaign_.text, bench_.files());
    results::write_text(folder_.bench_file(), place_.text, bench_.files());
    json started{{"tool_version", kVersion},
                 {"campaign_sha256", results::sha256(campaign_.text)},
                 {"bench_sha256", results::sha256(place_.text)},
                 {"motor", bench_.motor().identity()}};
    if (place_.simulation && !place_.simulation->faults.empty()) {
      const std::string faults = profiles::read_text(place_.simulation->faults);
      results::write_text(folder_.faults_file(), faults, bench_.files());
      started["faults_sha256"] = results::sha256(faults);
    }
    note("campaign_started", started);
    try {
      audit();
      for (const profiles::PlannedRun& planned : plan_.runs) one(planned);
    } catch (const std::exception& e) {
      note("campaign_stopped", {{"reason", e.what()}});
      progress_.say(fmt::format("{} of {} runs are finished and kept in {}", result_.runs, plan_.runs.size(),
                                folder_.path().string()));
      throw;
    }
    note("campaign_finished", {{"runs", result_.runs}});
    return result_;
  }

 private:
  void one(const profiles::PlannedRun& planned) {
    if (planned.occlusion_deg != mounted_deg_) mount(planned.occlusion_deg);
    const auto file = folder_.run(campaign_.propeller.id, planned.occlusion_deg, planned.repetition);
    const double per_run_s = plan_.bench.value() / static_cast<double>(plan_.runs.size());
    const double remaining_s =
        per_run_s * static_cast<double>(plan_.runs.size() - static_cast<std::size_t>(result_.runs));
    try {
      const RunOrder order{campaign_, place_, planned.occlusion_deg, planned.repetition, remaining_s, file};
      accept(record_run(bench_, order, progress_, stop_asked_));
    } catch (const std::exception& e) {
      note(results::kRunAborted, {{"run", file.filename().string()}, {"reason", e.what()}});
      throw;
    }
  }

  void audit() {
    for (const netbox::Finding& finding : audit_load_cell(bench_.load_cell(), campaign_, place_)) {
      const bool is_note = finding.severity == netbox::Severity::note;
      if (!is_note) progress_.say(describe(finding));
      note("load_cell_finding",
           {{"severity", is_note ? "note" : "warning"}, {"what", finding.what}, {"next_move", finding.next_move}});
    }
  }

  void mount(double occlusion_deg) {
    person_.mount(campaign_.propeller, occlusion_deg);
    bench_.mounted(campaign_.propeller.id, occlusion_deg);
    mounted_deg_ = occlusion_deg;
    note("mounted", {{"propeller", campaign_.propeller.id}, {"occlusion_deg", occlusion_deg}});
  }

  void accept(const RunResult& run) {
    const results::RunRecording recording = results::read_run(run.file);
    const auto [means, zero] = reduce_with_zeros(recording);
    steps_.insert(steps_.end(), means.begin(), means.end());
    results::write_steps(folder_.steps(), steps_, bench_.files());
    results::write_steps(folder_.means(), average_repetitions(steps_), bench_.files());
    const std::uint64_t lost = run.account.lost_network + run.account.lost_host;
    json accepted = {{"file", "runs/" + run.file.filename().string()},
                     {"sha256", run.sha256},
                     {"samples", run.account.received},
                     {"lost", lost}};
    for (const results::StreamEvent& event : recording.events) accepted["events"].push_back(event.text);
    note(results::kRunAccepted, accepted);
    tell(zero);
    int doubtful = 0;
    for (const auto& step : means) doubtful += step.doubts != 0;
    ++result_.runs;
    result_.samples += run.account.received;
    result_.lost += lost;
    result_.steps += static_cast<int>(means.size());
    result_.doubtful_steps += doubtful;
    progress_.say(fmt::format("run {:2}/{}  {}  {} samples, {} lost, {} of {} steps in doubt", result_.runs,
                              plan_.runs.size(), run.file.filename().string(), run.account.received, lost, doubtful,
                              means.size()));
  }

  void tell(const ZeroCheck& zero) {
    if (zero.only_one) {
      progress_.say("load cell: only one of the two zeros of this run could be taken: all its steps are in doubt");
    } else if (zero.drifted()) {
      progress_.say(fmt::format(
          "load cell: its zero moved by {:.3g} N during this run, {:.2g} N are tolerated: all its steps are "
          "in doubt; let the cell warm up, keep draughts off it, see that nothing touches it",
          zero.moved_n, zero.tolerated_n));
    }
    if (zero.noisy()) {
      progress_.say(
          fmt::format("load cell: at a zero of this run the samples scatter by {:.3g} N, {:g} N are tolerated: "
                      "all its steps are in doubt; {}",
                      zero.deviation_n, kNoisyZero, kZeroNextMove));
    }
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
  std::vector<results::StepMean> steps_;
  std::optional<double> mounted_deg_;
  CampaignResult result_;
};

}  // namespace

CampaignResult run_campaign(Bench& bench, const profiles::Campaign& campaign, const profiles::Bench& place,
                            const results::CampaignFolder& folder, Operator& person, Progress& progress,
                            const std::function<bool()>& stop_asked) {
  return CampaignRun(bench, campaign, place, folder, person, progress, stop_asked).run();
}

}  // namespace kphi::daq
