// What a flight leaves for other programs: traces and draws as CSV, figures as gnuplot scripts with their data inside.
#pragma once

#include <string>
#include <vector>

#include "compensation/flight/study.hpp"

namespace kphi::flight {

/// One row per 10 ms, units in the column names.
[[nodiscard]] std::string trace_csv(const std::vector<TraceRow>& trace);

/// One row per draw: what was drawn, and how it flew.
[[nodiscard]] std::string draws_csv(const std::vector<Draw>& draws);

/// The position error of one flight over time, one axis below the other, as in the paper's figures.
[[nodiscard]] std::string error_figure(const Experiment& experiment, const std::vector<TraceRow>& trace);

/// One dot per draw: hover z and forward distance, compensated over not.
[[nodiscard]] std::string draws_figure(const std::vector<Draw>& draws);

}  // namespace kphi::flight
