// Results of a campaign, run by run: step means, the motor's speed cap, hysteresis, repetitions, drift of the bench.
#pragma once

#include <functional>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "daq/campaign/operator.hpp"
#include "daq/run/progress.hpp"
#include "daq/run/speed_cap.hpp"
#include "results/campaign_folder.hpp"
#include "results/reduction/repetitions.hpp"
#include "results/step_mean.hpp"

namespace kphi::daq {

/// The runner's thread. Findings are shown and recorded.
class CampaignReview {
 public:
  using Note = std::function<void(const char* event, const nlohmann::json& data)>;
  CampaignReview(const profiles::Campaign& campaign, Progress& progress, Note note)
      : campaign_(campaign), progress_(progress), note_(std::move(note)) {}

  /// The means of a run accepted before a resumption: counts, but is not reported again.
  void restore(const std::vector<results::StepMean>& means);
  /// The means of a run that was just accepted. `run`: its file's name.
  void add(const std::string& run, const std::vector<results::StepMean>& means);
  /// steps.csv, means.csv and, with reference runs, references.csv: the same whatever the order of the runs. Their
  /// SHA-256 goes into the journal.
  void write(const results::CampaignFolder& folder, results::FileLayer& files);
  /// Once all planned repetitions of the occlusion are there: the question to ask if they disagree and the campaign
  /// allows another run. Where repetitions is a range, a decision: another run while it would move k too far.
  [[nodiscard]] std::optional<AnotherRun> another(double occlusion_deg);
  /// Repetitions of the occlusion so far, reference runs not counted.
  [[nodiscard]] int repetitions(double occlusion_deg) const;
  /// "k 1.5632e-06, ", N/(rad/s)², of this run; empty if too few of its steps are good, and of a reference run.
  [[nodiscard]] std::string k_words(double occlusion_deg, int repetition) const;
  /// Of all runs so far but the reference runs.
  [[nodiscard]] const std::vector<results::StepMean>& steps() const { return steps_; }
  [[nodiscard]] const SpeedCap& cap() const { return cap_; }
  /// After the last run.
  void conclude();

 private:
  void sort();
  /// Of an occlusion run `made` times, where repetitions is a range.
  [[nodiscard]] std::optional<AnotherRun> while_it_moves_k(std::span<const results::RepetitionVerdict> verdicts,
                                                           double occlusion_deg, int made) const;
  const profiles::Campaign& campaign_;
  Progress& progress_;
  Note note_;
  SpeedCap cap_;
  std::vector<results::StepMean> steps_, references_;
  std::map<double, int> repetitions_;
};

}  // namespace kphi::daq
