// Steps through the phases of one run: zero, steps, spin-down, zero.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <span>
#include <string>

#include "base/clock.hpp"
#include "compensation/units.hpp"
#include "daq/guard/guard.hpp"
#include "daq/run/progress.hpp"
#include "daq/run/recorder.hpp"
#include "daq/run/run_order.hpp"
#include "drivers/iq/session/stopping.hpp"
#include "profiles/run_certainty.hpp"

namespace kphi::daq {

class Slew {
 public:
  /// `rate_rad_s2` > 0; nullopt: changes at once.
  Slew(RadPerSec from, RadPerSec to, std::optional<double> rate_rad_s2)
      : from_(from), to_(to), lasts_s_(rate_rad_s2 ? std::abs((to - from).value()) / *rate_rad_s2 : 0) {}
  [[nodiscard]] Duration lasts() const { return from_seconds(lasts_s_); }
  /// Speed to command at `since` after the start.
  [[nodiscard]] RadPerSec at(Duration since) const {
    if (!(to_seconds(since) < lasts_s_)) return to_;
    return from_ + (to_ - from_) * (std::max(0.0, to_seconds(since)) / lasts_s_);
  }

 private:
  RadPerSec from_, to_;
  double lasts_s_;
};

/// The runner's thread. The arguments must outlive it.
class Sequence {
 public:
  Sequence(Bench& bench, Recorder& recorder, Guard& guard, const RunOrder& order, Progress& progress,
           const std::function<bool()>& stop_asked);
  void run();
  [[nodiscard]] const results::BoxBias& box_bias() const { return box_bias_; }
  [[nodiscard]] const std::optional<iq::StopReport>& stop() const { return stop_; }
  /// Steps left out because k was certain enough without them.
  [[nodiscard]] int steps_not_needed() const { return steps_not_needed_; }
  /// The supply switched itself off, but another cause was seen first.
  [[nodiscard]] const std::optional<StreamEvent>& supply_event() const { return supply_event_; }
  /// After the motor was coasted: adds to `words` the state of motor and supply, and what else the module reported.
  void add_aftermath(StopWords& words);
  /// Call it once the stream has stopped and no other thread drains the recorder.
  void compare_configuration(int attempts);
  /// After a stop: why the load cell fell silent, if the box reports a reason; else empty.
  std::string explanation();

 private:
  /// Reports a tripped supply even when the failure of the starved module was seen first.
  void switch_off(StopWords& words);
  /// Waits for the coast to be confirmed, and for standstill.
  void watch_the_coast(StopWords& words);
  void show_coast();
  void take_box_bias();
  void set_box_bias();
  void spin();
  void go_through_the_steps(MotorEnable& spin);
  /// As the steering wants, no faster than the campaign's slew.
  void follow(Steering& steering, MotorEnable& spin);
  void leave_out(std::ptrdiff_t steps);
  void ends_sooner(double seconds);
  /// With `certainty` until it is certain enough, at most as long as the campaign says; else to its end.
  void hold_step(const profiles::PlannedStep& step, std::optional<profiles::RunCertainty>& certainty,
                 MotorEnable& spin);
  void hold_until_certain(const profiles::PlannedStep& step, profiles::RunCertainty& certainty, MotorEnable& spin);
  /// If the motor missed a speed at full drive, the run skips the `later` steps at or above it.
  void learn_from(const profiles::PlannedStep& step, std::span<const profiles::PlannedStep> later);
  void mark(results::Phase phase, int step = -1, RadPerSec commanded = RadPerSec(0));
  /// Takes no time if the campaign sets no ramp.
  void ramp_to(RadPerSec level, MotorEnable& spin);
  void change_speed();
  netbox::ZeroMeasurement hold_zero(results::Phase phase);
  /// Refuses a noisy zero before anything turns: all thrusts would inherit its error.
  void require_rest();
  void wait_for_standstill();
  void hold(Duration duration, MotorEnable* spin = nullptr);
  void tick(MotorEnable* spin);
  void show_progress();
  void show_events();

  Bench& bench_;
  Recorder& recorder_;
  Guard& guard_;
  const RunOrder& order_;
  Progress& progress_;
  const std::function<bool()>& stop_asked_;
  Position position_;
  Observation seen_;
  double zero_n_ = 0;        ///< of the thrust axis, as the box shows it
  Instant begin_{}, end_{};  ///< of this run, as planned
  int events_shown_ = 0;
  std::string stalled_;  ///< the event that says that the box's measurement stalled; empty while it measures
  results::BoxBias box_bias_;
  int steps_not_needed_ = 0;
  bool has_spun_ = false;
  bool power_is_off_ = false;              ///< confirmed by the supply
  std::optional<RadPerSec> out_of_reach_;  ///< the lowest speed missed at full drive
  std::optional<iq::StopReport> stop_;
  std::optional<StreamEvent> supply_event_;
};

}  // namespace kphi::daq
