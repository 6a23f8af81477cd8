// How a coefficients.yaml was fitted: `kphi report` and `kphi compare` fit the same steps the same way again.
#pragma once

#include <optional>
#include <string>

#include "fit/model/identification.hpp"
#include "fit/uncertainty/bench_uncertainty.hpp"

namespace kphi::fit {

struct RecordedFit {
  IdentificationOptions options;
  std::optional<BenchUncertainty> bench;  ///< nullopt: the file does not say
  std::string propeller;
  double diameter_in = 0;
  int blades = 0;
  compensation::OverlapMeasure overlap = compensation::OverlapMeasure::rim_arc;
};

/// Throws compensation::CoefficientError for a file that cannot be read, ConfigurationError for an unknown word.
[[nodiscard]] RecordedFit read_recorded_fit(const std::string& path);

/// `steps` fitted as the record says.
[[nodiscard]] Identification identify_again(std::span<const results::StepMean> steps, const RecordedFit& record);

}  // namespace kphi::fit
