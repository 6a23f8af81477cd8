// How fast the module's clock runs against this host's. The 23-XX modules have no crystal: their seconds are off by up
// to some tenths of a percent, and with them every speed they report.
//
// The clock gain is d(module time)/d(host time), 1 for a perfect clock. A module whose clock runs fast counts more of
// its seconds while the rotor turns once, and reports a lower speed:
//     true speed = reported speed · clock gain                              (so thrust/ω² is off by gain²)
// That time and speed use the same clock is inferred, not published: check it once with a tachometer.
//
// Estimate. Each reading of system_control.time was taken within a known span, between the end of its query and the
// beginning of its reply, and is known to one step of float32 (4 µs at 60 s). Every reading thus gives two bounds that
// the clock cannot have crossed; the gains that all readings allow form an interval, and the true gain lies in it
// whatever the delays were: a late reading has a wide span and merely adds little. No noise model, no outliers.
//
// In a bench file: iq: {clock_gain: {factor: 1.00503, u: 1.2e-5, uid: "…", measured_utc: "…", duration_s: 60}}
#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "base/clock.hpp"
#include "base/finding.hpp"
#include "drivers/iq/session/connecting.hpp"

namespace kphi::iq {

/// A reading of system_control.time.
struct Answer {
  double value = 0;         ///< s
  Instant time{0};          ///< bench time: the middle of the span in which the module read the value
  Duration uncertainty{0};  ///< half of that span: from the end of the question to the beginning of the reply
};

struct ClockGain {
  double factor = 1;               ///< module seconds per host second
  double u_factor = 0;             ///< standard uncertainty, with that of the host's clock (a quartz: 30e-6)
  double lowest = 0, highest = 0;  ///< the interval of gains that all readings allow, against this host's clock
  double duration_s = 0;           ///< first to last reading, bench time
  std::size_t readings = 0;
  double contradiction_s = 0;  ///< by which the spans had to be widened for any line to fit; 0: consistent
  std::string uid;
  std::string measured_utc;  ///< ISO 8601, Z

  /// Rate error of the module's clock: + = fast.
  [[nodiscard]] double ppm() const noexcept { return 1e6 * (factor - 1); }
  /// For the bench file, one line: "clock_gain: {factor: …, u: …, uid: …, measured_utc: …, duration_s: …}"
  [[nodiscard]] std::string yaml() const;
  /// Reasons for doubt: too short, contradictory, a gain that no oscillator has.
  [[nodiscard]] std::vector<Finding> findings() const;
};

/// `times`: readings of system_control.time, in the order of time. Throws std::invalid_argument unless they cover at
/// least two different times.
[[nodiscard]] ClockGain clock_gain(std::span<const Answer> times);

struct ClockGainSettings {
  double duration_s = 60;                             ///< bench time; shorter is less certain
  Duration interval = std::chrono::milliseconds(20);  ///< between two readings, bench time
};

/// Sets the module's time to 0 (float32 is finest there) and reads it for duration_s. Needs a motor at rest: throws
/// DeviceError when it does not coast or turns, when the module does not answer, or when it restarts meanwhile. `pause`
/// returns after so much bench time. The caller fills in `uid` and `measured_utc`.
[[nodiscard]] ClockGain measure_clock_gain(const Ask& ask, const std::function<void(Duration)>& pause,
                                           const ClockGainSettings& settings = {});

}  // namespace kphi::iq
