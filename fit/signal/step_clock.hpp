// Load-cell samples of one step on bench time. Arrival stamps come in bursts, a datagram at a time; the box's own count
// spaces the samples, and the least delayed datagram places them.
#pragma once

#include <span>
#include <vector>

#include "results/records.hpp"

namespace kphi::fit {

struct TimedSample {
  double t_s = 0;  ///< bench time
  double value = 0;
};

/// A stretch of samples, `rate_hz` apart in the box's seconds; what is missing in between is held at its neighbour.
struct EvenSamples {
  double begin_s = 0;  ///< bench time of the first
  double rate_hz = 0;
  std::vector<double> values;
};

/// A step: from its command to the next.
struct StepSpan {
  int step = 0;
  double begin_s = 0, end_s = 0;
  double commanded_rad_s = 0;
  double previous_rad_s = 0;  ///< commanded before; 0 at the first
};
[[nodiscard]] std::vector<StepSpan> step_spans(const results::RunRecording& run);

/// Thrust axis, sign and scale applied, zero not; N. Empty when the box restarted within, or nothing lies there.
[[nodiscard]] EvenSamples thrust_between(const results::RunRecording& run, double begin_s, double end_s);

/// Speeds as reported, unsigned, rad/s.
[[nodiscard]] std::vector<TimedSample> speeds_between(const results::RunRecording& run, double begin_s, double end_s);

}  // namespace kphi::fit
