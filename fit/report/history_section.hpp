// Campaigns of one propeller over time, on the page of a report.
#pragma once

#include <string>

#include "fit/propellers/history.hpp"
#include "fit/report/gnuplot.hpp"

namespace kphi::fit {

/// A control chart for the stand, K_T and the slope: every campaign ± 95 %, the mean, and the limits that hold 99.7 %.
[[nodiscard]] Figure history_figure(const History& history);

/// What was found, in sentences.
[[nodiscard]] std::string history_verdict(const History& history);
/// The campaigns as a table.
[[nodiscard]] std::string history_section(const History& history);

}  // namespace kphi::fit
