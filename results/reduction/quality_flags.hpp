// Quality flags of a step, from its samples, its readings and the events of its run.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "results/records.hpp"
#include "results/reduction/cell_stream.hpp"
#include "results/reduction/motor_series.hpp"
#include "results/step_mean.hpp"

namespace kphi::results {

/// The voltage at the motor module may differ from the campaign's by this share of it.
inline constexpr double kSupplyBand = 0.1;
/// Share of the supply voltage at which the motor runs at full drive.
inline constexpr double kFullDrive = 0.98;

[[nodiscard]] constexpr std::uint32_t flag_if(QualityFlag flag, bool applies) {
  return applies ? static_cast<std::uint32_t>(flag) : 0u;
}

/// Permitted deviation of the mean speed from the command, rad/s.
[[nodiscard]] double speed_tolerance(double commanded_rad_s);

/// Data behind the flags of one step.
struct StepEvidence {
  double commanded_rad_s = 0;
  double planned_s = 0;  ///< after the minimum discard
  Window window;         ///< of the load cell
  Window motor_window;
  CellWindow cell;
  Statistics speed;
};

/// Bits of QualityFlag that load cell and motor module raise within the window. A quantity without
/// readings within the window raises no flag.
[[nodiscard]] std::uint32_t step_flags(const RunHeader& header, const MotorSeries& motor, const StepEvidence& step);

/// The readings in [begin, end), bench time. `readings` by time.
[[nodiscard]] std::span<const SupplyReading> within(std::span<const SupplyReading> readings, const Window& window);

/// Bits of QualityFlag that these readings of the bench supply raise; `settled`: at a settled speed.
[[nodiscard]] std::uint32_t supply_flags(std::span<const SupplyReading> readings, bool settled);

/// Steps that touch [begin, end], bench time, carry `flag`.
struct FlagSpan {
  Nanoseconds begin = 0;
  Nanoseconds end = 0;
  QualityFlag flag{};
};

/// One span per event that can spoil a measurement. A stall or a silence lasts until it ends, or to the end of the run;
/// a change of the configuration concerns the whole run. Restarts of the box and range events raise no flag here: the
/// samples themselves show them.
[[nodiscard]] std::vector<FlagSpan> flag_spans(std::span<const StreamEvent> events);

/// The flags of all spans that touch [begin, end).
[[nodiscard]] std::uint32_t flags_within(std::span<const FlagSpan> spans, Nanoseconds begin, Nanoseconds end);

}  // namespace kphi::results
