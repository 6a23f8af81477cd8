#include "fit/signal/step_clock.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace kphi::fit {
namespace {

double seconds(results::Nanoseconds t) { return 1e-9 * static_cast<double>(t); }

/// Datagrams wait for their last record, so that arrival is later than the first sample in them.
constexpr double kBurst = 0.2;

}  // namespace

std::vector<StepSpan> step_spans(const results::RunRecording& run) {
  std::vector<StepSpan> spans;
  double previous = 0;
  for (std::size_t i = 0; i + 1 < run.phases.size(); ++i) {
    const results::PhaseMark& mark = run.phases[i];
    if (mark.phase == results::Phase::ramp) previous = mark.speed_rad_s;  // it is there when the step begins
    if (mark.phase != results::Phase::step) continue;
    spans.push_back({mark.step, seconds(mark.time_ns), seconds(run.phases[i + 1].time_ns), mark.speed_rad_s, previous});
    previous = mark.speed_rad_s;
  }
  return spans;
}

EvenSamples thrust_between(const results::RunRecording& run, double begin_s, double end_s) {
  EvenSamples result;
  const results::LoadCellScale& scale = run.header.load_cell;
  const auto by_arrival = [](const results::LoadCellRecord& record, double t) {
    return seconds(record.arrival_ns) < t;
  };
  const auto first = std::lower_bound(run.load_cell.begin(), run.load_cell.end(), begin_s - kBurst, by_arrival);
  const auto last = std::lower_bound(first, run.load_cell.end(), end_s + kBurst, by_arrival);
  if (last - first < 2) return result;
  double offset = std::numeric_limits<double>::infinity();
  for (auto record = first; record != last; ++record) {
    if (record != first && record->ft_sequence <= std::prev(record)->ft_sequence) return result;
    const double device = static_cast<double>(record->ft_sequence - first->ft_sequence) / scale.device_rate_hz;
    offset = std::min(offset, seconds(record->arrival_ns) - device);
  }
  const auto axis = static_cast<std::size_t>(std::clamp(run.header.thrust_axis, 0, 2));
  const double newtons = run.header.thrust_sign / scale.counts_per_newton;
  result.rate_hz = scale.device_rate_hz / scale.ft_stride;
  std::uint32_t next = 0;
  for (auto record = first; record != last; ++record) {
    const double t = offset + static_cast<double>(record->ft_sequence - first->ft_sequence) / scale.device_rate_hz;
    if (t < begin_s || t >= end_s) continue;
    const double value = record->counts[axis] * newtons;
    if (result.values.empty()) {
      result.begin_s = t;
    } else {
      for (; next != record->ft_sequence && next < record->ft_sequence; next += scale.ft_stride)
        result.values.push_back(value);
    }
    result.values.push_back(value);
    next = record->ft_sequence + scale.ft_stride;
  }
  return result;
}

std::vector<TimedSample> speeds_between(const results::RunRecording& run, double begin_s, double end_s) {
  std::vector<TimedSample> result;
  for (const results::MotorReading& reading : run.motor) {
    const double t = seconds(reading.time_ns);
    if (reading.channel == results::MotorChannel::speed && t >= begin_s && t < end_s)
      result.push_back({t, std::abs(reading.value)});
  }
  return result;
}

}  // namespace kphi::fit
