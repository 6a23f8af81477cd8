// coefficients.yaml: what the bench hands to the library that flies. Format kphi-coefficients/1.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "fit/bench_uncertainty.hpp"
#include "fit/identification.hpp"
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

/// Where the numbers come from. Nothing here is guessed: what is not known is empty and written as `unknown`.
/// The clock of the motor module, by which it tells the speed, against a host's.
struct MotorClock {
  double gain = 1;
  std::optional<double> u_gain;  ///< standard uncertainty; nothing: unchecked, the gain is taken as 1
};

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

/// A YAML double-quoted scalar: propeller "5e3" stays text, and no text can end the quotes.
[[nodiscard]] std::string quoted(const std::string& text);

/// What was minimised, in words; the same in file and report.
[[nodiscard]] std::string estimator_words(const Identification& identification);

/// A speed in RPM as files and reports print it: to a thousandth, which hides the rounding of π/30 and nothing else.
[[nodiscard]] double printed_rpm(double speed_rad_s);

/// The whole file. The same arguments give the same bytes.
[[nodiscard]] std::string format_coefficients(const Identification& identification, const Provenance& provenance);

}  // namespace kphi::fit
