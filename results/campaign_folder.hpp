// results/<UTC>_<campaign>/ and the names in it; the progress of its campaign by the journal, which alone says what was
// accepted; and whether the folder still matches that.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "results/file_layer.hpp"
#include "results/journal.hpp"
#include "results/load_cell_columns.hpp"
#include "results/records.hpp"

namespace kphi::results {

/// "5x3_phi090_rep2.h5", "5x3_phi022.5_rep1.h5"; a reference run, whose repetition is -1 or below:
/// "5x3_phi000_ref1.h5".
[[nodiscard]] std::string run_file_name(const std::string& propeller_id, double occlusion_deg, int repetition);

/// By its name alone.
[[nodiscard]] bool is_complete_run(const std::string& name);

class CampaignFolder {
 public:
  /// Creates `<parent>/<utc>_<name>` with runs/ and figures/; if the name is taken, `…-2`, `…-3`. `utc` as the caller
  /// writes it, such as 20210530T080000Z; of `name` and `utc`, characters outside [A-Za-z0-9._-] become '_'. Throws
  /// RecordError.
  [[nodiscard]] static CampaignFolder create(const std::filesystem::path& parent, const std::string& utc,
                                             const std::string& name, FileLayer& files = disk());
  /// An existing folder; its runs/ may be a link, to another disk. Throws RecordError if it has neither a journal nor
  /// runs, DataRejected for a link, a pipe or a device in the place of one of its files.
  [[nodiscard]] static CampaignFolder open(const std::filesystem::path& folder);

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  [[nodiscard]] std::filesystem::path campaign_file() const { return path_ / "campaign.yaml"; }
  [[nodiscard]] std::filesystem::path bench_file() const { return path_ / "bench.yaml"; }
  [[nodiscard]] std::filesystem::path faults_file() const { return path_ / "faults.yaml"; }
  [[nodiscard]] std::filesystem::path motor_file() const { return path_ / "motor.yaml"; }
  [[nodiscard]] std::filesystem::path journal() const { return path_ / "journal.jsonl"; }
  /// Lock of the program that writes into the folder.
  [[nodiscard]] std::filesystem::path lock() const { return path_ / ".lock"; }
  [[nodiscard]] std::filesystem::path runs() const { return path_ / "runs"; }
  [[nodiscard]] std::filesystem::path steps() const { return path_ / "steps.csv"; }
  /// Steps averaged over their repetitions.
  [[nodiscard]] std::filesystem::path means() const { return path_ / "means.csv"; }
  /// Steps of the reference runs, which check the bench.
  [[nodiscard]] std::filesystem::path references() const { return path_ / "references.csv"; }
  [[nodiscard]] std::filesystem::path coefficients() const { return path_ / "coefficients.yaml"; }
  [[nodiscard]] std::filesystem::path report() const { return path_ / "report.html"; }
  [[nodiscard]] std::filesystem::path figures() const { return path_ / "figures"; }
  [[nodiscard]] std::filesystem::path run(const std::string& propeller_id, double occlusion_deg, int repetition) const {
    return runs() / run_file_name(propeller_id, occlusion_deg, repetition);
  }

  /// Complete runs: by place of their occlusion in `occlusions_deg` (unlisted ones behind, ascending), then repetition.
  /// Uses the names only; opens no file. Throws DataRejected for a link, a pipe or a device.
  [[nodiscard]] std::vector<std::filesystem::path> complete_runs(std::span<const double> occlusions_deg = {}) const;
  /// Complete reference runs, in their order.
  [[nodiscard]] std::vector<std::filesystem::path> reference_runs() const;
  /// Aborted and interrupted ones, by name.
  [[nodiscard]] std::vector<std::filesystem::path> other_runs() const;

 private:
  explicit CampaignFolder(std::filesystem::path path) : path_(std::move(path)) {}
  std::filesystem::path path_;
};

struct AcceptedRun {
  std::string file;  ///< relative to the campaign's folder
  RunDigests digests;
  Nanoseconds time_ns = 0;   ///< bench time of its acceptance
  int steps_not_needed = 0;  ///< left out because k was certain enough without them
};

struct CampaignState {
  /// Tool, files and devices of the campaign: data of campaign_started, or of the last campaign_resumed. Null: not
  /// started.
  nlohmann::json identity;
  std::vector<AcceptedRun> accepted;  ///< in the order of their acceptance
  bool finished = false;              ///< campaign_finished is the last event
  std::string safety_stop;            ///< reason of the last safety stop; empty: none, or resumed since
};

[[nodiscard]] CampaignState state_of(const JournalReading& journal);

/// Compares the SHA-256 of every accepted run; one line for each that is missing or changed.
[[nodiscard]] std::vector<std::string> changed_runs(const CampaignFolder& folder, const CampaignState& state);

/// File name → digests of the accepted runs of the campaign in whose runs/ this file lies; empty: no journal there.
[[nodiscard]] std::map<std::string, RunDigests> digests_beside(const std::filesystem::path& run);
/// Throws DataRejected if the run is not as it was written: by the SHA-256 among these digests, or, if they do not name
/// it, by the checksums in the file itself.
void require_unchanged_run(const std::filesystem::path& run, const std::map<std::string, RunDigests>& digests);
/// read_run() of a run that is as it was written: by the digest of what is read, if the journal knows it, or as
/// require_unchanged_run().
[[nodiscard]] RunRecording read_unchanged_run(const std::filesystem::path& run,
                                              const std::map<std::string, RunDigests>& digests, LoadCellColumns& cell);

/// Renames the unaccepted files of a killed program in runs/, never over another file: `.h5.part` to
/// `.interrupted.h5.part`, a complete file that is not in the journal to `.unaccepted.h5`. Returns the new names,
/// relative to the folder. Throws RecordError.
std::vector<std::string> set_leftovers_aside(const CampaignFolder& folder, const CampaignState& state,
                                             FileLayer& files = disk());

/// The files beside the runs against the journal: tables, and the copies of the campaign's own files.
struct FilesBeside {
  std::vector<std::string> problems;  ///< missing or changed; one line each, with the file's name
  std::vector<std::string> remarks;   ///< tables that were not written again after the last run, by a program that died
};
[[nodiscard]] FilesBeside files_beside(const CampaignFolder& folder, const JournalReading& journal);

/// Throws DataRejected if the journal, an accepted run, a table or a copy is not as kphi left it; says on `remark` what
/// is undamaged, but not as it was left. A folder without a journal is let pass.
void require_intact(const CampaignFolder& folder, const std::function<void(const std::string&)>& remark = {});

struct CampaignVerification {
  std::size_t entries = 0;            ///< of the journal
  std::size_t runs = 0;               ///< complete runs looked at
  bool torn_last_line = false;        ///< of the journal; not a problem
  std::vector<std::string> problems;  ///< one line each, with the file's name
  std::vector<std::string> remarks;   ///< likewise: undamaged, but not as kphi left it
  [[nodiscard]] bool whole() const { return problems.empty(); }
};

/// Checks the journal's checksums, every run by itself and by its SHA-256 in the journal, runs missing in either, the
/// files beside them, and what was fitted by its SHA256SUMS.
[[nodiscard]] CampaignVerification verify_campaign(const CampaignFolder& folder);

}  // namespace kphi::results
