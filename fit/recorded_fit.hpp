// How a coefficients.yaml says that it was fitted, so that whoever draws its report, or sets it beside others, fits the
// same again.
#pragma once

#include <optional>
#include <string>

#include "fit/bench_uncertainty.hpp"
#include "fit/identification.hpp"

namespace kphi::fit {

struct RecordedFit {
  IdentificationOptions options;
  std::optional<BenchUncertainty> bench;  ///< nothing: an older file, which does not tell
  std::string propeller;
  double diameter_in = 0;
  int blades = 0;
  compensation::OverlapMeasure overlap = compensation::OverlapMeasure::rim_arc;
};

/// Flow style, what `provenance.fit` of a coefficients.yaml holds beside the model in words: which k, weights, loss,
/// speeds, and the standard uncertainties of the stand that the budget was made with.
[[nodiscard]] std::string format_fit_options(const Identification& identification,
                                             const std::optional<BenchUncertainty>& bench);

/// Throws compensation::CoefficientError for a file that is none, ConfigurationError for a word it does not know.
[[nodiscard]] RecordedFit read_recorded_fit(const std::string& path);

/// `steps` fitted as the record says.
[[nodiscard]] Identification identify_again(std::span<const results::StepMean> steps, const RecordedFit& record);

}  // namespace kphi::fit
