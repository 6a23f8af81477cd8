// Why one step of a run is not to be trusted without a look.
#pragma once

#include <cstdint>

#include "daq/cell_stream.hpp"
#include "daq/motor_series.hpp"
#include "daq/window.hpp"
#include "drivers/iq/quality.hpp"
#include "results/records.hpp"

namespace kphi::daq {

/// How far the mean speed may be from the command, rad/s.
[[nodiscard]] double speed_tolerance(double commanded_rad_s);

/// What the campaign in the run's header says that motor and supply may do.
[[nodiscard]] iq::QualityLimits quality_limits(const results::RunHeader& header);

/// One step, as far as its doubts go.
struct StepEvidence {
  double commanded_rad_s = 0;
  double planned_s = 0;  ///< that the discard leaves
  Window window;         ///< of the load cell
  Window motor_window;
  CellWindow cell;
  Statistics speed;
};

/// Bits of results::Doubt that load cell, motor and supply give within the window.
[[nodiscard]] std::uint32_t step_doubts(const results::RunHeader& header, const iq::QualityLimits& limits,
                                        const MotorSeries& motor, const StepEvidence& step);

}  // namespace kphi::daq
