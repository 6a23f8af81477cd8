#include "drivers/iq/service/clock_gain.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "base/error.hpp"

namespace kphi::iq {
namespace {

constexpr double kHostClock = 30e-6;      // a quartz within 50 ppm, rectangular
constexpr double kLeastDuration = 60;     // s
constexpr double kBelievableGain = 0.03;  // an RC oscillator over temperature
constexpr double kStanding = 5;           // rad/s
constexpr std::size_t kBins = 400;        // readings kept, spread over the time
constexpr int kSilences = 5;              // questions in a row without an answer: the module is gone

constexpr const char* kOperation = "measure its clock";
constexpr const Entry& kTime = entry<"system_control.time">;

/// What one reading says: at host time `t` the module's clock was within `module` ± `half`; seconds since the first.
struct Point {
  double t = 0, module = 0, half = 0;
};

/// One float32 step: the firmware may round or cut off.
double step_of(double value) {
  const auto single = static_cast<float>(value);
  return std::nextafter(single, std::numeric_limits<float>::infinity()) - single;
}

/// The least uncertain reading of each of kBins equal stretches of time: the others allow nothing less.
std::vector<Point> most_certain(std::span<const Answer> times) {
  const double whole = to_seconds(times.back().time - times.front().time);
  std::vector<Point> points;
  std::size_t bin = kBins;
  for (const Answer& answer : times) {
    const double t = to_seconds(answer.time - times.front().time);
    const double half = (1 + kBelievableGain) * to_seconds(answer.uncertainty) + step_of(answer.value);
    const auto here = std::min(kBins - 1, static_cast<std::size_t>(kBins * t / whole));
    if (here != bin) points.push_back({t, answer.value, half});
    if (here == bin && half < points.back().half) points.back() = {t, answer.value, half};
    bin = here;
  }
  return points;
}

struct Interval {
  double lowest = -std::numeric_limits<double>::infinity();
  double highest = std::numeric_limits<double>::infinity();
  [[nodiscard]] bool empty() const { return lowest > highest; }
};

/// Slopes of the lines that pass through all spans, each widened by `slack`.
Interval slopes(const std::vector<Point>& points, double slack) {
  Interval allowed;
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (std::size_t j = i + 1; j < points.size(); ++j) {
      const double dt = points[j].t - points[i].t;
      const double rise = points[j].module - points[i].module;
      const double play = points[j].half + points[i].half + 2 * slack;
      if (dt <= 0) continue;
      allowed.lowest = std::max(allowed.lowest, (rise - play) / dt);
      allowed.highest = std::min(allowed.highest, (rise + play) / dt);
    }
  }
  return allowed;
}

/// The least slack that lets a line through, to 1 %.
double least_slack(const std::vector<Point>& points) {
  if (!slopes(points, 0).empty()) return 0;
  double too_little = 0, enough = 1e-6;
  while (slopes(points, enough).empty()) enough *= 2;
  while (enough - too_little > 0.01 * enough) {
    const double middle = 0.5 * (too_little + enough);
    (slopes(points, middle).empty() ? too_little : enough) = middle;
  }
  return enough;
}

Answer require_answer(const Ask& ask, const Entry& asked) {
  for (int i = 0; i < kSilences; ++i) {
    const Reply reply = ask({{&asked, std::nullopt}}).at(0);
    if (reply.value && std::isfinite(*reply.value)) return {*reply.value, reply.time, reply.uncertainty};
  }
  throw DeviceError("IQ module", kOperation, fmt::format("no reply to get {}", asked.name()),
                    "check the line; update old firmware");
}

void require_standstill(const Ask& ask) {
  if (require_answer(ask, entry<"brushless_drive.drive_mode">).value != static_cast<double>(DriveMode::coast))
    throw DeviceError("IQ module", kOperation, "the motor does not coast", "coast it first");
  const double speed = require_answer(ask, entry<"brushless_drive.obs_velocity">).value;
  if (std::abs(speed) > kStanding)
    throw DeviceError("IQ module", kOperation, fmt::format("the motor turns at {:.0f} rad/s", speed),
                      "wait until it is at rest");
}

}  // namespace

ClockGain clock_gain(std::span<const Answer> times) {
  if (times.size() < 2 || times.back().time <= times.front().time)
    throw std::invalid_argument("a clock's gain needs readings at two times");
  const std::vector<Point> points = most_certain(times);
  ClockGain gain;
  gain.readings = times.size();
  gain.duration_s = to_seconds(times.back().time - times.front().time);
  gain.contradiction_s = least_slack(points);
  // A clock that contradicts its own readings has errors of a kind not thought of: twice what it takes.
  const Interval allowed = slopes(points, 2 * gain.contradiction_s);
  gain.lowest = allowed.lowest;
  gain.highest = allowed.highest;
  gain.factor = 0.5 * (allowed.lowest + allowed.highest);
  const double rectangular = 0.5 * (allowed.highest - allowed.lowest) / std::sqrt(3.0);
  gain.u_factor = std::hypot(rectangular, kHostClock);
  return gain;
}

ClockGain measure_clock_gain(const Ask& ask, const std::function<void(Duration)>& pause,
                             const ClockGainSettings& settings) {
  require_standstill(ask);
  (void)ask({{&kTime, 0.0}});  // its clock runs: what it reads back is later
  std::vector<Answer> times;
  const Duration whole = from_seconds(settings.duration_s);
  while (times.size() < 2 || times.back().time - times.front().time < whole) {
    const Answer answer = require_answer(ask, kTime);
    if (!times.empty() && answer.value < times.back().value)
      throw DeviceError("IQ module", kOperation, "its time went backwards: it has restarted",
                        "check its supply and try again");
    times.push_back(answer);
    pause(settings.interval);
  }
  require_standstill(ask);
  return clock_gain(times);
}

std::string ClockGain::yaml() const {
  return fmt::format("clock_gain: {{factor: {:.7f}, u: {:.1e}, uid: \"{}\", measured_utc: \"{}\", duration_s: {:.1f}}}",
                     factor, u_factor, uid, measured_utc, duration_s);
}

std::vector<Finding> ClockGain::findings() const {
  std::vector<Finding> findings;
  if (std::abs(factor - 1) > kBelievableGain)
    findings.push_back({Severity::fault,
                        fmt::format("implausible gain {:.5f}: the module may not count seconds", factor),
                        "do not use it; check the firmware version"});
  if (duration_s < kLeastDuration)
    findings.push_back(
        {Severity::warning,
         fmt::format("{:.0f} s is short: the uncertainty of the speed is {:.0f} ppm", duration_s, 1e6 * u_factor),
         fmt::format("measure for {:.0f} s or more", kLeastDuration)});
  if (contradiction_s > 0)
    findings.push_back(
        {Severity::warning,
         fmt::format("no line fits the readings within {:.3g} ms: the module's clock drifts, or its time "
                     "moves in steps",
                     1e3 * contradiction_s),
         "let the module come to a steady temperature and measure again, for longer"});
  return findings;
}

}  // namespace kphi::iq
