// Steps through the phases of one run: zero, steps, spin-down, zero.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "daq/guard.hpp"
#include "daq/recorder.hpp"
#include "daq/run.hpp"
#include "daq/spin.hpp"

namespace kphi::daq {

/// The runner's thread. Whoever makes it keeps all that it is given.
class Sequence {
 public:
  Sequence(Bench& bench, Recorder& recorder, Guard& guard, const RunOrder& order, Progress& progress,
           const std::function<bool()>& stop_asked);
  void run();
  [[nodiscard]] const results::BoxBias& box_bias() const { return box_bias_; }
  [[nodiscard]] const std::optional<iq::StopReport>& stop() const { return stop_; }
  /// That the supply had switched itself off, when another cause was seen first.
  [[nodiscard]] const std::optional<results::StreamEvent>& supply_event() const { return supply_event_; }
  /// After the motor was let go: adds to `words` what became of motor and supply, and what else the module tells.
  void add_aftermath(StopWords& words);
  /// After the stream has ended, and nobody drains any more.
  void compare_configuration(int attempts);
  /// After a stop: when the load cell has fallen silent, why, as far as the box tells; else empty.
  std::string explanation();

 private:
  /// A supply that has tripped says so even when the module, which starved, was heard first.
  void switch_off(StopWords& words);
  /// Waits for the coast to be confirmed, and for standstill.
  void watch_the_coast(StopWords& words);
  void take_box_bias();
  void set_box_bias();
  netbox::ZeroMeasurement measure(results::Phase phase);
  void spin_through_the_steps();
  void hold_step(const profiles::PlannedStep& step, Spin& spin);
  /// The motor had no drive left at `level`: what the run still has from there up is left out.
  void learn_from(const profiles::PlannedStep& step);
  void mark(results::Phase phase, int step, RadPerSec commanded);
  /// Takes no time when the campaign lets the speed change at once.
  void ramp_to(RadPerSec level, Spin& spin);
  void change_speed();
  void hold_zero(results::Phase phase);
  /// Nothing turns while the cell is not at rest: the zero would be worth nothing, and all that is measured against it.
  void require_rest();
  void wait_for_standstill();
  void hold(Duration duration, Spin* spin);
  void tick(Spin* spin);
  void tell_events();

  Bench& bench_;
  Recorder& recorder_;
  Guard& guard_;
  const RunOrder& order_;
  Progress& progress_;
  const std::function<bool()>& stop_asked_;
  Position position_;
  Observation seen_;
  Instant end_{};
  int told_ = 0;
  std::string standstill_;  ///< of the box's measurement, as told; empty while it measures
  results::BoxBias box_bias_;
  bool has_spun_ = false;
  bool power_is_off_ = false;              ///< confirmed by the supply
  std::optional<RadPerSec> out_of_reach_;  ///< the lowest level for which the drive was not enough
  std::optional<iq::StopReport> stop_;
  std::optional<results::StreamEvent> supply_event_;
};

}  // namespace kphi::daq
