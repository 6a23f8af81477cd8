// Writes coefficients.yaml, the file that the bench hands to the library that flies, and fits the same steps again as a
// file says. README.md specifies the format; compensation/file reads it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "compensation/file/coefficient_file.hpp"
#include "fit/model/identification.hpp"
#include "fit/uncertainty/analysis.hpp"
#include "fit/uncertainty/budget.hpp"
#include "results/records.hpp"

namespace kphi::fit {

/// A run behind the coefficients.
struct RunProvenance {
  std::string file;    ///< as seen from the campaign folder
  std::string sha256;  ///< 64 hex digits
  std::string outcome;
  std::optional<SampleAccount> account;
  std::vector<std::string> events{};  ///< what happened to the stream, the cell or the motor; one line each
};

/// A run that was started and not accepted.
struct RejectedRun {
  std::string file;
  std::string utc;
  std::string reason;
};

/// The clock of the motor module, which times its speed, against this computer's.
struct MotorClock {
  double gain = 1;
  std::optional<double> u_gain;  ///< standard uncertainty; nullopt: unchecked, the gain is taken as 1
};

/// Where the numbers come from. An unknown entry is empty and written as `unknown`.
struct Provenance {
  Origin origin = Origin::unknown;
  std::string measured_utc;  ///< when the last run ended, ISO 8601, Z; empty: unknown
  std::string tool_version;
  std::string campaign;
  std::string propeller_name;
  std::string source;  ///< what was fitted: a campaign folder or a file
  std::vector<RunProvenance> runs;
  std::optional<double> supply_v;
  std::optional<MotorClock> clock;  ///< of a campaign
  std::vector<RejectedRun> rejected{};
  std::string cell_weighed{};  ///< one line: when, with what, and what it said of the load cell; empty: it was not
  std::optional<BenchUncertainty> bench{};                          ///< of the budget
  std::vector<compensation::Coefficients::ThrottleLaw> throttle{};  ///< of an imported log with a throttle
  std::string flight{};                  ///< one line on the flight that was fitted; empty: it was a bench
  std::string stand{}, operator_name{};  ///< of a campaign: names of bench file and person; empty: unknown
};

/// The estimator in words; the same in file and report.
[[nodiscard]] std::string estimator_words(const Identification& identification);

/// The whole file. The same arguments give the same bytes.
[[nodiscard]] std::string format_coefficients(const Fitted& fitted, const Provenance& provenance);

/// How a coefficients.yaml was fitted.
struct RecordedFit {
  IdentificationOptions options;
  std::optional<BenchUncertainty> bench;  ///< nullopt: the file does not say
  ReadinessLimits limits;
};

/// Throws compensation::CoefficientError for a file that cannot be read, ConfigurationError for an unknown word.
[[nodiscard]] RecordedFit read_recorded_fit(const std::string& path);

}  // namespace kphi::fit
