// `kphi fit` of a flight log: K_T and k(φ)/K_T from what a vehicle did in the air.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/error.hpp"
#include "fit/model/curve_fit.hpp"
#include "fit/uncertainty/readiness.hpp"

namespace kphi::commands {

struct FlightFitRequest {
  std::string path, vehicle, layout, shape, out, propeller, bench;
  int blades = 0;
  fit::CurveForm form = fit::CurveForm::line;
  std::optional<double> mass_kg;
  std::vector<std::string> uncertainties;  ///< as fit::set_flight_uncertainty
  fit::ReadinessLimits limits;
  bool no_report = false, accept = false, json = false;
};

/// By its first bytes; with a `layout` any file is one.
[[nodiscard]] bool is_flight_log(const std::string& path, const std::string& layout);

[[nodiscard]] ExitCode fit_flight_log(const FlightFitRequest& request);

}  // namespace kphi::commands
