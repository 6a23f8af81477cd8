// What the values of a flight log say of how it was taken: gaps, saturation, dead channels, axes that look wrong.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>

#include "base/statistics.hpp"
#include "fit/flights/flight_series.hpp"
#include "fit/flights/resampling.hpp"

namespace kphi::fit {
namespace {

constexpr double kGapPeriods = 5;
constexpr int kSaturatedRun = 3;   // values in a row at an end of the range
constexpr double kFarSteps = 100;  // of resolution from the median: where noise about rest does not reach
constexpr std::size_t kFewestValues = 20;

/// "3 gaps of more than 5 periods of 0.001 s, 0.16 s at most, at 12.3 s"
std::string gaps_of(const FlightChannel& channel) {
  const double period = period_of(channel);
  std::size_t gaps = 0;
  double longest = 0, at = 0;
  for (std::size_t i = 1; i < channel.time_s.size(); ++i) {
    const double gap = channel.time_s[i] - channel.time_s[i - 1];
    if (!(gap > kGapPeriods * period)) continue;
    ++gaps;
    if (gap > longest) longest = gap, at = channel.time_s[i - 1];
  }
  return gaps == 0 ? ""
                   : fmt::format("{} gaps of more than {:g} periods of {:.3g} s, {:.3g} s at most, at {:.3f} s", gaps,
                                 kGapPeriods, period, longest, at);
}

/// Values that are one of `end` in runs of kSaturatedRun and more.
std::size_t held_at(const FlightChannel& channel, double end) {
  std::size_t held = 0, run = 0;
  for (const double value : channel.values) {
    run = value == end ? run + 1 : 0;
    held += run == kSaturatedRun ? kSaturatedRun : run > kSaturatedRun ? 1 : 0;
  }
  return held;
}

/// The smallest step between neighbours.
double resolution_of(const FlightChannel& channel) {
  double smallest = INFINITY;
  for (std::size_t i = 1; i < channel.values.size(); ++i)
    if (const double step = std::abs(channel.values[i] - channel.values[i - 1]); step > 0)
      smallest = std::min(smallest, step);
  return smallest;
}

/// A sensor at an end of its range gives that end again and again, far from where it is usually.
std::string saturation_of(const FlightChannel& channel) {
  const auto [low, high] = std::ranges::minmax(channel.values);
  const double middle = upper_median(channel.values), far = kFarSteps * resolution_of(channel);
  const std::size_t at_low = middle - low > far ? held_at(channel, low) : 0;
  const std::size_t at_high = high - middle > far ? held_at(channel, high) : 0;
  return at_low + at_high == 0 ? ""
                               : fmt::format("{} values stay at {:.4g}, the end of its range", at_low + at_high,
                                             at_high > 0 ? high : low);
}

class Audit {
 public:
  /// One finding of gaps for channels of one quantity, which mostly share a clock.
  void look_at(FlightQuantity quantity, std::span<const FlightChannel> channels, bool is_sensor) {
    std::string gaps;
    for (std::size_t i = 0; i < channels.size(); ++i) {
      const FlightChannel& channel = channels[i];
      const std::string name =
          channels.size() == 1 ? name_of(quantity) : fmt::format("{} {}", name_of(quantity), i + 1);
      if (channel.values.empty() && channels.size() > 1 && any(channels)) warn(name + " is not in the log", "");
      if (channel.values.size() < kFewestValues) continue;
      if (gaps.empty()) gaps = gaps_of(channel);
      if (!is_sensor) continue;
      const auto [low, high] = std::ranges::minmax(channel.values);
      if (low == high)
        warn(fmt::format("{} is {:.4g} throughout", name, low), "check the sensor");
      else if (const std::string words = saturation_of(channel); !words.empty())
        warn(name + ": " + words, "leave these times out, or widen the sensor's range");
    }
    if (!gaps.empty()) warn(fmt::format("{}: {}", name_of(quantity), gaps), "");
  }

  /// A multirotor's specific force is mostly thrust: upward, and some 10 m/s² in the middle.
  void look_at_axes(const FlightLog& log) {
    double middle[3]{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (log.specific_force[axis].values.size() < kFewestValues) return;
      middle[axis] = upper_median(log.specific_force[axis].values);
    }
    const std::string words =
        fmt::format("the median of the specific force is {:.2f}, {:.2f}, {:.2f} m/s², where 0, 0, 9.8 is usual",
                    middle[0], middle[1], middle[2]);
    if (middle[2] < -5)
      warn(words + ": z points down", "say frame FRD in the flight layout");
    else if (std::abs(middle[2]) < 3 && std::hypot(middle[0], middle[1]) > 5)
      warn(words + ": another axis is up", "name the axes in a flight layout");
    else if (middle[2] < 3 || middle[2] > 30)
      warn(words, "check the unit and the axes");
  }

  std::vector<Finding> findings;

 private:
  static bool any(std::span<const FlightChannel> channels) {
    return std::ranges::any_of(channels, [](const FlightChannel& one) { return !one.values.empty(); });
  }
  void warn(const std::string& what, const std::string& next_move) {
    findings.push_back({Severity::warning, what, next_move});
  }
};

}  // namespace

std::vector<Finding> audit_channels(const FlightLog& log) {
  Audit audit;
  audit.look_at(FlightQuantity::specific_force, log.specific_force, true);
  audit.look_at(FlightQuantity::angular_rate, log.angular_rate, true);
  audit.look_at(FlightQuantity::angular_acceleration, log.angular_acceleration, true);
  audit.look_at(FlightQuantity::rotor_speed, log.rotor_speed, false);
  audit.look_at(FlightQuantity::command, log.command, false);
  audit.look_at(FlightQuantity::arm_angle, log.arm_angle, false);
  audit.look_at_axes(log);
  return std::move(audit.findings);
}

}  // namespace kphi::fit
