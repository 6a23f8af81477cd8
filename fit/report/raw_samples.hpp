// Raw samples of the top speed for the box plots: they show the scatter of the thrust within a step.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "fit/coefficients/coefficients.hpp"
#include "fit/report/figures.hpp"
#include "results/load_cell_columns.hpp"
#include "results/records.hpp"
#include "results/step_mean.hpp"

namespace kphi::fit {

/// Whether the step was measured in this run, by the name of its file.
[[nodiscard]] bool is_run_of(const RunProvenance& run, const results::StepMean& step);

/// At most `most` samples of the run, whose load-cell records are in `cell`, inside the step's window, evenly taken, in
/// N. Arrival stamps cut the window less sharply than the reduction did, so the samples are shifted to the step's own
/// mean.
[[nodiscard]] std::vector<double> thrust_samples(const results::RunRecording& run, const results::LoadCellColumns& cell,
                                                 const results::StepMean& step, std::size_t most);

/// How `run` came to `step`. nullopt if the run has no mark of it or no sample in its window.
[[nodiscard]] std::optional<Settling> settling_of(const results::RunRecording& run,
                                                  const results::LoadCellColumns& cell, const results::StepMean& step);

/// The whole run, its thrust as 800 means; its zero is that of `step`. nullopt as settling_of.
[[nodiscard]] std::optional<Settling> whole_run(const results::RunRecording& run, const results::LoadCellColumns& cell,
                                                const results::StepMean& step);

struct RawSamples {
  std::vector<ThrustShares> shares;  ///< empty when some run of the top speed is not in the folder
  std::vector<RunProvenance> runs;  ///< those given, with outcome, account and events filled in where the file is there
  std::optional<Settling> settling;  ///< of the top speed, from the first of the runs that have it, and
  std::optional<Settling> whole;     ///< that run from beginning to end
};

/// Reads each run once. `runs` name files below `folder`; at most 2000 samples per φ are kept.
[[nodiscard]] RawSamples read_raw_samples(const Identification& identification, std::vector<RunProvenance> runs,
                                          const std::filesystem::path& folder);

}  // namespace kphi::fit
