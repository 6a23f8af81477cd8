// How fast the module's clock runs against this host's. The 23-XX modules have no crystal: their seconds are off by up
// to some tenths of a percent, and with them every speed they report.
//
// The clock gain is d(module time)/d(host time), 1 for a perfect clock. A module whose clock runs fast counts more of
// its seconds while the rotor turns once, and reports a lower speed:
//     true speed = reported speed · clock gain                              (so thrust/ω² is off by gain²)
// That time and speed come from the same clock is inferred, not published: check it once with a tachometer.
//
// Estimate. Each reading of system_control.time was taken within a known span, between the end of its question and the
// beginning of its reply, and is known to a step of float32 (4 µs at 60 s). Every reading so gives two lines that the
// clock cannot have crossed; the gains that all readings allow form an interval, and the truth lies in it whatever the
// delays were: late stamps have wide spans and merely say little. No noise model, no outliers.
//
// In a bench file: iq: {clock_gain: {factor: 1.00503, u: 1.2e-5, uid: "…", measured_utc: "…", duration_s: 60}}
#pragma once

#include <span>
#include <string>
#include <vector>

#include "drivers/clock.hpp"
#include "drivers/finding.hpp"
#include "drivers/iq/dialogue.hpp"

namespace kphi::iq {

struct ClockGain {
  double factor = 1;               ///< module seconds per host second
  double u_factor = 0;             ///< standard uncertainty, with that of the host's clock (a quartz: 30e-6)
  double lowest = 0, highest = 0;  ///< the interval of gains that all readings allow, against this host's clock
  double duration_s = 0;           ///< first to last reading, bench time
  std::size_t readings = 0;
  double contradiction_s = 0;  ///< by so much the spans had to be widened for any line to fit: 0 when all is as said
  std::string uid;
  std::string measured_utc;  ///< ISO 8601, Z

  /// How far the module's clock is ahead: + = fast.
  [[nodiscard]] double ppm() const noexcept { return 1e6 * (factor - 1); }
  /// For the bench file, one line: "clock_gain: {factor: …, u: …, uid: …, measured_utc: …, duration_s: …}"
  [[nodiscard]] std::string yaml() const;
  /// What makes it doubtful: too short, contradictory, a gain that no oscillator has.
  [[nodiscard]] std::vector<Finding> findings() const;
};

/// `times`: readings of system_control.time, in the order of time. Throws std::invalid_argument for less than two, or
/// none apart from the first.
[[nodiscard]] ClockGain clock_gain(std::span<const Answer> times);

struct ClockGainSettings {
  double duration_s = 60;                             ///< bench time; shorter is less certain
  Duration interval = std::chrono::milliseconds(20);  ///< between two readings, bench time
};

/// Sets the module's time to 0 (float32 is finest there) and reads it for a while. Only with a motor that stands:
/// throws DeviceError when it does not coast or turns, when the module does not tell its time, or when it restarts
/// meanwhile. `uid` and `measured_utc` are left to the caller.
[[nodiscard]] ClockGain measure_clock_gain(Dialogue& module, const ClockGainSettings& settings = {});

}  // namespace kphi::iq
