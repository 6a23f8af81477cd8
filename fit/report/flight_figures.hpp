// The figures of a fitted flight: what it excited, what the model leaves over, and k(φ) beside that of a bench.
#pragma once

#include <vector>

#include "compensation/file/coefficient_file.hpp"
#include "fit/flights/flight_fit.hpp"
#include "fit/flights/flown_bins.hpp"
#include "fit/report/gnuplot.hpp"
#include "fit/uncertainty/analysis.hpp"

namespace kphi::fit {

/// `bench` may be null.
[[nodiscard]] std::vector<Figure> flight_figures(const FlightFit& fit, const FlownBins& flown, const Fitted& fitted,
                                                 const compensation::Coefficients* bench);

}  // namespace kphi::fit
