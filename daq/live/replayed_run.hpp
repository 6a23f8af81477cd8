// A recorded run as the live view showed it: the same ticks, from the file.
#pragma once

#include <functional>

#include "base/clock.hpp"
#include "daq/live/messages.hpp"
#include "daq/run/progress.hpp"
#include "results/records.hpp"

namespace kphi::daq::live {

/// Has the limits of campaign, bench and devices recorded in the run; no limits if its campaign cannot be read.
[[nodiscard]] Subject subject_of(const results::RunRecording& recording);

class ReplayedRun {
 public:
  /// `recording` must outlive this. `clock` is set to the bench time that is shown.
  ReplayedRun(const results::RunRecording& recording, ManualClock& clock);

  /// First and last moment, bench time.
  [[nodiscard]] Instant begin() const { return begin_; }
  [[nodiscard]] Instant end() const { return end_; }
  /// Advances to `when`, and reports what a person saw then and which steps ended since the last call. Counts of lost
  /// samples cover the whole run. `speed`: bench seconds per wall second.
  void show(Instant when, Progress& progress, double speed);

 private:
  void observe(Instant when);
  void report_phases(Instant when, Progress& progress);

  const results::RunRecording& recording_;
  ManualClock& clock_;
  std::vector<MotorReading> motor_;  ///< by time
  Instant begin_{}, end_{};
  std::size_t sample_ = 0, reading_ = 0, supply_ = 0, phase_ = 0, event_ = 0;
  Position position_;
  Observer observer_;
  Observation seen_;
};

/// Plays the run with a hundred ticks a second, at `speed` times real time. False: stopped.
bool play(const results::RunRecording& recording, ManualClock& clock, Progress& progress, double speed,
          const std::function<bool()>& stop_asked);

}  // namespace kphi::daq::live
