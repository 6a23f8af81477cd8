#include "results/reduction/motor_series.hpp"

#include <algorithm>
#include <cmath>

#include "base/statistics.hpp"

namespace kphi::results {
namespace {

bool is_glitch(std::span<const MotorReading> speeds, std::size_t i) {
  if (i < 2 || i + 2 >= speeds.size()) return false;
  const auto value = [&](std::size_t k) { return speeds[k].value; };
  const double middle = upper_median({value(i - 2), value(i - 1), value(i), value(i + 1), value(i + 2)});
  return std::abs(value(i) - middle) > std::max(kGlitchShare * std::abs(middle), kGlitchSpeed);
}

MotorSeries::Readings readings_of(MotorSeries::Readings readings, MotorChannel channel, const Window& window) {
  const auto at = [&](Nanoseconds time) {
    return std::partition_point(readings.begin(), readings.end(), [&](const MotorReading& r) {
      return r.channel < channel || (r.channel == channel && r.time_ns < time);
    });
  };
  const auto begin = at(window.begin);
  const auto end = at(window.end);
  return readings.subspan(static_cast<std::size_t>(begin - readings.begin()),
                          static_cast<std::size_t>(std::max<std::ptrdiff_t>(end - begin, 0)));
}

}  // namespace

MotorSeries::MotorSeries(std::span<const MotorReading> readings) : readings_(readings) {
  const Readings speeds =
      readings_of(readings, MotorChannel::speed,
                  {std::numeric_limits<Nanoseconds>::min(), std::numeric_limits<Nanoseconds>::max()});
  speeds_.reserve(speeds.size());
  for (std::size_t i = 0; i < speeds.size(); ++i) {
    if (is_glitch(speeds, i)) {
      glitches_.push_back(speeds[i].time_ns);
    } else {
      speeds_.push_back(speeds[i]);
    }
  }
}

MotorSeries::Readings MotorSeries::over(MotorChannel channel, const Window& window) const {
  return readings_of(channel == MotorChannel::speed ? Readings(speeds_) : readings_, channel, window);
}

Statistics MotorSeries::statistics(MotorChannel channel, const Window& window, double sign) const {
  Statistics s;
  std::vector<double> values;
  for (const MotorReading& r : over(channel, window)) {
    values.push_back(sign * r.value);
    s.least = std::min(s.least, values.back());
  }
  s.n = values.size();
  s.error = mean_error(values);
  s.mean = s.error.mean;
  if (s.n > 1) s.deviation = std::sqrt(variance(values));
  return s;
}

std::uint64_t MotorSeries::glitches(const Window& window) const {
  return static_cast<std::uint64_t>(
      std::ranges::count_if(glitches_, [&](auto time) { return time >= window.begin && time < window.end; }));
}

bool MotorSeries::speed_frozen(const Window& window) const {
  const Readings speeds = over(MotorChannel::speed, window);
  for (auto first = speeds.begin(); first != speeds.end();) {
    const auto next =
        std::find_if(std::next(first), speeds.end(), [&](const MotorReading& r) { return r.value != first->value; });
    const double span = 1e-9 * static_cast<double>(std::prev(next)->time_ns - first->time_ns);
    if (first->value != 0 && next - first >= kFrozenReadings && span >= kFrozenSpeedSpan) return true;
    first = next;
  }
  return false;
}

}  // namespace kphi::results
