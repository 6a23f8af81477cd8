// Writes coefficients.yaml, what the bench hands to the library that flies. README.md specifies it; the reader is
// compensation/file/.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "fit/model/identification.hpp"
#include "fit/uncertainty/analysis.hpp"
#include "results/records.hpp"

namespace kphi::fit {

/// A run behind the coefficients.
struct RunProvenance {
  std::string file;    ///< as seen from the campaign folder
  std::string sha256;  ///< 64 hex digits
  std::string outcome;
  std::optional<results::SampleAccount> account;
  std::vector<std::string> events{};  ///< what happened to the stream, the cell or the motor; one line each
};

/// A run that was begun and not accepted.
struct RejectedRun {
  std::string file;
  std::string utc;
  std::string reason;
};

/// The clock of the motor module, by which it measures the speed, against this computer's.
struct MotorClock {
  double gain = 1;
  std::optional<double> u_gain;  ///< standard uncertainty; nullopt: unchecked, the gain is taken as 1
};

/// Where the numbers come from. Nothing here is guessed: what is not known is empty and written as `unknown`.
struct Provenance {
  std::string measured_utc;  ///< when the last run ended, ISO 8601, Z; empty: unknown
  std::string tool_version;
  std::string campaign;
  std::string propeller_name;
  std::string source;  ///< what was fitted: a campaign folder or a file
  std::vector<RunProvenance> runs;
  std::optional<double> supply_v;
  std::optional<MotorClock> clock;  ///< of a campaign
  std::vector<RejectedRun> rejected{};
  std::optional<BenchUncertainty> bench{};  ///< with which the budget was made
};

/// What was minimised, in words; the same in file and report.
[[nodiscard]] std::string estimator_words(const Identification& identification);

/// The whole file; without an analysis it lacks the keys `uncertainty` and `torque`. The same arguments give the same
/// bytes.
[[nodiscard]] std::string format_coefficients(const Identification& identification, const Provenance& provenance,
                                              const Analysis* analysis = nullptr);

}  // namespace kphi::fit
