// A recorded run as it looked while it was measured: the same ticks, from the file.
#pragma once

#include <functional>

#include "daq/live/subject.hpp"
#include "daq/progress.hpp"
#include "drivers/clock.hpp"
#include "results/records.hpp"

namespace kphi::daq::live {

/// Limits are those of campaign, bench and devices that the run carries with it; none when its campaign cannot be read
/// any more.
[[nodiscard]] Subject subject_of(const results::RunRecording& recording);

class ReplayedRun {
 public:
  /// `recording` must outlive this. `clock` is set to the bench time that is shown.
  ReplayedRun(const results::RunRecording& recording, ManualClock& clock);

  /// First and last moment, bench time.
  [[nodiscard]] Instant begin() const { return begin_; }
  [[nodiscard]] Instant end() const { return end_; }
  /// Goes on to `when` and tells what a person saw then, with all that was over since the last call. The counts of lost
  /// samples are those of the whole run. `speed`: bench seconds per second of whoever watches.
  void show(Instant when, Progress& progress, double speed);

 private:
  void observe(Instant when);
  void tell_phases(Instant when, Progress& progress);
  [[nodiscard]] double mean_counts(std::size_t axis, std::size_t from, std::size_t to) const;

  const results::RunRecording& recording_;
  ManualClock& clock_;
  std::vector<results::MotorReading> motor_;  ///< by time
  std::array<double, 6> zero_{};              ///< counts
  Instant begin_{}, end_{};
  std::size_t sample_ = 0, reading_ = 0, supply_ = 0, phase_ = 0, event_ = 0;
  Position position_;
  Observation seen_;
};

/// Shows the whole run, a hundred times a second, `speed` times as fast as it was. False: stopped.
bool play(const results::RunRecording& recording, ManualClock& clock, Progress& progress, double speed,
          const std::function<bool()>& stop_asked);

}  // namespace kphi::daq::live
